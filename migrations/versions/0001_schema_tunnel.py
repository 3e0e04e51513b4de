"""The first schema: tunnels, surveys, points, what the stages make of them, and the ledger.

Revision: 0001, after nothing.
"""

import sqlalchemy as sa
from alembic import op
from geoalchemy2 import Geometry
from sqlalchemy.dialects import postgresql

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


# Points go as their survey goes. A foreign key would have each new partition checked row by row.
DROP_POINTS = """
CREATE FUNCTION tunnel.drop_points() RETURNS trigger
LANGUAGE plpgsql
AS $$
BEGIN
    EXECUTE format('DROP TABLE IF EXISTS tunnel.%I', 'point_s' || OLD.id);
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.drop_points() IS 'Trigger on tunnel.survey: drops the points of a survey that was deleted';
CREATE TRIGGER drop_points AFTER DELETE ON tunnel.survey FOR EACH ROW EXECUTE FUNCTION tunnel.drop_points();
COMMENT ON TRIGGER drop_points ON tunnel.survey IS 'Drops the survey''s partition of tunnel.point';
COMMENT ON SCHEMA tunnel IS 'Data of tunneldb; read and edit it through schema tunnel_api';
"""


def _geometry(kind: str) -> Geometry:
    return Geometry(kind, spatial_index=False)


def upgrade() -> None:
    op.create_table(
        "point",
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column(
            "km",
            sa.Integer(),
            nullable=False,
            comment="Kilometre: floor(chainage / 1000) along the given axis",
        ),
        sa.Column(
            "chainage",
            sa.Double(),
            nullable=False,
            comment="Chainage, m: along the given axis as loaded, along the axis found after stage segments; the rows' order",
        ),
        sa.Column("gps_time", sa.Double(), nullable=False, comment="Time of the shot, as in the file, s"),
        sa.Column("geom", _geometry("POINTZ"), nullable=False, comment="Position, tunnel's SRID, m"),
        sa.Column(
            "segment",
            sa.Integer(),
            nullable=True,
            comment="Number of the segment (segment.n) that the point lies in",
        ),
        sa.Column("scan_id", sa.Integer(), nullable=False, comment="Scan that it is of (point_source_id)"),
        sa.Column("file_id", sa.Integer(), nullable=False, comment="File that it came from (scan_file.id)"),
        sa.Column(
            "intensity",
            sa.REAL(),
            nullable=False,
            comment="Intensity as the file has it; 0 when the kind is none",
        ),
        sa.Column("classification", sa.SmallInteger(), nullable=False, comment="Class as in the file (ASPRS)"),
        schema="tunnel",
        comment="Points at survey density: partition point_s<survey> and in it point_s<survey>_km<km>, "
        "each in the order of chainage",
        postgresql_partition_by="LIST (survey_id)",
    )
    op.create_index(
        "point_chainage_idx",
        "point",
        ["chainage"],
        unique=False,
        schema="tunnel",
        postgresql_using="brin",
        postgresql_with={"pages_per_range": "16"},
    )
    op.create_table(
        "tunnel",
        sa.Column("id", sa.Integer(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("name", sa.Text(), nullable=False, comment="Name that the commands use"),
        sa.Column(
            "srid",
            sa.Integer(),
            nullable=False,
            comment="Spatial reference of all coordinates of this tunnel; projected, metres",
        ),
        sa.Column(
            "start_chainage",
            sa.Double(),
            server_default=sa.text("0"),
            nullable=False,
            comment="Chainage of the given axis's first vertex, m",
        ),
        sa.Column(
            "spacing",
            sa.Double(),
            server_default=sa.text("10"),
            nullable=False,
            comment="Distance between vertices of the averaged axis, m of chainage",
        ),
        sa.Column(
            "alignment",
            _geometry("LINESTRINGZ"),
            nullable=False,
            comment="Axis as given, in growing chainage, in the tunnel's SRID",
        ),
        sa.Column(
            "created_at",
            sa.DateTime(timezone=True),
            server_default=sa.text("now()"),
            nullable=False,
            comment="When it was added",
        ),
        sa.CheckConstraint("spacing > 0", name=op.f("tunnel_spacing_check")),
        sa.PrimaryKeyConstraint("id", name=op.f("tunnel_pkey")),
        sa.UniqueConstraint("name", name=op.f("tunnel_name_key")),
        schema="tunnel",
        comment="A structure: its spatial reference, stationing and given axis",
    )
    op.create_table(
        "survey",
        sa.Column("id", sa.Integer(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("tunnel_id", sa.Integer(), nullable=False, comment="Tunnel that was scanned"),
        sa.Column("name", sa.Text(), nullable=False, comment="Name that the commands use"),
        sa.Column("date", sa.Date(), nullable=False, comment="Day of the scan"),
        sa.Column(
            "intensity_dimension",
            sa.Text(),
            nullable=True,
            comment="Dimension of the scan files that holds the intensity; none when the kind is none",
        ),
        sa.Column(
            "intensity_kind",
            sa.Text(),
            nullable=False,
            comment="amplitude (dB, falls with range), reflectance (dB, range removed), linear (counts) or none",
        ),
        sa.Column("platform", sa.Text(), nullable=False, comment="static (rows in station) or mobile (rows in pose)"),
        sa.Column(
            "created_at",
            sa.DateTime(timezone=True),
            server_default=sa.text("now()"),
            nullable=False,
            comment="When it was added",
        ),
        sa.CheckConstraint(
            "(intensity_dimension IS NULL) = (intensity_kind = 'none')",
            name=op.f("survey_intensity_dimension_check"),
        ),
        sa.CheckConstraint(
            "intensity_kind IN ('amplitude', 'reflectance', 'linear', 'none')",
            name=op.f("survey_intensity_kind_check"),
        ),
        sa.CheckConstraint("platform IN ('static', 'mobile')", name=op.f("survey_platform_check")),
        sa.ForeignKeyConstraint(["tunnel_id"], ["tunnel.tunnel.id"], name=op.f("survey_tunnel_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("survey_pkey")),
        sa.UniqueConstraint("name", name=op.f("survey_name_key")),
        schema="tunnel",
        comment="A scanning campaign (an epoch) of a tunnel",
    )
    op.create_index(op.f("survey_tunnel_id_idx"), "survey", ["tunnel_id"], unique=False, schema="tunnel")
    op.create_table(
        "axis_vertex",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column(
            "n",
            sa.Integer(),
            nullable=False,
            comment="Number along the axis; its chainage is n * tunnel.spacing",
        ),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("geom", _geometry("POINTZ"), nullable=False, comment="Position, tunnel's SRID, m"),
        sa.Column(
            "given",
            _geometry("POINTZ"),
            nullable=False,
            comment="Where the given axis has this chainage, tunnel's SRID, m",
        ),
        sa.Column("points", sa.Integer(), nullable=False, comment="Points that were averaged; 0 unless measured"),
        sa.Column(
            "source",
            sa.Text(),
            nullable=False,
            comment="measured (averaged), interpolated (too few points) or edited (by hand, kept by a rerun)",
        ),
        sa.Column("edited_by", sa.Text(), nullable=True, comment="Who moved it"),
        sa.Column("edited_at", sa.DateTime(timezone=True), nullable=True, comment="When it was moved"),
        sa.CheckConstraint("source IN ('measured', 'interpolated', 'edited')", name=op.f("axis_vertex_source_check")),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("axis_vertex_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("axis_vertex_pkey")),
        sa.UniqueConstraint("survey_id", "n", name=op.f("axis_vertex_survey_id_n_key")),
        schema="tunnel",
        comment="Axis of a survey: vertex n stands at chainage n * spacing of the given axis",
    )
    op.create_index(
        op.f("axis_vertex_geom_idx"),
        "axis_vertex",
        ["geom"],
        unique=False,
        schema="tunnel",
        postgresql_using="gist",
    )
    op.create_table(
        "image",
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column(
            "km",
            sa.Integer(),
            autoincrement=False,
            nullable=False,
            comment="Kilometre: floor(chainage / 1000)",
        ),
        sa.Column(
            "kind",
            sa.Text(),
            nullable=False,
            comment="raw or corrected intensity, dB, or offset from the surface, m",
        ),
        sa.Column(
            "block",
            sa.Integer(),
            autoincrement=False,
            nullable=False,
            comment="Block along the tunnel: floor(chainage / 50)",
        ),
        sa.Column(
            "tiff",
            sa.LargeBinary(),
            nullable=False,
            comment="GeoTIFF in the unrolled plane (chainage, arc), m",
        ),
        sa.CheckConstraint("kind IN ('raw', 'corrected', 'offset')", name=op.f("image_kind_check")),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("image_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("survey_id", "km", "kind", "block", name=op.f("image_pkey")),
        schema="tunnel",
        comment="Unrolled images in blocks of 50 m",
    )
    op.create_table(
        "leak",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000) of its middle"),
        sa.Column("chainage_from", sa.Double(), nullable=False, comment="Least chainage, m"),
        sa.Column("chainage_to", sa.Double(), nullable=False, comment="Greatest chainage, m"),
        sa.Column(
            "arc_from",
            sa.Double(),
            nullable=False,
            comment="Least arc, m, positive right looking up-chainage",
        ),
        sa.Column(
            "arc_to",
            sa.Double(),
            nullable=False,
            comment="Greatest arc, m, positive right looking up-chainage",
        ),
        sa.Column(
            "clock",
            sa.Double(),
            nullable=False,
            comment="Clock position of its middle, hours: 12 is the crown, 3 is right looking up-chainage",
        ),
        sa.Column("area", sa.Double(), nullable=False, comment="Area on the surface, m²"),
        sa.Column("drop_mean", sa.Double(), nullable=False, comment="Mean drop below dry lining, dB"),
        sa.Column("drop_max", sa.Double(), nullable=False, comment="Greatest drop below dry lining, dB"),
        sa.Column(
            "image_share",
            sa.Double(),
            nullable=False,
            comment="Share of its pixels that hold measured data, 0 to 1",
        ),
        sa.Column(
            "unrolled",
            _geometry("POLYGON"),
            nullable=False,
            comment="In the unrolled plane (chainage, arc), m",
        ),
        sa.Column(
            "map",
            _geometry("POLYGON"),
            nullable=False,
            comment="On the map strip beside the axis, tunnel's SRID, m",
        ),
        sa.Column(
            "surface",
            _geometry("POLYGONZ"),
            nullable=False,
            comment="On the lining in space, tunnel's SRID, m",
        ),
        sa.Column(
            "review",
            sa.Text(),
            server_default=sa.text("'open'"),
            nullable=False,
            comment="open, confirmed or rejected, by an inspector",
        ),
        sa.Column("reviewed_by", sa.Text(), nullable=True, comment="Who reviewed it"),
        sa.Column("reviewed_at", sa.DateTime(timezone=True), nullable=True, comment="When it was reviewed"),
        sa.Column("remark", sa.Text(), nullable=True, comment="Inspector's remark"),
        sa.Column(
            "detected",
            sa.Boolean(),
            server_default=sa.text("true"),
            nullable=False,
            comment="Whether the last detection found it again",
        ),
        sa.Column(
            "created_at",
            sa.DateTime(timezone=True),
            server_default=sa.text("now()"),
            nullable=False,
            comment="When it was first found",
        ),
        sa.Column(
            "detected_at",
            sa.DateTime(timezone=True),
            server_default=sa.text("now()"),
            nullable=False,
            comment="When it was last found",
        ),
        sa.CheckConstraint("review IN ('open', 'confirmed', 'rejected')", name=op.f("leak_review_check")),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("leak_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("leak_pkey")),
        schema="tunnel",
        comment="Leaks: polygons of wet lining, in three geometries",
    )
    op.create_index(op.f("leak_map_idx"), "leak", ["map"], unique=False, schema="tunnel", postgresql_using="gist")
    op.create_index(op.f("leak_survey_id_km_idx"), "leak", ["survey_id", "km"], unique=False, schema="tunnel")
    op.create_index(
        op.f("leak_unrolled_idx"),
        "leak",
        ["unrolled"],
        unique=False,
        schema="tunnel",
        postgresql_using="gist",
    )
    op.create_table(
        "pose",
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("time", sa.Double(), nullable=False, comment="Time as in the points' gps_time, s"),
        sa.Column("geom", _geometry("POINTZ"), nullable=False, comment="Scanner's position, tunnel's SRID, m"),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("pose_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("survey_id", "time", name=op.f("pose_pkey")),
        schema="tunnel",
        comment="Trajectory of a mobile scanner",
    )
    op.create_table(
        "radiometry",
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column(
            "km",
            sa.Integer(),
            autoincrement=False,
            nullable=False,
            comment="Kilometre: floor(chainage / 1000)",
        ),
        sa.Column("roughness", sa.Double(), nullable=True, comment="Oren-Nayar roughness, degrees"),
        sa.Column("dry_mean", sa.Double(), nullable=True, comment="Mean corrected intensity of dry lining, dB"),
        sa.Column("dry_sigma", sa.Double(), nullable=True, comment="Its standard deviation, dB"),
        sa.Column(
            "threshold",
            sa.Double(),
            nullable=True,
            comment="Corrected intensity below which lining is wet, dB",
        ),
        sa.Column(
            "sigma_raw",
            sa.Double(),
            nullable=True,
            comment="Standard deviation of dry lining before correction, dB",
        ),
        sa.Column("sigma_lambert", sa.Double(), nullable=True, comment="The same, incidence by Lambert, dB"),
        sa.Column("sigma_oren_nayar", sa.Double(), nullable=True, comment="The same, incidence by Oren-Nayar, dB"),
        sa.Column("regions", sa.Integer(), nullable=False, comment="Homogeneous regions that the roughness is from"),
        sa.Column("pixels", sa.BigInteger(), nullable=False, comment="Pixels of the image that show lining"),
        sa.Column("wet_pixels", sa.BigInteger(), nullable=False, comment="Lining pixels found wet, after the median filter"),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("radiometry_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("survey_id", "km", name=op.f("radiometry_pkey")),
        schema="tunnel",
        comment="Correction of the intensity, per kilometre (Xu et al. 2018)",
    )
    op.create_table(
        "reference",
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("range_m", sa.Double(), nullable=False, comment="Range, m"),
        sa.Column("intensity_db", sa.Double(), nullable=False, comment="Intensity of the reference target, dB"),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("reference_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("survey_id", "range_m", name=op.f("reference_pkey")),
        schema="tunnel",
        comment="Reference curve of the scanner: intensity over range (Xu et al. 2018)",
    )
    op.create_table(
        "region",
        sa.Column("id", sa.Integer(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column(
            "kind",
            sa.Text(),
            nullable=False,
            comment="homogeneous (one material, for the roughness) or dry (for the threshold)",
        ),
        sa.Column(
            "geom",
            _geometry("POLYGON"),
            nullable=False,
            comment="Region in the unrolled plane (chainage, arc), m",
        ),
        sa.Column(
            "drawn_by",
            sa.Text(),
            server_default=sa.text("CURRENT_USER"),
            nullable=False,
            comment="Who drew it",
        ),
        sa.Column(
            "drawn_at",
            sa.DateTime(timezone=True),
            server_default=sa.text("now()"),
            nullable=False,
            comment="When it was drawn",
        ),
        sa.CheckConstraint("kind IN ('homogeneous', 'dry')", name=op.f("region_kind_check")),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("region_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("region_pkey")),
        schema="tunnel",
        comment="Regions of the lining that the user has drawn, to be used in place of automatic ones",
    )
    op.create_index(op.f("region_geom_idx"), "region", ["geom"], unique=False, schema="tunnel", postgresql_using="gist")
    op.create_index(op.f("region_survey_id_idx"), "region", ["survey_id"], unique=False, schema="tunnel")
    op.create_table(
        "run",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=True, comment="Kilometre; none for the whole survey"),
        sa.Column("stage", sa.Text(), nullable=False, comment="load, axis, segments, sections, detect"),
        sa.Column(
            "parameters",
            postgresql.JSONB(astext_type=sa.Text()),
            server_default=sa.text("'{}'"),
            nullable=False,
            comment="Parameters that it ran with",
        ),
        sa.Column(
            "versions",
            postgresql.JSONB(astext_type=sa.Text()),
            server_default=sa.text("'{}'"),
            nullable=False,
            comment="Versions of the program and of its libraries",
        ),
        sa.Column(
            "counts",
            postgresql.JSONB(astext_type=sa.Text()),
            server_default=sa.text("'{}'"),
            nullable=False,
            comment="What it counted and measured",
        ),
        sa.Column(
            "backend_pid",
            sa.Integer(),
            server_default=sa.text("pg_backend_pid()"),
            nullable=False,
            comment="Server process that it ran in",
        ),
        sa.Column(
            "backend_start",
            sa.DateTime(timezone=True),
            nullable=True,
            comment="When that process began, as in pg_stat_activity; tells a run that was cut off",
        ),
        sa.Column(
            "started_at",
            sa.DateTime(timezone=True),
            server_default=sa.text("clock_timestamp()"),
            nullable=False,
            comment="When it began",
        ),
        sa.Column("finished_at", sa.DateTime(timezone=True), nullable=True, comment="When it ended"),
        sa.Column(
            "outcome",
            sa.Text(),
            server_default=sa.text("'running'"),
            nullable=False,
            comment="running, done or failed",
        ),
        sa.Column("message", sa.Text(), nullable=True, comment="Why it failed"),
        sa.CheckConstraint("outcome IN ('running', 'done', 'failed')", name=op.f("run_outcome_check")),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("run_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("run_pkey")),
        schema="tunnel",
        comment="Ledger of every stage that was run",
    )
    op.create_index(op.f("run_survey_id_stage_km_idx"), "run", ["survey_id", "stage", "km"], unique=False, schema="tunnel")
    op.create_table(
        "scan_file",
        sa.Column("id", sa.Integer(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("name", sa.Text(), nullable=False, comment="File name without its folder"),
        sa.Column(
            "path",
            sa.Text(),
            nullable=False,
            comment="Where the file lay when it was loaded; read again at full density",
        ),
        sa.Column("checksum", sa.Text(), nullable=False, comment="SHA-256 of the file, hexadecimal"),
        sa.Column("bytes", sa.BigInteger(), nullable=False, comment="Size of the file, bytes"),
        sa.Column("points", sa.BigInteger(), nullable=False, comment="Points in the file"),
        sa.Column("noise", sa.BigInteger(), nullable=False, comment="Points dropped as noise"),
        sa.Column(
            "outside",
            sa.BigInteger(),
            nullable=False,
            comment="Points dropped as too far from the given axis",
        ),
        sa.Column("thinned", sa.BigInteger(), nullable=False, comment="Points dropped by thinning to survey density"),
        sa.Column("kept", sa.BigInteger(), nullable=False, comment="Points kept, the rows in point"),
        sa.Column("chainage_from", sa.Double(), nullable=True, comment="Least chainage of the kept points, m"),
        sa.Column("chainage_to", sa.Double(), nullable=True, comment="Greatest chainage of the kept points, m"),
        sa.Column(
            "extent",
            postgresql.ARRAY(sa.Double()),
            nullable=True,
            comment="Box of the kept points: xmin, ymin, zmin, xmax, ymax, zmax, tunnel's SRID, m",
        ),
        sa.Column(
            "srid",
            sa.Integer(),
            nullable=True,
            comment="Spatial reference that the file states, if it states one",
        ),
        sa.Column(
            "loaded_at",
            sa.DateTime(timezone=True),
            server_default=sa.text("now()"),
            nullable=False,
            comment="When it was loaded",
        ),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("scan_file_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("scan_file_pkey")),
        sa.UniqueConstraint("survey_id", "name", name=op.f("scan_file_survey_id_name_key")),
        schema="tunnel",
        comment="Scan files that were loaded, with what was kept of them",
    )
    op.create_table(
        "section",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("segment", sa.Integer(), nullable=False, comment="Number of its segment (segment.n)"),
        sa.Column("half", sa.SmallInteger(), nullable=False, comment="Where in the segment: 25 or 75 %"),
        sa.Column("chainage", sa.Double(), nullable=False, comment="Chainage of its plane, m"),
        sa.Column(
            "half_width",
            sa.Double(),
            nullable=False,
            comment="Half the thickness of the slab that its points are from, m",
        ),
        sa.Column("angle_step", sa.Double(), nullable=False, comment="Width of an angular class, degrees"),
        sa.Column(
            "radius",
            postgresql.ARRAY(sa.Double()),
            nullable=False,
            comment="Distance of the surface from the axis at each whole degree from -180 to 180, m",
        ),
        sa.Column(
            "arc",
            postgresql.ARRAY(sa.Double()),
            nullable=False,
            comment="Arc from the crown at each whole degree, m, positive right looking up-chainage",
        ),
        sa.Column(
            "geom",
            _geometry("LINESTRINGZ"),
            nullable=False,
            comment="The section as a line in space, tunnel's SRID, m",
        ),
        sa.Column("points", sa.Integer(), nullable=False, comment="Points that it was made from"),
        sa.Column("interpolated", sa.Integer(), nullable=False, comment="Classes that are not measured: empty or rejected"),
        sa.CheckConstraint("half IN (25, 75)", name=op.f("section_half_check")),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("section_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("section_pkey")),
        sa.UniqueConstraint("survey_id", "segment", "half", name=op.f("section_survey_id_segment_half_key")),
        schema="tunnel",
        comment="Cross-sections at 25 % and 75 % of each segment, from angular classes",
    )
    op.create_table(
        "segment",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("n", sa.Integer(), nullable=False, comment="Number of its first vertex"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("chainage_from", sa.Double(), nullable=False, comment="Chainage of its beginning, m"),
        sa.Column("chainage_to", sa.Double(), nullable=False, comment="Chainage of its end, m"),
        sa.Column("vertex_from", postgresql.ARRAY(sa.Double()), nullable=False, comment="First vertex: x, y, z, m"),
        sa.Column("vertex_to", postgresql.ARRAY(sa.Double()), nullable=False, comment="Last vertex: x, y, z, m"),
        sa.Column(
            "tangent_from",
            postgresql.ARRAY(sa.Double()),
            nullable=False,
            comment="Unit tangent of the axis at the first vertex",
        ),
        sa.Column(
            "tangent_to",
            postgresql.ARRAY(sa.Double()),
            nullable=False,
            comment="Unit tangent of the axis at the last vertex",
        ),
        sa.Column(
            "geom",
            _geometry("LINESTRINGZ"),
            nullable=False,
            comment="Axis from the first vertex to the last, tunnel's SRID, m",
        ),
        sa.Column("points", sa.BigInteger(), nullable=False, comment="Points that lie in it"),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("segment_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("segment_pkey")),
        sa.UniqueConstraint("survey_id", "n", name=op.f("segment_survey_id_n_key")),
        schema="tunnel",
        comment="The tunnel between the planes at two consecutive vertices of the axis",
    )
    op.create_index(
        op.f("segment_survey_id_chainage_from_idx"), "segment", ["survey_id", "chainage_from"], unique=False, schema="tunnel"
    )
    op.create_index(op.f("section_survey_id_chainage_idx"), "section", ["survey_id", "chainage"], unique=False, schema="tunnel")
    op.create_index(op.f("segment_geom_idx"), "segment", ["geom"], unique=False, schema="tunnel", postgresql_using="gist")
    op.create_table(
        "station",
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column(
            "scan_id",
            sa.Integer(),
            autoincrement=False,
            nullable=False,
            comment="Scan, as in the points' point_source_id",
        ),
        sa.Column("geom", _geometry("POINTZ"), nullable=False, comment="Scanner's position, tunnel's SRID, m"),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("station_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("survey_id", "scan_id", name=op.f("station_pkey")),
        schema="tunnel",
        comment="Stations of a static scanner",
    )
    op.create_table(
        "section_class",
        sa.Column("section_id", sa.BigInteger(), nullable=False, comment="Section that it belongs to"),
        sa.Column(
            "class",
            sa.Integer(),
            autoincrement=False,
            nullable=False,
            comment="Number of the class, from the lowest angle",
        ),
        sa.Column("angle", sa.Double(), nullable=False, comment="Its angle from the crown, degrees, positive right"),
        sa.Column(
            "radius",
            sa.Double(),
            nullable=False,
            comment="Distance of the surface from the axis at the angle, m",
        ),
        sa.Column(
            "slope",
            sa.Double(),
            nullable=True,
            comment="Inclination of the line through its points: outwards per metre to the right; none if empty",
        ),
        sa.Column(
            "sigma",
            sa.Double(),
            nullable=True,
            comment="Standard deviation of its points from the line, m; none if empty",
        ),
        sa.Column("points", sa.Integer(), nullable=False, comment="Points that it keeps"),
        sa.Column(
            "state",
            sa.Text(),
            nullable=False,
            comment="measured, rejected (an outlier among its neighbours) or interpolated (too few points)",
        ),
        sa.CheckConstraint("state IN ('measured', 'rejected', 'interpolated')", name=op.f("section_class_state_check")),
        sa.ForeignKeyConstraint(
            ["section_id"],
            ["tunnel.section.id"],
            name=op.f("section_class_section_id_fkey"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("section_id", "class", name=op.f("section_class_pkey")),
        schema="tunnel",
        comment="Angular classes of a section, with two-sigma rejection (Gonçalves et al. 2012)",
    )
    op.execute(DROP_POINTS)
