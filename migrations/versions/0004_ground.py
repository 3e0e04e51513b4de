"""Ground, lining, clusters and target spheres; the class of a point.

Revision: 0004, after 0003.
"""

import sqlalchemy as sa
from alembic import op
from geoalchemy2 import Geometry
from sqlalchemy.dialects import postgresql

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "cluster",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000) of its middle"),
        sa.Column("class", sa.SmallInteger(), nullable=False, comment="Class of its points (tunnel_api.class)"),
        sa.Column("chainage_from", sa.Double(), nullable=False, comment="Least chainage, m"),
        sa.Column("chainage_to", sa.Double(), nullable=False, comment="Greatest chainage, m"),
        sa.Column(
            "height_from", sa.Double(), nullable=True, comment="Its lowest point above the ground, m; none without ground"
        ),
        sa.Column(
            "height_to", sa.Double(), nullable=True, comment="Its highest point above the ground, m; none without ground"
        ),
        sa.Column("points", sa.BigInteger(), nullable=False, comment="Points of survey density in it"),
        sa.Column("cell", sa.Double(), nullable=False, comment="Edge of its cells, m"),
        sa.Column(
            "cells",
            postgresql.ARRAY(sa.Integer()),
            nullable=False,
            comment="Cells that its points fill: floor(x / cell), floor(y / cell), floor(z / cell) of each",
        ),
        sa.Column(
            "geom",
            Geometry("POLYGON", dimension=2, spatial_index=False),
            nullable=False,
            comment="Hull of it on the map, tunnel's SRID, m",
        ),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("cluster_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("cluster_pkey")),
        schema="tunnel",
        comment="What stands in the tunnel or hangs on its lining, found by stage ground (DBSCAN, Li et al. 2023)",
    )
    op.create_index(op.f("cluster_geom_idx"), "cluster", ["geom"], unique=False, schema="tunnel", postgresql_using="gist")
    op.create_index(op.f("cluster_survey_id_km_idx"), "cluster", ["survey_id", "km"], unique=False, schema="tunnel")
    op.create_table(
        "ground",
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("n", sa.Integer(), autoincrement=False, nullable=False, comment="Metre: plan distance along the axis, m"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column(
            "across",
            sa.Double(),
            nullable=False,
            comment="Where the first height stands, m right of the axis; the next ones every 0.1 m",
        ),
        sa.Column(
            "height",
            postgresql.ARRAY(sa.Double()),
            nullable=False,
            comment="Height (z) of the ground, m; NaN where there is none",
        ),
        sa.Column("gamma", sa.Double(), nullable=False, comment="Points up to this height above it are ground, m"),
        sa.Column(
            "foot",
            postgresql.ARRAY(sa.Double()),
            nullable=False,
            comment="Where the left and the right wall meet the ground, m right of the axis; NaN where there is no wall",
        ),
        sa.Column(
            "lean",
            postgresql.ARRAY(sa.Double()),
            nullable=False,
            comment="How far the left and the right wall lean to the right for each metre up there",
        ),
        sa.Column("arc_left", sa.Double(), nullable=True, comment="Arc at which the ground begins on the left, m"),
        sa.Column("arc_right", sa.Double(), nullable=True, comment="Arc at which the ground begins on the right, m"),
        sa.Column(
            "geom",
            Geometry("LINESTRINGZ", dimension=3, spatial_index=False),
            nullable=False,
            comment="The ground from the left to the right, tunnel's SRID, m",
        ),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("ground_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("survey_id", "n", name=op.f("ground_pkey")),
        schema="tunnel",
        comment="The ground at each metre along the tunnel that has one, found by stage ground (Li et al. 2023)",
    )
    op.create_index(op.f("ground_survey_id_km_idx"), "ground", ["survey_id", "km"], unique=False, schema="tunnel")
    op.create_table(
        "lining",
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), autoincrement=False, nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("cell", sa.Double(), nullable=False, comment="Edge of a cell, m"),
        sa.Column(
            "box",
            postgresql.ARRAY(sa.Integer()),
            nullable=False,
            comment="First column (chainage / cell), first row (arc / cell), columns and rows of the grid",
        ),
        sa.Column(
            "offset",
            sa.LargeBinary(),
            nullable=False,
            comment="Offset of the lining in each cell, m, by rows from the lowest arc; float32, little-endian, NaN for none",
        ),
        sa.Column(
            "spread",
            sa.LargeBinary(),
            nullable=False,
            comment="Standard deviation of the lining's points about it, m; the same form",
        ),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("lining_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("survey_id", "km", name=op.f("lining_pkey")),
        schema="tunnel",
        comment="Local planes of the lining, of each kilometre, found by stage ground: a grid in the unrolled plane",
    )
    op.create_table(
        "target_sphere",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column(
            "number",
            sa.Integer(),
            nullable=False,
            comment="Number of the sphere, along the tunnel; the same for all scans that saw it",
        ),
        sa.Column("scan_id", sa.Integer(), nullable=False, comment="Scan that saw it (point_source_id)"),
        sa.Column(
            "chainage", sa.Double(), nullable=True, comment="Chainage of its centre, m; none where the tunnel has no segment"
        ),
        sa.Column(
            "geom",
            Geometry("POINTZ", dimension=3, spatial_index=False),
            nullable=False,
            comment="Centre, by the nominal radius, tunnel's SRID, m",
        ),
        sa.Column("radius", sa.Double(), nullable=False, comment="Radius of the best sphere of any radius, a check, m"),
        sa.Column("nominal", sa.Double(), nullable=False, comment="Radius that was asked for, m"),
        sa.Column("rms", sa.Double(), nullable=False, comment="Root mean square of its points' distances from the sphere, m"),
        sa.Column("sigma", sa.Double(), nullable=False, comment="Standard deviation of the centre, from the fit, m"),
        sa.Column("coverage", sa.Double(), nullable=False, comment="Share of the sphere's surface that is seen, 0 to 1"),
        sa.Column("points", sa.Integer(), nullable=False, comment="Points that it was fitted to"),
        sa.Column(
            "found_at", sa.DateTime(timezone=True), server_default=sa.text("now()"), nullable=False, comment="When it was found"
        ),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("target_sphere_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("target_sphere_pkey")),
        sa.UniqueConstraint("survey_id", "number", "scan_id", name=op.f("target_sphere_survey_id_number_scan_id_key")),
        schema="tunnel",
        comment="Target spheres, one row for each scan that saw one (Li et al. 2023)",
    )
    op.create_index(
        op.f("target_sphere_geom_idx"), "target_sphere", ["geom"], unique=False, schema="tunnel", postgresql_using="gist"
    )
    op.add_column(
        "point",
        sa.Column(
            "class",
            sa.SmallInteger(),
            nullable=True,
            comment="Class found by stage ground (tunnel_api.class); none before it has run",
        ),
        schema="tunnel",
    )
    op.alter_column("run", "stage", comment="read, load, axis, segments, sections, ground, detect; spheres", schema="tunnel")
