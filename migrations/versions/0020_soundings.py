"""Soundings that lie in the tunnel's system already.

Revision: 0020, after 0019.
"""

from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None

STATES = "determined, weak (known worse than it should be), undetermined, or given (the file is in the tunnel's system)"
ROTATION = "3 × 3, row by row; NULL where no pose was found, or none is needed"


def upgrade() -> None:
    op.drop_constraint(op.f("sonar_scan_state_check"), "sonar_scan", schema="tunnel")
    op.create_check_constraint(
        op.f("sonar_scan_state_check"),
        "sonar_scan",
        "state IN ('determined', 'weak', 'undetermined', 'given')",
        schema="tunnel",
    )
    op.alter_column("sonar_scan", "state", comment=STATES, schema="tunnel")
    op.alter_column("sonar_scan", "rotation", comment=ROTATION, schema="tunnel")
