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
