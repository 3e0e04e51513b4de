"""The inspector's desk: steps in the audit that are taken back, and large dry regions that wait for an operator.

Revision: 0023, after 0022. Dry regions that are there stay in force, whatever their area.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import JSONB

revision = "0023"
down_revision = "0022"
branch_labels = None
depends_on = None


# By the state that lining_finding says; open and confirmed count. What is no line is as long as it is along the tunnel.
_SUMMED = """survey_id, coalesce(judged, kind), wet, origin, severity,
           CASE WHEN merged_into IS NOT NULL THEN 'merged' WHEN same_as IS NOT NULL THEN 'same'
                WHEN review = 'rejected' THEN 'rejected' WHEN aside THEN 'dry' WHEN NOT detected THEN 'gone'
                ELSE review END,
           image_share IS NOT NULL"""
_ADD = """INSERT INTO tunnel.finding_sum (survey_id, kind, wet, origin, severity, state, measured, findings, area,
        length, extent)
    SELECT c.survey_id, c.kind, c.wet, c.origin, c.severity, c.state, c.measured, sum(c.n), sum(c.n * c.area),
           sum(c.n * c.length), sum(c.n * c.extent)
      FROM ({changed}) AS c (survey_id, kind, wet, origin, severity, state, measured, n, area, length, extent)
      JOIN tunnel.survey s ON s.id = c.survey_id
     GROUP BY 1, 2, 3, 4, 5, 6, 7
    HAVING sum(c.n) <> 0 OR sum(c.n * c.area) <> 0 OR sum(c.n * c.length) <> 0 OR sum(c.n * c.extent) <> 0"""
_CHANGED = "SELECT {summed}, {n}, area, coalesce(length, 0), coalesce(length, chainage_to - chainage_from) FROM {table}"

_COUNT = """
CREATE FUNCTION tunnel.count_{name}() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    {add};
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.count_{name}() IS
'Trigger on tunnel.anomaly: adds to the sums of findings by how much {what} changes them';
CREATE TRIGGER count_{name} AFTER {event} ON tunnel.anomaly
    REFERENCING {tables} FOR EACH STATEMENT EXECUTE FUNCTION tunnel.count_{name}();
"""
_FORGET = """
CREATE FUNCTION tunnel.forget_findings() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    DELETE FROM tunnel.finding_sum;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.forget_findings() IS
'Trigger on tunnel.anomaly: where it is emptied at once, so are the sums of findings';
CREATE TRIGGER count_truncate AFTER TRUNCATE ON tunnel.anomaly FOR EACH STATEMENT EXECUTE FUNCTION tunnel.forget_findings();
"""


def upgrade() -> None:
    for column in (
        sa.Column(
            "waits", sa.Boolean(), server_default=sa.text("false"), nullable=False,
            comment="Whether it waits for an operator, being larger than the tunnel's limit: until then it marks nothing",
        ),
        sa.Column("approved_by", sa.Text(), comment="Operator who put it in force, where it had to wait"),
        sa.Column("approved_at", sa.DateTime(timezone=True), comment="When"),
    ):  # fmt: skip
        op.add_column("region", column, schema="tunnel")
    op.alter_column(
        "tunnel", "dry_region_limit", schema="tunnel",
        comment="Area above which a dry region must say why it is drawn, and waits for an operator, m²",
        existing_comment="Area above which a dry region must say why it is drawn, m²", existing_type=sa.Double(),
    )  # fmt: skip
    for column in (
        sa.Column("undoes", sa.BigInteger(), comment="Entry that this one takes back"),
        sa.Column(
            "part_of", sa.BigInteger(), comment="Entry of the step that this one is a part of: a split, a merge or a delete"
        ),
        sa.Column("kept", JSONB(), comment="What had been measured of a finding before its outline changed"),
    ):
        op.add_column("entry", column, schema="tunnel_audit")
    for name in ("undoes", "part_of"):
        op.create_index(
            op.f(f"entry_{name}_idx"), "entry", [name], schema="tunnel_audit",
            postgresql_where=sa.text(f"{name} IS NOT NULL"),
        )  # fmt: skip
    _indexes()
    _sums()


def _indexes() -> None:
    """What does not count is read from the index alone, and what stands for another is found among its like."""
    op.drop_index("anomaly_uncounted_idx", "anomaly", schema="tunnel")
    op.create_index(
        "anomaly_uncounted_idx", "anomaly", ["survey_id"], schema="tunnel",
        postgresql_where=sa.text("NOT (detected AND review <> 'rejected' AND NOT aside)"),
        postgresql_include=[
            "id", "kind", "judged", "severity", "review", "detected", "aside", "merged_into", "same_as", "dry_region_id"
        ],
    )  # fmt: skip
    op.drop_index("anomaly_same_as_idx", "anomaly", schema="tunnel")
    op.create_index(
        op.f("anomaly_same_as_idx"), "anomaly", ["same_as"], schema="tunnel",
        postgresql_where=sa.text("same_as IS NOT NULL"),
    )  # fmt: skip


def _sums() -> None:
    """Sums over a hundred thousand findings are added up from some dozens of rows. Nobody who draws waits for another."""
    op.create_table(
        "finding_sum",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("kind", sa.Text(), nullable=False, comment="Kind, as judged"),
        sa.Column("wet", sa.Boolean(), nullable=False, comment="Whether it counts as wet"),
        sa.Column("origin", sa.Text(), nullable=False, comment="How their outlines came about"),
        sa.Column("severity", sa.SmallInteger(), comment="Severity"),
        sa.Column(
            "state", sa.Text(), nullable=False, comment="open or confirmed, which count, rejected, gone, dry, same or merged"
        ),
        sa.Column("measured", sa.Boolean(), nullable=False, comment="Whether they were measured on the image"),
        sa.Column("findings", sa.BigInteger(), nullable=False, comment="By how many they became more"),
        sa.Column("area", sa.Double(), nullable=False, comment="By how much their area grew, m²"),
        sa.Column("length", sa.Double(), nullable=False, comment="By how much the length of lines grew, m"),
        sa.Column(
            "extent", sa.Double(), nullable=False, comment="The same, with what is no line as long as along the tunnel, m"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("finding_sum_pkey")),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("finding_sum_survey_id_fkey"), ondelete="CASCADE"
        ),
        schema="tunnel",
        comment="What each change of findings adds to their numbers, areas and lengths: the sums of the rows are those of all "
        "findings. Rows are put together now and then",
    )  # fmt: skip
    op.create_index(op.f("finding_sum_survey_id_idx"), "finding_sum", ["survey_id"], schema="tunnel")
    more, less = (_CHANGED.format(summed=_SUMMED, n=n, table=table) for n, table in ((1, "is_now"), (-1, "was")))
    for name, event, what, tables, changed in (
        ("insert", "INSERT", "what is new", "NEW TABLE AS is_now", more),
        ("update", "UPDATE", "what is changed", "OLD TABLE AS was NEW TABLE AS is_now", f"{more} UNION ALL {less}"),
        ("delete", "DELETE", "what is gone", "OLD TABLE AS was", less),
    ):
        op.execute(_COUNT.format(name=name, event=event, what=what, tables=tables, add=_ADD.format(changed=changed)))
    op.execute(_FORGET)
    op.execute(_ADD.format(changed=_CHANGED.format(summed=_SUMMED, n=1, table="tunnel.anomaly")))
