"""Surveys of which it is not known where the scanner was.

Revision: 0010, after 0009.
"""

from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.drop_constraint(op.f("survey_platform_check"), "survey", schema="tunnel", type_="check")
    op.create_check_constraint(
        op.f("survey_platform_check"), "survey", "platform IN ('static', 'mobile', 'unknown')", schema="tunnel"
    )
    op.alter_column(
        "survey", "platform", schema="tunnel",
        comment="static (rows in station), mobile (rows in pose), or unknown: range and incidence are not corrected",
    )  # fmt: skip
