-- Functions that take the name of a survey or a tunnel. Each calls the function of the same name that takes the key, which suits
-- programs and queries over many surveys. Needs those functions, survey_id and tunnel_id.

CREATE OR REPLACE FUNCTION tunnel_api.roll(survey text, chainage float8, arc float8, "offset" float8 DEFAULT 0)
RETURNS geometry
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$ SELECT tunnel_api.roll(tunnel_api.survey_id($1), $2, $3, $4) $$;
COMMENT ON FUNCTION tunnel_api.roll(text, float8, float8, float8) IS
'Point of a survey, given by name, at chainage, arc and offset, m: 3D, in the tunnel''s SRID; NULL off the tunnel. Inverse of unroll.';

CREATE OR REPLACE FUNCTION tunnel_api.roll(survey text, unrolled geometry)
RETURNS geometry
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$ SELECT tunnel_api.roll(tunnel_api.survey_id($1), $2) $$;
COMMENT ON FUNCTION tunnel_api.roll(text, geometry) IS
'Point, line or polygon of the unrolled plane (chainage, arc; m) on the surface of a survey, given by name: 3D, in the tunnel''s SRID; NULL if any part lies off the tunnel.';

CREATE OR REPLACE FUNCTION tunnel_api.map_strip(survey text, unrolled geometry)
RETURNS geometry
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$ SELECT tunnel_api.map_strip(tunnel_api.survey_id($1), $2) $$;
COMMENT ON FUNCTION tunnel_api.map_strip(text, geometry) IS
'Point, line or polygon of the unrolled plane (chainage, arc; m) on the map beside the axis of a survey, given by name, in the tunnel''s SRID. Source: Gonçalves et al. (2012), eq. 1.';

CREATE OR REPLACE FUNCTION tunnel_api.unroll_shape(survey text, shape geometry)
RETURNS geometry
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$ SELECT tunnel_api.unroll_shape(tunnel_api.survey_id($1), $2) $$;
COMMENT ON FUNCTION tunnel_api.unroll_shape(text, geometry) IS
'Point, line or polygon in space (3D, tunnel''s SRID) in the unrolled plane (chainage, arc; m; SRID 0) of a survey, given by name; NULL if any part lies off the tunnel.';

CREATE OR REPLACE FUNCTION tunnel_api.unroll(survey text, point geometry)
RETURNS TABLE (chainage float8, arc float8, "offset" float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 1
AS $$ SELECT f.* FROM tunnel_api.unroll(tunnel_api.survey_id($1), $2) f $$;
COMMENT ON FUNCTION tunnel_api.unroll(text, geometry) IS
'Chainage, arc and offset (m) of a 3D point in the tunnel''s SRID, for a survey given by name; all are NULL off the tunnel.';

CREATE OR REPLACE FUNCTION tunnel_api.section_at(survey text, chainage float8)
RETURNS TABLE (radius float8[], arc float8[])
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 1
AS $$ SELECT f.* FROM tunnel_api.section_at(tunnel_api.survey_id($1), $2) f $$;
COMMENT ON FUNCTION tunnel_api.section_at(text, float8) IS
'Section at a chainage (m) of a survey, given by name, interpolated: radius and arc (m) at each degree from -180° to 180°; NULL if no section is near.';

CREATE OR REPLACE FUNCTION tunnel_api.survey_ends(survey text)
RETURNS TABLE (chainage_from float8, chainage_to float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 1
AS $$ SELECT f.* FROM tunnel_api.survey_ends(tunnel_api.survey_id($1)) f $$;
COMMENT ON FUNCTION tunnel_api.survey_ends(text) IS
'Smallest and greatest chainage (m) that a survey, given by name, scanned; NULL before it has segments.';

CREATE OR REPLACE FUNCTION tunnel_api.axis_deviation(survey text)
RETURNS TABLE (n int, chainage float8, source text, to_right float8, up float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 1000
AS $$ SELECT f.* FROM tunnel_api.axis_deviation(tunnel_api.survey_id($1)) f $$;
COMMENT ON FUNCTION tunnel_api.axis_deviation(text) IS
'Distance of each vertex of the measured axis from the given axis, for a survey given by name: to_right (looking up-chainage) and up, m.';

CREATE OR REPLACE FUNCTION tunnel_api.coverage_gaps(survey text, chainage_from float8 DEFAULT '-Infinity', chainage_to float8 DEFAULT 'Infinity')
RETURNS TABLE (chainage_from float8, chainage_to float8, state text, reason text, searched boolean, seen_share float8)
LANGUAGE sql STABLE PARALLEL RESTRICTED STRICT ROWS 10
AS $$ SELECT f.* FROM tunnel_api.coverage_gaps(tunnel_api.survey_id($1), $2, $3) f $$;
COMMENT ON FUNCTION tunnel_api.coverage_gaps(text, float8, float8) IS
'Stretches between two chainages (m) where leaks of a survey, given by name, could be missed, and why. No rows: everything was searched, is up to date, and more than half of the lining was inspected.';

CREATE OR REPLACE FUNCTION tunnel_api.coverage_statement(survey text, chainage_from float8 DEFAULT '-Infinity', chainage_to float8 DEFAULT 'Infinity')
RETURNS text
LANGUAGE sql STABLE PARALLEL RESTRICTED STRICT
AS $$ SELECT tunnel_api.coverage_statement(tunnel_api.survey_id($1), $2, $3) $$;
COMMENT ON FUNCTION tunnel_api.coverage_statement(text, float8, float8) IS
'Result of coverage_gaps in words, for a survey given by name, at most six stretches of each kind; NULL if there are no gaps.';

CREATE OR REPLACE FUNCTION tunnel_api.remarks(survey text, chainage_from float8 DEFAULT '-Infinity', chainage_to float8 DEFAULT 'Infinity')
RETURNS TABLE (file text, stage text, kilometres int[], remark text, said text)
LANGUAGE sql STABLE PARALLEL RESTRICTED STRICT ROWS 5
AS $$ SELECT f.* FROM tunnel_api.remarks(tunnel_api.survey_id($1), $2, $3) f $$;
COMMENT ON FUNCTION tunnel_api.remarks(text, float8, float8) IS
'Notes on the results of a survey, given by name, between two chainages (m): first those of files, then those of kilometres. said: the note in words, as in every document.';

CREATE OR REPLACE FUNCTION tunnel_api.nearest_leaks(survey text, point geometry, wanted int DEFAULT 5)
RETURNS TABLE (id bigint, label text, chainage_from float8, chainage_to float8, clock float8, area float8, distance float8)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 5
AS $$ SELECT f.* FROM tunnel_api.nearest_leaks(tunnel_api.survey_id($1), $2, $3) f $$;
COMMENT ON FUNCTION tunnel_api.nearest_leaks(text, geometry, int) IS
'Leaks of a survey, given by name, that are nearest to a 3D point in the tunnel''s SRID, nearest first. Rejected leaks and leaks that the last detection did not find are left out. distance: along the lining, m, 0 on a leak. No rows if the point lies off the tunnel.';

CREATE OR REPLACE FUNCTION tunnel_api.image_value(survey text, kind text, chainage float8, arc float8)
RETURNS float8
LANGUAGE sql STABLE PARALLEL UNSAFE STRICT
AS $$ SELECT tunnel_api.image_value(tunnel_api.survey_id($1), $2, $3, $4) $$;
COMMENT ON FUNCTION tunnel_api.image_value(text, text, float8, float8) IS
'Value of an unrolled image (raw, corrected, offset, state, deviation_lining, …) of a survey, given by name, at one place (chainage, arc; m). For many places use image_values.';

CREATE OR REPLACE FUNCTION tunnel_api.image_values(survey text, kind text, chainage float8[], arc float8[])
RETURNS TABLE (n int, value float8)
LANGUAGE sql STABLE PARALLEL UNSAFE STRICT ROWS 100
AS $$ SELECT f.* FROM tunnel_api.image_values(tunnel_api.survey_id($1), $2, $3, $4) f $$;
COMMENT ON FUNCTION tunnel_api.image_values(text, text, float8[], float8[]) IS
'Values of an unrolled image of a survey, given by name, at places (chainage, arc; m), in their order: dB (raw, corrected), m (offset, deviation_…) or the code of the pixel''s state; NULL without a measurement. Needs the extension postgis_raster.';

CREATE OR REPLACE FUNCTION tunnel_api.station(tunnel text, chainage float8)
RETURNS float8
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$ SELECT tunnel_api.station(tunnel_api.tunnel_id($1), $2) $$;
COMMENT ON FUNCTION tunnel_api.station(text, float8) IS
'Station (m) at a chainage (m) of a tunnel, given by name; at a station equation, the station ahead.';

CREATE OR REPLACE FUNCTION tunnel_api.station_label(tunnel text, chainage float8)
RETURNS text
LANGUAGE sql STABLE PARALLEL SAFE STRICT
AS $$ SELECT tunnel_api.station_label(tunnel_api.tunnel_id($1), $2) $$;
COMMENT ON FUNCTION tunnel_api.station_label(text, float8) IS
'Station at a chainage (m) of a tunnel, given by name, as 12+345.678.';

CREATE OR REPLACE FUNCTION tunnel_api.station_pieces(tunnel text)
RETURNS TABLE (n int, chainage_from float8, chainage_to float8, station_from float8, station_to float8, direction int,
               label_from text, label_to text)
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 5
AS $$ SELECT f.* FROM tunnel_api.station_pieces(tunnel_api.tunnel_id($1)) f $$;
COMMENT ON FUNCTION tunnel_api.station_pieces(text) IS
'Pieces of the stationing of a tunnel, given by name: chainages and stations (m) of their ends; direction is -1 where stations run backwards.';

CREATE OR REPLACE FUNCTION tunnel_api.station_chainages(tunnel text, station text)
RETURNS SETOF float8
LANGUAGE sql STABLE PARALLEL SAFE STRICT ROWS 1
AS $$ SELECT f FROM tunnel_api.station_chainages(tunnel_api.tunnel_id($1), $2) f $$;
COMMENT ON FUNCTION tunnel_api.station_chainages(text, text) IS
'Chainages (m) of a tunnel, given by name, that have a station (12+345.678, or metres): none, one, or several where stations overlap.';
