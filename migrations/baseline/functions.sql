-- Functions that computed columns of tunnel.coverage call.

-- Sums of a kilometre, so that nobody has to add up its 10 000 steps; made by the database, whoever writes the row.
CREATE FUNCTION tunnel.total(steps real[]) RETURNS double precision
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
AS $$ SELECT sum(s::double precision) FROM unnest(steps) AS s $$;
COMMENT ON FUNCTION tunnel.total(real[]) IS 'Sum of the steps of a kilometre';

-- Whoever asks for a stretch needs the sums at its ends and at those of its leaks: without these, of all steps before each.
CREATE FUNCTION tunnel.running_sums(steps real[]) RETURNS double precision[]
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
AS $$
    SELECT 0::double precision || array_agg(t.total ORDER BY t.n)
      FROM (SELECT s.n, sum(s.step::double precision) OVER (ORDER BY s.n ROWS UNBOUNDED PRECEDING) AS total
              FROM unnest(steps) WITH ORDINALITY AS s (step, n)) AS t
$$;
COMMENT ON FUNCTION tunnel.running_sums(real[]) IS 'Sums of the steps of a kilometre before each of them, and of all';
