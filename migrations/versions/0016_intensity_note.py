"""What is to be known of a file's intensity; what an SRID of 0 means.

Revision: 0016, after 0015.
"""

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column(
        "scan_file",
        sa.Column(
            "intensity_note", sa.Text(), comment="What its intensity gives to doubt: saturated, another kind by its values"
        ),
        schema="tunnel",
    )
    op.alter_column(
        "tunnel",
        "srid",
        comment="Spatial reference of all coordinates of this tunnel; projected, metres; 0: local metres, of no place on Earth",
        schema="tunnel",
    )
