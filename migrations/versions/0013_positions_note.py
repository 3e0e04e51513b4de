"""What is to be known of a survey's scanner positions.

Revision: 0013, after 0012.
"""

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "survey",
        sa.Column("positions_note", sa.Text(), comment="What is to be known of its scanner positions: poses left out, gaps"),
        schema="tunnel",
    )
