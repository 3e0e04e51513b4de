"""Members that are profiles, and which side of one a face is of.

Revision: 0017, after 0016.
"""

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.drop_constraint(op.f("member_kind_check"), "member", schema="tunnel")
    op.create_check_constraint(op.f("member_kind_check"), "member", "kind IN ('flat', 'pipe', 'profile')", schema="tunnel")
    op.alter_column(
        "member",
        "kind",
        comment="flat (planes that lie in one), pipe (cylinders about one axis) or profile (sides of one beam)",
        existing_comment="flat (planes that lie in one) or pipe (cylinders about one axis)",
        schema="tunnel",
    )
    op.alter_column(
        "member",
        "line",
        comment="Its middle line; of a flat one along its longest side; tunnel's SRID, m",
        existing_comment="Its middle line, tunnel's SRID, m",
        schema="tunnel",
    )
    op.add_column(
        "face",
        sa.Column(
            "side",
            sa.Integer(),
            server_default="1",
            nullable=False,
            comment="Side of its member, from 1: faces of one plane or pipe are of one side",
        ),
        schema="tunnel",
    )
    op.alter_column("face", "side", server_default=None, schema="tunnel")
