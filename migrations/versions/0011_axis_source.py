"""The source of a tunnel's given axis may also be a line of a drawing or a map, or the scan it was found in.

Revision: 0011, after 0010.
"""

from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.alter_column(
        "tunnel",
        "design",
        comment="What the given axis was read from or found in: file and alignment, file and layer, or scan; NULL of a table",
        existing_comment="File and alignment that the given axis was read from, if it is a design alignment (LandXML, IFC)",
        schema="tunnel",
    )
