"""Findings that people make, beside those of detection: kinds, severities, photos, how each came about and what counts.

Revision: 0022, after 0021. Anomalies that are there become findings of origin detected; none is measured anew.
"""

import sqlalchemy as sa
from alembic import op
from geoalchemy2 import Geometry
from sqlalchemy.dialects.postgresql import ARRAY

revision = "0022"
down_revision = "0021"
branch_labels = None
depends_on = None

# Code, label, what it may be drawn as, whether it is wet; in the order of lists.
KINDS = (
    ("leak", "Leak", ["polygon"], True),
    ("drip", "Drip", ["point", "polygon"], True),
    ("crack", "Crack", ["line"], False),
    ("spall", "Spall", ["polygon", "point"], False),
    ("delamination", "Delamination", ["polygon"], False),
    ("efflorescence", "Efflorescence", ["polygon", "line", "point"], False),
    ("damaged_joint", "Damaged joint", ["line", "polygon", "point"], False),
    ("missing_bolt", "Missing bolt", ["point"], False),
    ("corroded", "Corroded", ["polygon", "line", "point"], False),
    ("obstruction", "Obstruction", ["polygon", "line", "point"], False),
    ("other", "Other", ["polygon", "line", "point"], False),
    ("joint", "Joint", ["polygon", "line"], False),
    ("dark", "Dark, but dry", ["polygon"], False),
)
SEVERITIES = (
    (1, "minor", "No action; to be looked at in the next inspection"),
    (2, "moderate", "To be watched, or repaired with other works"),
    (3, "serious", "To be repaired soon"),
    (4, "critical", "To be dealt with at once"),
)


def upgrade() -> None:
    _catalogue()
    op.add_column(
        "tunnel",
        sa.Column(
            "dry_region_limit", sa.Double(), server_default=sa.text("50"), nullable=False,
            comment="Area above which a dry region must say why it is drawn, m²",
        ),
        schema="tunnel",
    )  # fmt: skip
    op.create_check_constraint(op.f("tunnel_dry_region_limit_check"), "tunnel", "dry_region_limit >= 0", schema="tunnel")
    op.add_column(
        "region",
        sa.Column("reason", sa.Text(), comment="Why; a dry region larger than the tunnel's limit needs one"),
        schema="tunnel",
    )
    _anomaly()
    _photo()
    for statement in (_WET, _WET_OF_KIND):
        op.execute(statement)
    op.alter_column(
        "entry", "view", schema="tunnel_audit",
        comment="What was changed: anomaly, spot, axis_vertex, region or photo",
        existing_comment="What was changed: anomaly, spot, axis_vertex or region", existing_type=sa.Text(),
    )  # fmt: skip


def _catalogue() -> None:
    kinds = op.create_table(
        "finding_kind",
        sa.Column("id", sa.Integer(), sa.Identity(), nullable=False, comment="Key"),
        sa.Column("code", sa.Text(), nullable=False, comment="Its code, in lower case"),
        sa.Column("label", sa.Text(), nullable=False, comment="Its name, in the owner's words"),
        sa.Column("geometries", ARRAY(sa.Text()), nullable=False, comment="What it may be drawn as: polygon, line, point"),
        sa.Column(
            "wet", sa.Boolean(), server_default=sa.text("false"), nullable=False,
            comment="Whether it counts as wet in statistics and classes",
        ),
        sa.Column("position", sa.Integer(), nullable=False, comment="Its place in lists"),
        sa.Column(
            "active", sa.Boolean(), server_default=sa.text("true"), nullable=False,
            comment="Whether it is offered for what is drawn",
        ),
        sa.PrimaryKeyConstraint("code", name=op.f("finding_kind_pkey")),
        sa.UniqueConstraint("id", name=op.f("finding_kind_id_key")),
        sa.CheckConstraint("code ~ '^[a-z][a-z0-9_]*$'", name=op.f("finding_kind_code_check")),
        sa.CheckConstraint(
            "geometries <@ '{polygon,line,point}' AND cardinality(geometries) > 0", name=op.f("finding_kind_geometries_check")
        ),
        sa.CheckConstraint(
            "(code <> 'leak' OR wet) AND (code NOT IN ('joint', 'dark') OR NOT wet)",
            name=op.f("finding_kind_wet_check"),
        ),
        schema="tunnel",
        comment="Kinds of findings, which an owner extends; those of detection are leak, joint and dark",
    )  # fmt: skip
    severities = op.create_table(
        "severity",
        sa.Column("id", sa.SmallInteger(), autoincrement=False, nullable=False, comment="1, the least, to 4"),
        sa.Column("label", sa.Text(), nullable=False, comment="Its name, in the owner's words"),
        sa.Column("text", sa.Text(), comment="What it means"),
        sa.PrimaryKeyConstraint("id", name=op.f("severity_pkey")),
        sa.CheckConstraint("id BETWEEN 1 AND 4", name=op.f("severity_id_check")),
        schema="tunnel",
        comment="Words for the degrees of severity, which an owner changes to his own",
    )
    op.bulk_insert(
        kinds,
        [
            {"code": code, "label": label, "geometries": shapes, "wet": wet, "position": 10 * n}
            for n, (code, label, shapes, wet) in enumerate(KINDS, 1)
        ],
    )
    op.bulk_insert(severities, [dict(zip(("id", "label", "text"), row, strict=True)) for row in SEVERITIES])


def _anomaly() -> None:
    anything, in_space = Geometry("GEOMETRY", spatial_index=False), Geometry("GEOMETRYZ", dimension=3, spatial_index=False)
    op.create_table_comment(
        "anomaly", "Findings: leaks, joints and dark spots that were detected, and what people drew, in three geometries",
        schema="tunnel",
        existing_comment="What is darker than dry lining: leaks, joints and other dark spots, in three geometries",
    )  # fmt: skip
    for column in (
        sa.Column(
            "origin", sa.Text(), server_default=sa.text("'detected'"), nullable=False,
            comment="How its outline came about: detected, drawn, redrawn, split or merged; detection changes the first alone",
        ),
        sa.Column(
            "by_hand", sa.Boolean(), server_default=sa.text("false"), nullable=False,
            comment="Whether it was drawn, or split off what was: never detected",
        ),
        sa.Column("severity", sa.SmallInteger(), comment="Severity, 1 to 4"),
        sa.Column("width", sa.Double(), comment="Width of a line, such as a crack, m"),
        sa.Column("length", sa.Double(), comment="Length of a line on the surface, m"),
        sa.Column(
            "shape", anything, comment="The line or point that it is, if it is no polygon, in the unrolled plane, m"
        ),
        sa.Column("shape_map", anything, comment="The same on the map strip, tunnel's SRID, m"),
        sa.Column("shape_surface", in_space, comment="The same in space, tunnel's SRID, m"),
        sa.Column("drawn_by", sa.Text(), comment="Who drew its outline last; none of what was detected"),
        sa.Column("drawn_at", sa.DateTime(timezone=True), comment="When its outline was drawn last"),
        sa.Column("parent_id", sa.BigInteger(), comment="Finding that it was split off"),
        sa.Column("merged_into", sa.BigInteger(), comment="Finding that it is merged into: that one counts"),
        sa.Column("same_as", sa.BigInteger(), comment="Finding that is the same: that one counts"),
        sa.Column("dry_region_id", sa.Integer(), comment="Dry region that it lies in: it does not count while it is open"),
        sa.Column(
            "wet", sa.Boolean(), server_default=sa.text("true"), nullable=False,
            comment="Whether its kind counts as wet: kept by the database, from finding_kind",
        ),
    ):  # fmt: skip
        op.add_column("anomaly", column, schema="tunnel")
    # Sums of what is there do not change, so nothing is to be worked out anew for it.
    op.execute("ALTER TABLE tunnel.anomaly DISABLE TRIGGER USER")
    op.execute("UPDATE tunnel.anomaly SET wet = false WHERE coalesce(judged, kind) <> 'leak'")
    op.execute("ALTER TABLE tunnel.anomaly ENABLE TRIGGER USER")
    op.add_column(
        "anomaly",
        sa.Column(
            "aside", sa.Boolean(), sa.Computed(
                "merged_into IS NOT NULL OR same_as IS NOT NULL OR (dry_region_id IS NOT NULL AND review = 'open')",
                persisted=True,
            ), nullable=False,
            comment="Whether another stands for it, or a dry region takes it away",
        ),
        schema="tunnel",
    )  # fmt: skip
    for name, said in (
        ("drop_mean", "Mean drop below dry lining, dB"),
        ("drop_max", "Greatest drop below dry lining, dB"),
        ("image_share", "Share of its pixels that hold measured data, 0 to 1"),
    ):
        op.alter_column(
            "anomaly", name, nullable=True, comment=said + "; none until measured", existing_comment=said,
            existing_type=sa.Double(), schema="tunnel",
        )  # fmt: skip
    op.alter_column(
        "anomaly", "area", comment="Area on the surface, m²; of a line length times width, of a point 0",
        existing_comment="Area on the surface, m²", existing_type=sa.Double(), schema="tunnel",
    )  # fmt: skip
    op.alter_column(
        "anomaly", "kind",
        comment="What detection takes it for: leak, joint or dark (dark but dry); of what was drawn, what it was drawn as",
        existing_comment="What detection takes it for: leak, joint or dark (dark but dry)", existing_type=sa.Text(),
        schema="tunnel",
    )  # fmt: skip
    _anomaly_constraints()
    _anomaly_indexes()


def _anomaly_constraints() -> None:
    for name in ("kind", "judged"):
        op.drop_constraint(op.f(f"anomaly_{name}_check"), "anomaly", schema="tunnel")
        _reference("anomaly", name, "finding_kind", "code", None)
    for name, rule in (
        ("origin", "origin IN ('detected', 'drawn', 'redrawn', 'split', 'merged')"),
        ("width", "width > 0"),
        ("other", "merged_into <> id AND same_as <> id"),
    ):
        op.create_check_constraint(op.f(f"anomaly_{name}_check"), "anomaly", rule, schema="tunnel")
    _reference("anomaly", "severity", "severity", "id", None)
    for name in ("parent_id", "merged_into", "same_as"):
        _reference("anomaly", name, "anomaly", "id", "SET NULL")
    _reference("anomaly", "dry_region_id", "region", "id", "SET NULL")


def _reference(table: str, column: str, other: str, key: str, gone: str | None) -> None:
    op.create_foreign_key(
        op.f(f"{table}_{column}_fkey"), table, other, [column], [key], source_schema="tunnel", referent_schema="tunnel",
        ondelete=gone,
    )  # fmt: skip


def _anomaly_indexes() -> None:
    summed = ["kind", "judged", "review", "detected", "area", "wet", "aside"]
    for columns, included in (
        (["survey_id", "km"], [*summed, "drop_max"]),
        (["survey_id", "chainage_from", "chainage_to"], ["id", *summed]),
    ):
        name = "_".join(["anomaly", *columns, "idx"])
        op.drop_index(name, "anomaly", schema="tunnel")
        op.create_index(name, "anomaly", columns, schema="tunnel", postgresql_include=included)
    op.create_index("anomaly_kind_idx", "anomaly", ["survey_id", sa.text("COALESCE(judged, kind)")], schema="tunnel")
    op.create_index(
        op.f("anomaly_survey_id_severity_idx"), "anomaly", ["survey_id", "severity"], schema="tunnel",
        postgresql_where=sa.text("severity IS NOT NULL"),
    )  # fmt: skip
    op.create_index(
        "anomaly_uncounted_idx", "anomaly", ["survey_id"], schema="tunnel",
        postgresql_where=sa.text("NOT (detected AND review <> 'rejected' AND NOT aside)"),
    )  # fmt: skip
    op.create_index(
        "anomaly_by_hand_idx", "anomaly", ["survey_id", "chainage_from"], schema="tunnel",
        postgresql_where=sa.text("origin <> 'detected'"),
    )  # fmt: skip
    for name in ("judged", "severity", "merged_into", "same_as", "parent_id", "dry_region_id"):
        op.create_index(op.f(f"anomaly_{name}_idx"), "anomaly", [name], schema="tunnel")
    op.create_index("anomaly_kind_key_idx", "anomaly", ["kind"], schema="tunnel")


def _photo() -> None:
    op.create_table(
        "photo",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("anomaly_id", sa.BigInteger(), nullable=False, comment="Finding that it shows"),
        sa.Column("path", sa.Text(), nullable=False, comment="Path or URL"),
        sa.Column("caption", sa.Text(), comment="What it shows"),
        sa.Column("added_by", sa.Text(), server_default=sa.text("SESSION_USER"), nullable=False, comment="Who added it"),
        sa.Column(
            "added_at", sa.DateTime(timezone=True), server_default=sa.text("clock_timestamp()"), nullable=False,
            comment="When it was added",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("photo_pkey")),
        sa.ForeignKeyConstraint(
            ["anomaly_id"], ["tunnel.anomaly.id"], name=op.f("photo_anomaly_id_fkey"), ondelete="CASCADE"
        ),
        sa.CheckConstraint("path <> ''", name=op.f("photo_path_check")),
        schema="tunnel",
        comment="Photos of findings, by path or URL",
    )  # fmt: skip
    op.create_index(op.f("photo_anomaly_id_idx"), "photo", ["anomaly_id"], schema="tunnel")


# Sums over a hundred thousand findings read this from an index, and need not look each kind up.
_WET = """
CREATE FUNCTION tunnel.set_wet() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    NEW.wet := coalesce((SELECT k.wet FROM tunnel.finding_kind k WHERE k.code = coalesce(NEW.judged, NEW.kind)), false);
    RETURN NEW;
END
$$;
COMMENT ON FUNCTION tunnel.set_wet() IS 'Trigger on tunnel.anomaly: whether its kind, as judged, counts as wet';
CREATE TRIGGER set_wet BEFORE INSERT OR UPDATE OF kind, judged, wet ON tunnel.anomaly
    FOR EACH ROW EXECUTE FUNCTION tunnel.set_wet();
"""
_WET_OF_KIND = """
CREATE FUNCTION tunnel.wet_of_kind() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    UPDATE tunnel.anomaly a SET wet = NEW.wet WHERE coalesce(a.judged, a.kind) = NEW.code;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.wet_of_kind() IS 'Trigger on tunnel.finding_kind: findings of a kind follow whether it is wet';
CREATE TRIGGER wet_of_kind AFTER UPDATE OF wet ON tunnel.finding_kind
    FOR EACH ROW WHEN (OLD.wet IS DISTINCT FROM NEW.wet) EXECUTE FUNCTION tunnel.wet_of_kind();
"""
