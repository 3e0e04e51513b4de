"""Mean colour of spots.

Revision: 0015, after 0014.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import postgresql

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "spot",
        sa.Column(
            "rgb",
            postgresql.ARRAY(sa.SmallInteger()),
            comment="Mean colour of its points: red, green, blue, 0 to 255; NULL where they have none",
        ),
        schema="tunnel",
    )
