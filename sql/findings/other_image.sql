-- Values of other images than the intensity under findings. A row is valid for the outline that was measured, by its key: of one
-- that was redrawn since, nothing is shown until it is measured again.

CREATE OR REPLACE FUNCTION tunnel_internal.outline_key(outline geometry) RETURNS text
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE SET search_path = pg_catalog, pg_temp
AS $$ SELECT md5(public.st_asbinary($1)) $$;
COMMENT ON FUNCTION tunnel_internal.outline_key(geometry) IS 'Key of an outline, another one after each change of it';

-- As "-0.83 K", "12 L* darker" (colours have no unit).
CREATE OR REPLACE FUNCTION tunnel_internal.contrast_words(contrast float8, unit text, colour boolean) RETURNS text
LANGUAGE sql IMMUTABLE CALLED ON NULL INPUT PARALLEL SAFE SET search_path = pg_catalog, pg_temp AS $$
    SELECT CASE WHEN $3 THEN r.size || ' L* ' || CASE WHEN $1 < 0 THEN 'darker' ELSE 'lighter' END
                ELSE concat_ws(' ', CASE WHEN $1 < 0 THEN '-' ELSE '+' END || r.size, nullif(replace($2, '°C', 'K'), '')) END
      FROM (SELECT trim_scale(round(abs($1)::numeric, greatest(0, 1 - floor(log(greatest(abs($1), 1e-9)))::int))) AS size) r
$$;
COMMENT ON FUNCTION tunnel_internal.contrast_words(float8, text, boolean) IS
    'A difference of values with two digits and its unit, for example -0.83 K; of colours, in CIE lightness: 12 L* darker';

CREATE OR REPLACE VIEW tunnel_internal.other_images AS
SELECT v.finding_id, v.outline_key,
       string_agg(coalesce(i.name, 'rgb') || ' ' || tunnel_internal.contrast_words(v.mean - v.surroundings, i.unit, i.colour IS NOT FALSE),
                  ', ' ORDER BY i.name NULLS FIRST) AS words,
       max(abs(v.mean - v.surroundings) / nullif(v.spread, 0)) AS contrast
  FROM tunnel.finding_image v
  LEFT JOIN tunnel.imported_image i ON i.id = v.imported_image_id
 GROUP BY v.finding_id, v.outline_key;
COMMENT ON VIEW tunnel_internal.other_images IS
    'Differences of outlines from the lining around them in other images: in words, and the greatest in standard deviations of the lining';
COMMENT ON COLUMN tunnel_internal.other_images.finding_id IS 'Finding';
COMMENT ON COLUMN tunnel_internal.other_images.outline_key IS 'Key of the outline that was measured';
COMMENT ON COLUMN tunnel_internal.other_images.words IS 'Differences in words, the image in colour first, then by name';
COMMENT ON COLUMN tunnel_internal.other_images.contrast IS 'Greatest difference in standard deviations of the lining around it';
