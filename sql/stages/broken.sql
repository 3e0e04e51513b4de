-- Rows with numbers that nothing can be computed with. Constraints and triggers refuse them; they come about by a superuser, or
-- where a constraint was dropped.

CREATE OR REPLACE FUNCTION tunnel_internal.broken_rows(of_survey int DEFAULT NULL) RETURNS TABLE (name text, fault text, remedy text)
LANGUAGE sql STABLE PARALLEL RESTRICTED CALLED ON NULL INPUT SECURITY DEFINER ROWS 1 SET search_path = pg_catalog, pg_temp AS $$
    SELECT format('tunnel %s', t.name), 'its start chainage, its spacing or its limit of dry regions is not a possible number',
           format('UPDATE tunnel.tunnel SET start_chainage = …, spacing = … WHERE id = %s;', t.id)
      FROM tunnel.tunnel t
     WHERE (t.start_chainage NOT BETWEEN -1e8 AND 1e8 OR t.spacing NOT BETWEEN 0.1 AND 1000 OR t.dry_region_limit NOT BETWEEN 0 AND 1e8)
       AND ($1 IS NULL OR t.id = (SELECT s.tunnel_id FROM tunnel.survey s WHERE s.id = $1))
     UNION ALL
    SELECT format('survey %s', s.name), format('its date is %s', s.date),
           format('UPDATE tunnel.survey SET date = ''YYYY-MM-DD'' WHERE id = %s;', s.id)
      FROM tunnel.survey s WHERE s.date NOT BETWEEN '1900-01-01' AND '2199-12-31' AND s.id = coalesce($1, s.id)
     UNION ALL
    SELECT format('axis vertex %s of %s', v.n, s.name), format('its position is %s', public.ST_AsText(v.geom, 3)),
           format('UPDATE tunnel.axis_vertex SET geom = given WHERE id = %s; then tunneldb run %s --stale', v.id, s.name)
      FROM tunnel.axis_vertex v
      JOIN tunnel.survey s ON s.id = v.survey_id
     WHERE s.id = coalesce($1, s.id)
       AND (NOT coalesce(public.ST_X(v.geom) BETWEEN -1e8 AND 1e8 AND public.ST_Y(v.geom) BETWEEN -1e8 AND 1e8
                        AND public.ST_Z(v.geom) BETWEEN -1e8 AND 1e8, false)
            OR (v.source = 'edited' AND public.ST_3DDistance(v.geom, v.given) > 25))
     UNION ALL
    SELECT format('segment %s of %s', g.n, s.name), 'its planes are not numbers',
           format('tunneldb run %s --km %s --from segments', s.name, g.km)
      FROM tunnel.segment g
      JOIN tunnel.survey s ON s.id = g.survey_id
     CROSS JOIN LATERAL (
            SELECT g.vertex_from || g.vertex_to || g.tangent_from || g.tangent_to || g.chainage_from || g.chainage_to AS numbers) n
     WHERE s.id = coalesce($1, s.id) AND (1e8 < ANY (n.numbers) OR -1e8 > ANY (n.numbers))
     UNION ALL
    SELECT format('section at %s m of %s', e.chainage, s.name), 'its radii are not numbers',
           format('tunneldb run %s --km %s --from sections', s.name, e.km)
      FROM tunnel.section e
      JOIN tunnel.survey s ON s.id = e.survey_id
     CROSS JOIN LATERAL (SELECT e.radius || e.arc || e.chainage AS numbers) n
     WHERE s.id = coalesce($1, s.id) AND (1e8 < ANY (n.numbers) OR -1e8 > ANY (n.numbers))
     UNION ALL
    SELECT format('finding %s of %s', a.id, s.name), 'its place or its size is not a possible number',
           format('DELETE FROM tunnel.finding WHERE id = %s; then tunneldb run %s --from detect', a.id, s.name)
      FROM tunnel.finding a
      JOIN tunnel.survey s ON s.id = a.survey_id
     WHERE s.id = coalesce($1, s.id)
       AND (a.chainage_from NOT BETWEEN -1e8 AND 1e8 OR a.chainage_to NOT BETWEEN -1e8 AND 1e8 OR a.arc_from NOT BETWEEN -1e8 AND 1e8
            OR a.arc_to NOT BETWEEN -1e8 AND 1e8 OR a.area NOT BETWEEN 0 AND 1e8 OR a.length NOT BETWEEN 0 AND 1e8
            OR a.clock NOT BETWEEN 0 AND 12)
$$;
COMMENT ON FUNCTION tunnel_internal.broken_rows(int) IS
    'Tunnels, surveys, axis vertices, segments, sections and findings with numbers that nothing can be computed with, of one survey or of all (NULL): name, fault, and the statement or the command to fix it';
