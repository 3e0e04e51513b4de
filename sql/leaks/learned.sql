-- Model of evidence adapted to the reviews of a tunnel: applied and undone by operators, with entries in the audit of each
-- survey of the tunnel. The last one that was not undone is in force; stage detect uses it (stages/status.sql: stale). Needs
-- note_edit (access/audit.sql).

-- Number of the model in force for a tunnel; NULL if there is none.
CREATE OR REPLACE FUNCTION tunnel_internal.learned_in_force(tunnel_id integer) RETURNS integer
LANGUAGE sql STABLE STRICT PARALLEL SAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT max(m.id) FROM tunnel.learned_model m WHERE m.tunnel_id = $1 AND m.undone_at IS NULL
$$;
COMMENT ON FUNCTION tunnel_internal.learned_in_force(integer) IS
    'Number of the adapted model of evidence in force for a tunnel; NULL if there is none';

CREATE OR REPLACE VIEW tunnel_api.learned_model AS
SELECT m.id, m.tunnel_id, t.name AS tunnel, m.id = tunnel_internal.learned_in_force(m.tunnel_id) AS in_force, m.base, m.way,
       m.parameters, m.surveys, m.reviews, m.loss_base, m.loss, m.note, m.applied_by, m.active_from, m.undone_by, m.undone_at
  FROM tunnel.learned_model m
  JOIN tunnel.tunnel t ON t.id = m.tunnel_id;
COMMENT ON VIEW tunnel_api.learned_model IS 'Models of evidence that were adapted to a tunnel''s reviews (tunneldb learn)';
COMMENT ON COLUMN tunnel_api.learned_model.in_force IS
    'True if stage detect uses the model: the last of its tunnel that was not undone';

-- Write an entry to the audit of each survey of a tunnel.
CREATE OR REPLACE FUNCTION tunnel_internal.note_learned(tunnel_id integer, id integer, before jsonb, after jsonb) RETURNS void
LANGUAGE sql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp AS $$
    SELECT tunnel_internal.note_edit(s.name, 'learned_model', $2, $3, $4) FROM tunnel.survey s WHERE s.tunnel_id = $1 ORDER BY s.id
$$;
COMMENT ON FUNCTION tunnel_internal.note_learned(integer, integer, jsonb, jsonb) IS
    'Write an entry of the audit for each survey of a tunnel whose model of evidence was adapted or reset. Only other functions call it';

-- Put an adapted model in force and return its number.
CREATE OR REPLACE FUNCTION tunnel_internal.learned_apply(tunnel_id integer, base text, way text, parameters jsonb, surveys text[],
                                                    reviews jsonb, loss_base double precision, loss double precision, note text)
RETURNS integer
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE CALLED ON NULL INPUT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    made tunnel.learned_model;
BEGIN
    INSERT INTO tunnel.learned_model (tunnel_id, base, way, parameters, surveys, reviews, loss_base, loss, note, applied_by)
    VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, session_user)
    RETURNING * INTO made;
    PERFORM tunnel_internal.note_learned(made.tunnel_id, made.id, NULL,
                                    to_jsonb(made) - ARRAY['id', 'tunnel_id', 'applied_by', 'active_from', 'undone_by', 'undone_at']);
    RETURN made.id;
END
$$;
COMMENT ON FUNCTION tunnel_internal.learned_apply(integer, text, text, jsonb, text[], jsonb, double precision, double precision, text) IS
    'Put an adapted model of evidence in force for a tunnel, write it to the audit, and return its number';

-- Undo the model in force; the one before is in force again. Returns its number; NULL if none was in force.
CREATE OR REPLACE FUNCTION tunnel_internal.learned_undo(tunnel_id integer) RETURNS integer
LANGUAGE plpgsql VOLATILE STRICT PARALLEL UNSAFE SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
DECLARE
    gone tunnel.learned_model;
BEGIN
    UPDATE tunnel.learned_model m SET undone_by = session_user, undone_at = clock_timestamp()
     WHERE m.id = tunnel_internal.learned_in_force($1)
    RETURNING m.* INTO gone;
    IF NOT FOUND THEN
        RETURN NULL;
    END IF;
    PERFORM tunnel_internal.note_learned(gone.tunnel_id, gone.id, jsonb_build_object('undone', false), jsonb_build_object('undone', true));
    RETURN gone.id;
END
$$;
COMMENT ON FUNCTION tunnel_internal.learned_undo(integer) IS
    'Undo the last adaptation of a tunnel''s model of evidence, write it to the audit, and return its number; NULL if there is none';
