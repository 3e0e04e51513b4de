"""What was left out: points without numbers or scanner positions, places of axis vertices; when settings of a survey changed.

Revision: 0009, after 0008.
"""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    for name, comment in (
        ("invalid", "Points dropped as their coordinates, time or intensity are no numbers"),
        ("unposed", "Points dropped as the scanner's position is not known"),
    ):
        op.add_column(
            "scan_file", sa.Column(name, sa.BigInteger(), server_default="0", nullable=False, comment=comment), schema="tunnel"
        )
    op.add_column(
        "survey",
        sa.Column(
            "settings_at", sa.DateTime(timezone=True), nullable=True,
            comment="When scanner positions, reference or intensity were last set to others",
        ),
        schema="tunnel",
    )  # fmt: skip
    op.add_column(
        "axis_vertex",
        sa.Column("remark", sa.Text(), nullable=True, comment="Why the place that was measured is not taken, if it is not"),
        schema="tunnel",
    )
