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
