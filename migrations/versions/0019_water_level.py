"""Sections through what sonar scans saw below the water.

Revision: 0019, after 0018.
"""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "water_level",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column(
            "height", sa.Double(), nullable=True, comment="Of the water, m; NULL where sonar scans were loaded and none is left"
        ),
        sa.Column(
            "changed_at",
            sa.DateTime(timezone=True),
            nullable=False,
            comment="When points of sonar scans were last loaded into the kilometre, or taken out of it",
        ),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("water_level_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("water_level_pkey")),
        sa.UniqueConstraint("survey_id", "km", name=op.f("water_level_survey_id_km_key")),
        schema="tunnel",
        comment="The water in kilometres into which sonar scans were loaded",
    )
    op.create_index(op.f("sonar_point_survey_id_chainage_idx"), "sonar_point", ["survey_id", "chainage"], schema="tunnel")
    op.execute(
        "INSERT INTO tunnel.water_level (survey_id, km, height, changed_at)"
        " SELECT c.survey_id, p.km, max(c.water_level), clock_timestamp()"
        " FROM tunnel.sonar_point p JOIN tunnel.sonar_scan c ON c.id = p.scan_id GROUP BY c.survey_id, p.km"
    )
