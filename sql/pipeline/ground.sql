-- Stage ground: write the class of each point. The models are computed outside the database (tunneldb.classification).

-- Write the classes of the points of a kilometre: the partition is rewritten in the order of its rows and swapped in. An
-- UPDATE takes four times as long and leaves dead rows. classes: one byte for each row, in the order of a sequential scan of
-- the partition.
CREATE OR REPLACE FUNCTION tunnel_internal.class_write(survey_id int, km int, classes bytea)
RETURNS bigint
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE STRICT
SET synchronize_seqscans = off  -- from the first row to the last one
SET max_parallel_workers_per_gather = 0
SET plan_cache_mode = force_custom_plan
AS $$
DECLARE
    name constant text := tunnel_internal.partition_name(survey_id, km);
    written bigint;
BEGIN
    PERFORM tunnel_internal.partition_new(survey_id, km);
    EXECUTE format($query$
        INSERT INTO tunnel.%I (survey_id, km, chainage, gps_time, geom, segment, scan_id, file_id, intensity, classification, "class")
        SELECT p.survey_id, p.km, p.chainage, p.gps_time, p.geom, p.segment, p.scan_id, p.file_id, p.intensity, p.classification,
            get_byte($1, (row_number() OVER () - 1)::int)
        FROM tunnel.%I p
    $query$, name || '_new', name) USING classes;
    GET DIAGNOSTICS written = ROW_COUNT;
    IF written <> length(classes) THEN
        RAISE EXCEPTION 'kilometre % holds % points, not %', km, written, length(classes);
    END IF;
    PERFORM tunnel_internal.partition_swap(survey_id, km);
    RETURN written;
END
$$;
COMMENT ON FUNCTION tunnel_internal.class_write(int, int, bytea) IS
'Rewrite the partition of one kilometre with the classes of its points, one byte each in the order of rows, and return the number of points';
