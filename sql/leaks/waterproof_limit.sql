-- Classes of waterproofing and their limits.

-- Limits of GB 50108-2008, table 3.2.1, that a scan can check: it shows where the lining is wet, not how much water flows. NULL:
-- no limit.
CREATE OR REPLACE VIEW tunnel_api.waterproof_limit AS
SELECT c.id, c.wet_ratio, c.patch_area, c.patches_per_100, c.description
  FROM (VALUES
    (1, NULL::float8, NULL::float8, 0, 'No leak, no wet patch'),
    (2, 0.002, 0.2, 3, 'No leak, few wet patches (tunnels: wet area at most 2 in 1000)'),
    (3, NULL, 0.3, 7, 'Few leaks, no running water'),
    (4, NULL, NULL, NULL, 'Leaks, no running water')) AS c (id, wet_ratio, patch_area, patches_per_100, description);
COMMENT ON VIEW tunnel_api.waterproof_limit IS
    'Classes of waterproofing (GB 50108-2008, table 3.2.1) with the limits that a scan can check. The limits of water volume, L/(m² d), are not among them';
COMMENT ON COLUMN tunnel_api.waterproof_limit.id IS 'Class; 1 is the driest';
COMMENT ON COLUMN tunnel_api.waterproof_limit.wet_ratio IS 'Largest permitted wet area, as a share of the lining';
COMMENT ON COLUMN tunnel_api.waterproof_limit.patch_area IS 'Largest permitted area of a leak, m²';
COMMENT ON COLUMN tunnel_api.waterproof_limit.patches_per_100 IS 'Largest permitted number of leaks in any 100 m² of lining';
COMMENT ON COLUMN tunnel_api.waterproof_limit.description IS 'Requirement of the class';


-- The planner inlines the body.
CREATE OR REPLACE FUNCTION tunnel_internal.best_class(seen float8, ratio float8, largest float8, crowd int, patches int)
RETURNS int
LANGUAGE sql STABLE PARALLEL SAFE CALLED ON NULL INPUT
AS $$
    SELECT min(c.id) FROM tunnel_api.waterproof_limit c
     WHERE $1 > 0 AND ($2 > c.wet_ratio) IS NOT TRUE AND ($3 > c.patch_area) IS NOT TRUE
       AND ($4 > c.patches_per_100 OR (c.patches_per_100 = 0 AND $5 > 0)) IS NOT TRUE
$$;
COMMENT ON FUNCTION tunnel_internal.best_class(float8, float8, float8, int, int) IS
'Best class of waterproofing that lining meets, from its inspected area (m²), wet share, area of its largest leak (m²), most leaks in 100 m² and number of leaks; NULL if nothing was inspected';
