"""Sonar scans below the water, registered to the laser's points above it.

Revision: 0018, after 0017.
"""

import sqlalchemy as sa
from alembic import op
from geoalchemy2 import Geometry
from sqlalchemy.dialects import postgresql

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None


def _floats() -> postgresql.ARRAY[float]:
    return postgresql.ARRAY(sa.Double())


def _key(table: str) -> list[sa.schema.SchemaItem]:
    return [
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f(f"{table}_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f(f"{table}_pkey")),
    ]


def _named(table: str) -> list[sa.schema.SchemaItem]:
    unique = sa.UniqueConstraint("survey_id", "name", name=op.f(f"{table}_survey_id_name_key"))
    return [*_key(table), unique]


def upgrade() -> None:
    op.create_table(
        "sonar_scan",
        *_named("sonar_scan"),
        sa.Column("name", sa.Text(), nullable=False, comment="Name of the file"),
        sa.Column("path", sa.Text(), nullable=False, comment="Where the file lay when it was registered"),
        sa.Column("checksum", sa.Text(), nullable=False, comment="SHA-256 of the file, hexadecimal"),
        sa.Column("bytes", sa.BigInteger(), nullable=False, comment="Size of the file"),
        sa.Column(
            "up", sa.Integer(), nullable=False, comment="Whether the file's z axis points up (1) or down (-1), as was said"
        ),
        sa.Column("water_level", sa.Double(), nullable=False, comment="Height of the water, as was said, m"),
        sa.Column(
            "state", sa.Text(), nullable=False, comment="determined, weak (known worse than it should be) or undetermined"
        ),
        sa.Column(
            "undetermined",
            postgresql.ARRAY(sa.Text()),
            nullable=False,
            comment="Directions that are known badly or not at all",
        ),
        sa.Column("rotation", _floats(), nullable=True, comment="3 × 3, row by row; NULL where no pose was found"),
        sa.Column("translation", _floats(), nullable=True, comment="Place of the sonar in the tunnel's SRID, m"),
        sa.Column("scale", sa.Double(), nullable=True, comment="Factor of its coordinates: speed of sound over that assumed"),
        sa.Column(
            "covariance",
            _floats(),
            nullable=True,
            comment="7 × 7, row by row: turns about x, y, z through the sonar, rad, shifts along them, m, and scale",
        ),
        sa.Column(
            "registered_at",
            sa.DateTime(timezone=True),
            server_default=sa.text("now()"),
            nullable=False,
            comment="When it was registered",
        ),
        sa.Column("points", sa.BigInteger(), nullable=True, comment="Points of the file; NULL before it is loaded"),
        sa.Column("false_echoes", sa.BigInteger(), nullable=True, comment="Of these, false echoes, which are left out"),
        sa.Column(
            "outside",
            sa.BigInteger(),
            nullable=True,
            comment="Of these, beyond the axis or too far from the sonar",
        ),
        sa.Column("kept", sa.BigInteger(), nullable=True, comment="Rows of it in tunnel.sonar_point"),
        sa.Column("loaded_at", sa.DateTime(timezone=True), nullable=True, comment="When its points were loaded with this pose"),
        sa.CheckConstraint("state IN ('determined', 'weak', 'undetermined')", name=op.f("sonar_scan_state_check")),
        schema="tunnel",
        comment="Sonar scans below the water, with their poses in the tunnel",
    )
    op.create_table(
        "registration_residual",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("scan_id", sa.BigInteger(), nullable=False, comment="Sonar scan"),
        sa.Column("kind", sa.Text(), nullable=False, comment="wall, ladder, waterline or scan (where two sonar scans overlap)"),
        sa.Column(
            "name", sa.Text(), nullable=False, comment="Side of the wall, name of the ladder or of the other scan's file"
        ),
        sa.Column("count", sa.Integer(), nullable=False, comment="Patches or points that were compared"),
        sa.Column("median", sa.Double(), nullable=False, comment="Median of the absolute distances, m"),
        sa.Column("p95", sa.Double(), nullable=False, comment="Of which 95 % are no more, m"),
        sa.CheckConstraint("kind IN ('wall', 'ladder', 'waterline', 'scan')", name=op.f("registration_residual_kind_check")),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["tunnel.sonar_scan.id"], name=op.f("registration_residual_scan_id_fkey"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("registration_residual_pkey")),
        schema="tunnel",
        comment="What is left between sonar scans and what they were fitted to",
    )
    op.create_index(op.f("registration_residual_scan_id_idx"), "registration_residual", ["scan_id"], schema="tunnel")
    op.create_table(
        "ladder",
        *_named("ladder"),
        sa.Column("name", sa.Text(), nullable=False, comment="Its name in the file of ladders"),
        sa.Column(
            "origin", _floats(), nullable=False, comment="Middle between its stiles at its height zero, tunnel's SRID, m"
        ),
        sa.Column("axes", _floats(), nullable=False, comment="3 × 3, row by row: unit vectors across, up and out to the water"),
        sa.Column("rms", sa.Double(), nullable=False, comment="Of the laser's points from it, m"),
        sa.Column(
            "rungs", postgresql.ARRAY(sa.BigInteger()), nullable=False, comment="Numbers of the rungs that the laser saw"
        ),
        sa.Column("scans", postgresql.ARRAY(sa.Text()), nullable=False, comment="Names of the sonar scans that saw it"),
        schema="tunnel",
        comment="Ladders that stand in the water, as the laser sees them above it",
    )
    op.create_table(
        "sonar_point",
        *_key("sonar_point"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("scan_id", sa.BigInteger(), nullable=False, comment="Sonar scan"),
        sa.Column("chainage", sa.Double(), nullable=False, comment="Chainage by the given axis, m"),
        sa.Column("across", sa.Double(), nullable=False, comment="Place right of the given axis, m"),
        sa.Column(
            "classification",
            sa.SmallInteger(),
            nullable=False,
            comment="40 bed, 41 surface of the water, 42 submerged lining, 43 submerged object",
        ),
        sa.Column("geom", Geometry("POINTZ", spatial_index=False), nullable=False, comment="Place in the tunnel's SRID, m"),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["tunnel.sonar_scan.id"], name=op.f("sonar_point_scan_id_fkey"), ondelete="CASCADE"
        ),
        schema="tunnel",
        comment="Points of sonar scans in the tunnel, thinned and without false echoes",
    )
    op.create_index(op.f("sonar_point_survey_id_km_idx"), "sonar_point", ["survey_id", "km"], schema="tunnel")
    op.create_index(op.f("sonar_point_scan_id_idx"), "sonar_point", ["scan_id"], schema="tunnel")
    op.create_table(
        "bed",
        *_key("bed"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("n", sa.Integer(), nullable=False, comment="Metre of chainage at which it begins"),
        sa.Column("across_n", sa.Integer(), nullable=False, comment="Tenth of a metre right of the axis at which it begins"),
        sa.Column("height", sa.Double(), nullable=False, comment="Median height of the bed, m"),
        sa.Column("depth", sa.Double(), nullable=False, comment="Of the bed below the water, m"),
        sa.Column(
            "sigma",
            sa.Double(),
            nullable=False,
            comment="Standard deviation of its height, that of the scans' poses included, m",
        ),
        sa.Column("points", sa.Integer(), nullable=False, comment="Points of the bed in it"),
        sa.UniqueConstraint("survey_id", "n", "across_n", name=op.f("bed_survey_id_n_across_n_key")),
        schema="tunnel",
        comment="The bed below the water in cells of 1 m along and 0.1 m across; cells that no sonar saw are not there",
    )
    op.create_index(op.f("bed_survey_id_km_idx"), "bed", ["survey_id", "km"], schema="tunnel")
