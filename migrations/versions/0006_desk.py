"""Design alignments, tunnels' own stationing, and an audit of what people change by hand.

Revision: 0006, after 0005.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "tunnel",
        sa.Column(
            "design", sa.Text(),
            comment="File and alignment that the given axis was read from, if it is a design alignment (LandXML, IFC)",
        ),
        schema="tunnel",
    )  # fmt: skip
    _alignment_element()
    _station_equation()
    _audit()
    _totals()
    _indexes()


def _alignment_element() -> None:
    op.create_table(
        "alignment_element",
        _tunnel(),
        sa.Column("plane", sa.Text(), nullable=False, comment="horizontal or vertical"),
        sa.Column("n", sa.Integer(), autoincrement=False, nullable=False, comment="Number along the alignment, from 1"),
        sa.Column(
            "kind", sa.Text(), nullable=False, comment="line, arc, clothoid (horizontal); grade, parabola, circle (vertical)"
        ),
        sa.Column("chainage", sa.Double(), nullable=False, comment="Chainage of its beginning, m"),
        sa.Column("length", sa.Double(), nullable=False, comment="Its length in plan, m"),
        sa.Column("x", sa.Double(), comment="Where a horizontal one begins, tunnel's SRID, m"),
        sa.Column("y", sa.Double(), comment="Where a horizontal one begins, tunnel's SRID, m"),
        sa.Column(
            "bearing", sa.Double(), comment="Direction in which a horizontal one begins, radians from the x axis towards y"
        ),
        sa.Column(
            "curvature_from", sa.Double(),
            comment="Curvature of a horizontal one at its beginning, 1/m, positive to the left; in between it is linear",
        ),
        sa.Column("curvature_to", sa.Double(), comment="The same at its end, 1/m"),
        sa.Column("z", sa.Double(), comment="Height at which a vertical one begins, m"),
        sa.Column("grade_from", sa.Double(), comment="Rise per metre in plan of a vertical one at its beginning"),
        sa.Column("grade_to", sa.Double(), comment="The same at its end"),
        sa.PrimaryKeyConstraint("tunnel_id", "plane", "n", name="alignment_element_pkey"),
        _tunnel_key("alignment_element"),
        sa.CheckConstraint("plane IN ('horizontal', 'vertical')", name=op.f("alignment_element_plane_check")),
        sa.CheckConstraint(
            "kind IN ('line', 'arc', 'clothoid', 'grade', 'parabola', 'circle')", name=op.f("alignment_element_kind_check")
        ),
        sa.CheckConstraint("length > 0", name=op.f("alignment_element_length_check")),
        schema="tunnel",
        comment="Elements of the design alignment, where the given axis came as one (LandXML, IFC)",
    )  # fmt: skip


def _station_equation() -> None:
    op.create_table(
        "station_equation",
        _tunnel(),
        sa.Column(
            "chainage", sa.Double(), autoincrement=False, nullable=False,
            comment="Chainage (distance) from which the piece holds, m",
        ),
        sa.Column("station", sa.Double(), nullable=False, comment="Station there, m"),
        sa.Column(
            "direction", sa.SmallInteger(), server_default=sa.text("1"), nullable=False,
            comment="1 where stations grow with chainage, -1 where they run backwards",
        ),
        sa.PrimaryKeyConstraint("tunnel_id", "chainage", name="station_equation_pkey"),
        _tunnel_key("station_equation"),
        sa.CheckConstraint("direction IN (-1, 1)", name=op.f("station_equation_direction_check")),
        schema="tunnel",
        comment="Stationing of tunnels whose stations jump or run backwards, piece by piece; others have no rows",
    )  # fmt: skip


# An audit is of use only where nobody changes it: not by mistake either, so the owner's DELETE is refused, too.
_APPEND_ONLY = """
CREATE FUNCTION tunnel_audit.refuse() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp AS $$
BEGIN
    RAISE EXCEPTION 'entries of the audit are neither changed nor deleted' USING ERRCODE = 'insufficient_privilege';
END
$$;
COMMENT ON FUNCTION tunnel_audit.refuse() IS 'Trigger of tunnel_audit.entry: entries are neither changed nor deleted';
REVOKE EXECUTE ON FUNCTION tunnel_audit.refuse() FROM PUBLIC;
CREATE TRIGGER append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON tunnel_audit.entry
    FOR EACH STATEMENT EXECUTE FUNCTION tunnel_audit.refuse();
"""


def _audit() -> None:
    # in a schema of its own: operators own schema tunnel, and who owns a schema may drop any table in it
    op.execute("CREATE SCHEMA tunnel_audit")
    op.execute("COMMENT ON SCHEMA tunnel_audit IS 'What people changed by hand; read it through tunnel_api.audit'")
    op.create_table(
        "entry",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column(
            "at", sa.DateTime(timezone=True), server_default=sa.text("clock_timestamp()"), nullable=False, comment="When"
        ),
        sa.Column("who", sa.Text(), server_default=sa.text("SESSION_USER"), nullable=False, comment="Who was logged in"),
        sa.Column("survey", sa.Text(), nullable=False, comment="Name of the survey"),
        sa.Column("view", sa.Text(), nullable=False, comment="What was changed: anomaly, axis_vertex or region"),
        sa.Column("row_id", sa.BigInteger(), nullable=False, comment="Its id there"),
        sa.Column("action", sa.Text(), nullable=False, comment="insert, update or delete"),
        sa.Column("before", JSONB(), comment="Columns that changed, as they were; none of an insert"),
        sa.Column("after", JSONB(), comment="The same as they are now; none of a delete"),
        sa.PrimaryKeyConstraint("id", name="entry_pkey"),
        sa.CheckConstraint("action IN ('insert', 'update', 'delete')", name=op.f("entry_action_check")),
        schema="tunnel_audit",
        comment="What people changed through the views: who, when, before and after; outlives what it speaks of",
    )
    op.create_index("entry_survey_at_idx", "entry", ["survey", "at"], schema="tunnel_audit")
    op.create_index("entry_view_row_id_idx", "entry", ["view", "row_id"], schema="tunnel_audit")
    op.execute(_APPEND_ONLY)


# Sums of a kilometre, so that nobody has to add up its 10 000 steps; made by the database, whoever writes the row.
_TOTAL = """
CREATE FUNCTION tunnel.total(steps real[]) RETURNS double precision
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
AS $$ SELECT sum(s::double precision) FROM unnest(steps) AS s $$;
COMMENT ON FUNCTION tunnel.total(real[]) IS 'Sum of the steps of a kilometre';
"""


def _totals() -> None:
    op.execute(_TOTAL)
    for name in ("lining", "seen", "wet"):
        op.add_column(
            "coverage",
            sa.Column(
                f"{name}_total", sa.Double(), sa.Computed(f"tunnel.total({name})", persisted=True), comment=f"Sum of {name}, m²"
            ),
            schema="tunnel",
        )


def _indexes() -> None:
    """Stretches, kilometres and the largest leaks of long tunnels; what is summed up comes from the index alone."""
    summed = ["kind", "judged", "review", "detected", "area"]
    op.drop_index("anomaly_survey_id_km_idx", "anomaly", schema="tunnel")
    for columns, included in (
        (["survey_id", "km"], [*summed, "drop_max"]),
        (["survey_id", "chainage_from", "chainage_to"], ["id", *summed]),
        (["survey_id", "area"], None),
        (["survey_id", "created_at"], None),
    ):
        name = "_".join(["anomaly", *columns, "idx"])
        op.create_index(name, "anomaly", columns, schema="tunnel", postgresql_include=included)
    op.create_index("anomaly_gone_idx", "anomaly", ["survey_id"], schema="tunnel", postgresql_where=sa.text("NOT detected"))
    # without it the planner takes one row in 200 for a leak
    op.execute("CREATE STATISTICS tunnel.anomaly_kind ON (coalesce(judged, kind)) FROM tunnel.anomaly")


def _tunnel() -> sa.Column[int]:
    return sa.Column("tunnel_id", sa.Integer(), nullable=False, comment="Tunnel that the row belongs to")


def _tunnel_key(table: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint(["tunnel_id"], ["tunnel.tunnel.id"], name=f"{table}_tunnel_id_fkey", ondelete="CASCADE")
