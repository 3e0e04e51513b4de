-- State of findings for the audit, and the lock between detection and people who draw.

-- Columns of a finding that people can change, as the audit keeps them.
CREATE OR REPLACE FUNCTION tunnel_internal.finding_state(id bigint) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_strip_nulls(jsonb_build_object(
        'kind', coalesce(a.kind_override, a.kind), 'severity', a.severity, 'width_mm', a.width_mm, 'review', a.review, 'remark', a.remark,
        'origin', a.origin, 'parent_id', a.parent_id, 'merged_into', a.merged_into,
        'geom', public.ST_AsEWKT(coalesce(a.shape, a.unrolled))))
      FROM tunnel.finding a WHERE a.id = $1
$$;
COMMENT ON FUNCTION tunnel_internal.finding_state(bigint) IS
    'Editable columns of a finding for the audit, geometry in the unrolled plane as EWKT';

-- Measured values of a finding; they are cleared when its outline changes.
CREATE OR REPLACE FUNCTION tunnel_internal.finding_measured(id bigint) RETURNS jsonb
LANGUAGE sql STABLE PARALLEL SAFE STRICT SECURITY DEFINER SET search_path = pg_catalog, pg_temp AS $$
    SELECT jsonb_build_object(
        'darkening_mean', a.darkening_mean, 'darkening_max', a.darkening_max, 'image_share', a.image_share, 'contrast', a.contrast,
        'confidence', a.confidence, 'reasons', a.reasons, 'evidence', a.evidence, 'features', a.features,
        'feature_list_id', a.feature_list_id, 'model', a.model, 'detected', a.detected, 'area', a.area, 'clock', a.clock)
      FROM tunnel.finding a WHERE a.id = $1 AND a.image_share IS NOT NULL
$$;
COMMENT ON FUNCTION tunnel_internal.finding_measured(bigint) IS
    'Measured values of a finding for the audit, before its outline changes; NULL if it was not measured';

-- Detection writes the findings of a survey under this lock: it sees everything drawn before, and nothing is drawn meanwhile.
-- People who draw do not wait for each other.
CREATE OR REPLACE FUNCTION tunnel_internal.lock_findings(survey_id int) RETURNS void
LANGUAGE sql VOLATILE PARALLEL UNSAFE STRICT SET search_path = pg_catalog, pg_temp SET lock_timeout = '60 s' AS $$
    SELECT tunnel_internal.wait_lock(-3, $1, true, 'the list of findings of survey ' || $1)
$$;
COMMENT ON FUNCTION tunnel_internal.lock_findings(int) IS
    'Block detection from writing the findings of a survey, or wait for it, until the transaction ends';
