"""The stages of a kilometre: their order and what each rests on. `tunneldb init` fills the table anew each time.

Revision: 0008, after 0007.
"""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "stage",
        sa.Column("step", sa.Integer(), autoincrement=False, nullable=False, comment="Its number in their order, from 1"),
        sa.Column("name", sa.Text(), nullable=False, comment="Name"),
        sa.Column(
            "reads", sa.ARRAY(sa.Text()), nullable=False, comment="Stages whose results in the kilometre itself it rests on"
        ),
        sa.Column(
            "reads_beside", sa.ARRAY(sa.Text()), nullable=False,
            comment="Stages whose results in the kilometres before and after it rests on",
        ),
        sa.Column(
            "parameters", sa.ARRAY(sa.Text()), nullable=False, comment="Prefixes of the parameters that it depends on"
        ),
        sa.PrimaryKeyConstraint("step", name="stage_pkey"),
        sa.UniqueConstraint("name", name="stage_name_key"),
        schema="tunnel",
        comment="Stages of a kilometre, in their order; tunneldb init fills it anew",
    )  # fmt: skip
