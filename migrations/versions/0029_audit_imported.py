"""Entries of the audit that came in with an archive of a survey say so.

Revision: 0029, after 0028.
"""

import sqlalchemy as sa
from alembic import op

revision = "0029"
down_revision = "0028"
branch_labels = None
depends_on = None


def upgrade() -> None:
    for column in (
        sa.Column("imported_by", sa.Text(), comment="Who brought it in with an archive of the survey"),
        sa.Column("imported_at", sa.DateTime(timezone=True), comment="When; who and at are then what the archive says"),
    ):
        op.add_column("entry", column, schema="tunnel_audit")
