"""What was measured of each anomaly, what speaks for and against it, and what was learned from reviews.

Revision: 0021, after 0020. Anomalies that were found before have no features; detection measures them.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import ARRAY, JSONB

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None


def upgrade() -> None:
    _feature_list()
    _anomaly()
    _learned_model()


def _feature_list() -> None:
    op.create_table(
        "feature_list",
        sa.Column("id", sa.Integer(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column(
            "names", ARRAY(sa.Text()), nullable=False, comment="Their names; outline: how much the outline tells, 0 to 1"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("feature_list_pkey")),
        sa.UniqueConstraint("names", name=op.f("feature_list_names_key")),
        schema="tunnel",
        comment="In which order the features of anomalies are stored: versions of the program differ",
    )


def _anomaly() -> None:
    for column in (
        sa.Column("feature_list_id", sa.Integer(), comment="Order of its features; none from before they were stored"),
        sa.Column("features", ARRAY(sa.Double()), comment="What was measured of it; NaN what could not be"),
        sa.Column("evidence", JSONB(), comment="What each reason adds to the logarithm of the odds that it is a leak"),
        sa.Column("model", sa.Text(), comment="Version of the model of evidence that judged it"),
    ):
        op.add_column("anomaly", column, schema="tunnel")
    op.create_foreign_key(
        op.f("anomaly_feature_list_id_fkey"), "anomaly", "feature_list", ["feature_list_id"], ["id"],
        source_schema="tunnel", referent_schema="tunnel",
    )  # fmt: skip
    op.create_index(op.f("anomaly_feature_list_id_idx"), "anomaly", ["feature_list_id"], schema="tunnel")


def _learned_model() -> None:
    clock = sa.text("clock_timestamp()")
    op.create_table(
        "learned_model",
        sa.Column("id", sa.Integer(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("tunnel_id", sa.Integer(), nullable=False, comment="Tunnel whose surveys it is for"),
        sa.Column("base", sa.Text(), nullable=False, comment="Version of the model that it adjusts"),
        sa.Column(
            "way", sa.Text(), nullable=False,
            comment="recalibrated (slope and offset of the logarithm of the odds), refit (a factor for each reason, and an "
            "offset) or extended (terms of features, too)",
        ),
        sa.Column(
            "parameters", JSONB(), nullable=False,
            comment="Slope, offset, factors by reason; centre, scale and weight by feature",
        ),
        sa.Column("surveys", ARRAY(sa.Text()), nullable=False, comment="Surveys whose reviews it was learned from"),
        sa.Column("reviews", JSONB(), nullable=False, comment="How many reviews of each kind"),
        sa.Column(
            "loss_base", sa.Double(), nullable=False,
            comment="Mean negative logarithm of the probability of what was said, by the model that it adjusts",
        ),
        sa.Column("loss", sa.Double(), nullable=False, comment="The same, adjusted to reviews of other places"),
        sa.Column("note", sa.Text(), comment="What its maker says of it"),
        sa.Column("applied_by", sa.Text(), nullable=False, comment="Who applied it"),
        sa.Column(
            "active_from", sa.DateTime(timezone=True), server_default=clock, nullable=False, comment="Since when it is in force"
        ),
        sa.Column("undone_by", sa.Text(), comment="Who took it back"),
        sa.Column("undone_at", sa.DateTime(timezone=True), comment="When it was taken back"),
        sa.CheckConstraint("way IN ('recalibrated', 'refit', 'extended')", name=op.f("learned_model_way_check")),
        sa.ForeignKeyConstraint(
            ["tunnel_id"], ["tunnel.tunnel.id"], name=op.f("learned_model_tunnel_id_fkey"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("learned_model_pkey")),
        schema="tunnel",
        comment="What was learned of each tunnel from reviews; the last that was not undone is in force",
    )  # fmt: skip
    op.create_index(op.f("learned_model_tunnel_id_idx"), "learned_model", ["tunnel_id"], schema="tunnel")
