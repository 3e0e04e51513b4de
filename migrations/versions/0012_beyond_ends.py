"""Points that lie beyond the ends of the given axis, where the tunnel may go on.

Revision: 0012, after 0011.
"""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    for name, comment in (
        ("beyond_before", "Of the points outside, those before the beginning of the given axis, drawn on"),
        ("beyond_after", "Of the points outside, those after the end of the given axis, drawn on"),
    ):
        column = sa.Column(name, sa.BigInteger(), server_default="0", nullable=False, comment=comment)
        op.add_column("scan_file", column, schema="tunnel")
    for name, comment in (
        ("reach_before", "How far before the beginning of the given axis nearly all of these lie, m"),
        ("reach_after", "How far after the end of the given axis nearly all of these lie, m"),
    ):
        column = sa.Column(name, sa.Double(), server_default="0", nullable=False, comment=comment)
        op.add_column("scan_file", column, schema="tunnel")
