"""Clearance: outlines about tracks, and what stands how near to them.

Revision: 0025, after 0024.
"""

import sqlalchemy as sa
from alembic import op
from geoalchemy2 import Geometry
from sqlalchemy.dialects.postgresql import ARRAY

revision = "0025"
down_revision = "0024"
branch_labels = None
depends_on = None


def upgrade() -> None:
    _gauge()
    _clearance_section()
    _clearance_infringement()
    op.alter_column(
        "run", "stage", schema="tunnel", existing_type=sa.Text(), existing_nullable=False,
        comment="read, load, axis, segments, sections, ground, detect; spheres, members, deviation, clearance",
        existing_comment="read, load, axis, segments, sections, ground, detect; spheres, members, deviation",
    )  # fmt: skip


def _gauge() -> None:
    op.create_table(
        "gauge",
        sa.Column("id", sa.Integer(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("tunnel_id", sa.Integer(), nullable=False, comment="Tunnel that the row belongs to"),
        sa.Column("name", sa.Text(), nullable=False, comment="Its name"),
        sa.Column("outline", ARRAY(sa.Double()), nullable=False,
            comment="Of each vertex: right of the track's middle, above its running surface, m, and bulge of what leads "
            "to the next",
        ),
        sa.Column("source", sa.Text(), nullable=False, comment="File that it was read from"),
        sa.Column("checksum", sa.Text(), nullable=False, comment="MD5 of the outline"),
        sa.Column("added_at", sa.DateTime(timezone=True), server_default=sa.text("clock_timestamp()"), nullable=False,
            comment="When it was added",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("gauge_pkey")),
        sa.ForeignKeyConstraint(["tunnel_id"], ["tunnel.tunnel.id"], name=op.f("gauge_tunnel_id_fkey"), ondelete="CASCADE"),
        sa.UniqueConstraint("tunnel_id", "name", name=op.f("gauge_tunnel_id_name_key")),
        schema="tunnel",
        comment="Outlines that are to be clear about tracks or lanes",
    )  # fmt: skip


def _clearance_section() -> None:
    op.create_table(
        "clearance_section",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("gauge", sa.Text(), nullable=False, comment="Name of the outline"),
        sa.Column("track", sa.Text(), nullable=False,
            comment="single; left or right; of more than two their number from the left; given",
        ),
        sa.Column("chainage_from", sa.Double(), nullable=False, comment="Chainage of its beginning along the given axis, m"),
        sa.Column("chainage_to", sa.Double(), nullable=False, comment="Chainage of its end, m"),
        sa.Column("track_right", sa.Double(), nullable=False, comment="Middle of the track right of the given axis, m"),
        sa.Column("track_up", sa.Double(), nullable=False,
            comment="Plane of the running surface there above the given axis, m",
        ),
        sa.Column("cant", sa.Double(), nullable=False, comment="How much higher the left rail lies, m"),
        sa.Column("curvature", sa.Double(), nullable=False, comment="Of the track in plan, positive to the right, 1/m"),
        sa.Column("widened_left", sa.Double(), nullable=False,
            comment="By how much the outline is wider on the left, without roll, m",
        ),
        sa.Column("widened_right", sa.Double(), nullable=False, comment="By how much on the right, m"),
        sa.Column("roll", sa.Double(), nullable=False, comment="Roll of the vehicle, positive to the right, rad"),
        sa.Column("margin", sa.Double(), nullable=True,
            comment="Least distance, m, negative inside; NULL where nothing that counts",
        ),
        sa.Column("margin_se", sa.Double(), nullable=True, comment="Its standard error by that of the track alone, m"),
        sa.Column("clock", sa.Double(), nullable=True,
            comment="Direction of that point, degrees from straight above to the right",
        ),
        sa.Column("class", sa.Integer(), nullable=True, comment="Class of that point"),
        sa.Column("cluster_id", sa.BigInteger(), nullable=True, comment="Cluster of stage ground that it lies in, if any"),
        sa.Column("margins", ARRAY(sa.REAL()), nullable=False,
            comment="Least distance in each 5° by clock, from straight above, m; NaN: nothing",
        ),
        sa.Column("seen_share", sa.Double(), nullable=False,
            comment="Share of the directions with a return of anything, 0 to 1",
        ),
        sa.Column("points", sa.Integer(), nullable=False, comment="Points that count"),
        sa.Column("inside", sa.Integer(), nullable=False, comment="Of them inside"),
        sa.Column("stray", sa.Integer(), nullable=False, comment="Points inside without company, or noise: they do not count"),
        sa.Column("passing", sa.Integer(), nullable=False,
            comment="Points inside of objects and spheres, which may be gone: they do not count",
        ),
        sa.Column("ground", sa.Integer(), nullable=False, comment="Points inside that are ground or rail: they do not count"),
        sa.Column("outline", ARRAY(sa.Double()), nullable=False, comment="The outline widened, as in gauge"),
        sa.Column("geom", Geometry("PointZ", spatial_index=False), nullable=True, comment="The point with the least distance"),
        sa.PrimaryKeyConstraint("id", name=op.f("clearance_section_pkey")),
        sa.UniqueConstraint("survey_id", "gauge", "track", "chainage_from", name=op.f("clearance_section_survey_id_gauge_track_chainage_from_key")),  # noqa: E501
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("clearance_section_survey_id_fkey"), ondelete="CASCADE"),  # noqa: E501
        schema="tunnel",
        comment="Least distance of what stands in the tunnel from an outline about a track, by metre",
    )  # fmt: skip
    op.create_index(
        op.f("clearance_section_survey_id_gauge_margin_idx"),
        "clearance_section",
        ["survey_id", "gauge", "margin"],
        schema="tunnel",
    )


def _clearance_infringement() -> None:
    op.create_table(
        "clearance_infringement",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("gauge", sa.Text(), nullable=False, comment="Name of the outline"),
        sa.Column("track", sa.Text(), nullable=False, comment="As of clearance_section"),
        sa.Column("chainage_from", sa.Double(), nullable=False, comment="First place along the given axis, m"),
        sa.Column("chainage_to", sa.Double(), nullable=False, comment="Last place, m"),
        sa.Column("depth", sa.Double(), nullable=False, comment="How deep it reaches in, m"),
        sa.Column("clock", sa.Double(), nullable=False,
            comment="Direction of its deepest point, degrees from straight above to the right",
        ),
        sa.Column("class", sa.Integer(), nullable=False, comment="Class of its points"),
        sa.Column("counts", sa.Boolean(), nullable=False, comment="False of objects and spheres, which may be gone"),
        sa.Column("cluster_id", sa.BigInteger(), nullable=True,
            comment="Cluster of stage ground with its deepest point, if any",
        ),
        sa.Column("points", sa.Integer(), nullable=False, comment="How many"),
        sa.Column("unrolled", Geometry("MultiPolygon", spatial_index=False), nullable=True,
            comment="What it covers of the unrolled plane, chainage and arc; NULL where not on the lining",
        ),
        sa.Column("geom", Geometry("MultiPointZ", spatial_index=False), nullable=False,
            comment="Its points, at most 200, deepest first",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("clearance_infringement_pkey")),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("clearance_infringement_survey_id_fkey"), ondelete="CASCADE"),  # noqa: E501
        schema="tunnel",
        comment="Groups of points inside an outline, in pieces of 10 m at most",
    )  # fmt: skip
    op.create_index(
        op.f("clearance_infringement_survey_id_gauge_depth_idx"),
        "clearance_infringement",
        ["survey_id", "gauge", "depth"],
        schema="tunnel",
    )
