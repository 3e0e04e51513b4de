"""Sites, which have no axis; members, faces and spots of structures.

Revision: 0014, after 0013.
"""

import sqlalchemy as sa
from alembic import op
from geoalchemy2 import Geometry
from sqlalchemy.dialects import postgresql

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None


def _geometry(kind: str) -> Geometry:
    return Geometry(kind, spatial_index=False)


def upgrade() -> None:
    op.alter_column(
        "tunnel",
        "alignment",
        nullable=True,
        comment="Axis as given, in growing chainage, in the tunnel's SRID; NULL of a site",
        existing_comment="Axis as given, in growing chainage, in the tunnel's SRID",
        schema="tunnel",
    )
    op.create_table(
        "member",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column(
            "number",
            sa.Integer(),
            nullable=False,
            comment="Its number in the survey, from 1; dimension member of files written",
        ),
        sa.Column(
            "kind", sa.Text(), nullable=False, comment="flat (planes that lie in one) or pipe (cylinders about one axis)"
        ),
        sa.Column("length", sa.Double(), nullable=False, comment="Length along its line, gaps counted, m"),
        sa.Column("area", sa.Double(), nullable=False, comment="Area of its faces, m²"),
        sa.Column(
            "bimodal",
            sa.Boolean(),
            nullable=False,
            comment="Whether so much of it differs from the rest that neither is known to be its own surface",
        ),
        sa.Column(
            "chainage", sa.Double(), nullable=True, comment="Chainage of its middle, m; NULL of a site or beyond the sections"
        ),
        sa.Column("line", _geometry("LINESTRINGZ"), nullable=False, comment="Its middle line, tunnel's SRID, m"),
        sa.CheckConstraint("kind IN ('flat', 'pipe')", name=op.f("member_kind_check")),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("member_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("member_pkey")),
        sa.UniqueConstraint("survey_id", "number", name=op.f("member_survey_id_number_key")),
        schema="tunnel",
        comment="Members of structures: faces that belong together, joined where others hide them",
    )
    op.create_table(
        "face",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("member_id", sa.BigInteger(), nullable=False, comment="Member that it belongs to"),
        sa.Column(
            "number", sa.Integer(), nullable=False, comment="Its number in the survey, from 1; dimension face of files written"
        ),
        sa.Column("kind", sa.Text(), nullable=False, comment="flat (a plane) or pipe (a part of a cylinder)"),
        sa.Column(
            "origin",
            postgresql.ARRAY(sa.Double()),
            nullable=False,
            comment="Where its unrolled coordinates are (0, 0) or on its axis: x, y, z, m",
        ),
        sa.Column(
            "axis",
            postgresql.ARRAY(sa.Double()),
            nullable=False,
            comment="Axis of a pipe; of a plane its normal, towards the scanners",
        ),
        sa.Column(
            "across",
            postgresql.ARRAY(sa.Double()),
            nullable=False,
            comment="Direction at right angles to it from which unrolled coordinates count: u of a plane, v = 0 of a pipe",
        ),
        sa.Column("radius", sa.Double(), nullable=True, comment="Radius of a pipe, m; NULL of a plane"),
        sa.Column("inside", sa.Boolean(), nullable=False, comment="Whether a pipe is seen from inside"),
        sa.Column("rms", sa.Double(), nullable=False, comment="Root mean square of its points' distances from it, m"),
        sa.Column("points", sa.BigInteger(), nullable=False, comment="Points of the scans on it"),
        sa.Column("area", sa.Double(), nullable=False, comment="Area within its outline, m²"),
        sa.Column("seen_share", sa.Double(), nullable=False, comment="Share of it that could be judged, 0 to 1"),
        sa.Column(
            "incidence_from", sa.Double(), nullable=True, comment="Least angle of incidence at which it was judged, degrees"
        ),
        sa.Column(
            "incidence_to", sa.Double(), nullable=True, comment="Greatest angle of incidence at which it was judged, degrees"
        ),
        sa.Column(
            "level", sa.Double(), nullable=True, comment="Its own level of intensity, dB; NULL where none could be found"
        ),
        sa.Column("sigma", sa.Double(), nullable=True, comment="Standard deviation about it, dB"),
        sa.Column(
            "bimodal",
            sa.Boolean(),
            nullable=False,
            comment="Whether more than half of what was judged differs, so that nobody knows which half is its own",
        ),
        sa.Column(
            "chainage", sa.Double(), nullable=True, comment="Chainage of its middle, m; NULL of a site or beyond the sections"
        ),
        sa.Column("outline", _geometry("MULTIPOLYGON"), nullable=False, comment="In its own plane, of a cylinder unrolled, m"),
        sa.Column("surface", _geometry("MULTIPOLYGONZ"), nullable=False, comment="In space, tunnel's SRID, m"),
        sa.CheckConstraint("kind IN ('flat', 'pipe')", name=op.f("face_kind_check")),
        sa.ForeignKeyConstraint(["member_id"], ["tunnel.member.id"], name=op.f("face_member_id_fkey"), ondelete="CASCADE"),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("face_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("face_pkey")),
        sa.UniqueConstraint("survey_id", "number", name=op.f("face_survey_id_number_key")),
        schema="tunnel",
        comment="Faces of members: planes and cylinders grown in the scans' points",
    )
    op.create_index(op.f("face_member_id_idx"), "face", ["member_id"], unique=False, schema="tunnel")
    op.create_index(op.f("face_surface_idx"), "face", ["surface"], unique=False, schema="tunnel", postgresql_using="gist")
    op.create_table(
        "spot",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column(
            "number", sa.Integer(), nullable=False, comment="Its number in the tunnel or site: the same in the next survey"
        ),
        sa.Column(
            "face_id", sa.BigInteger(), nullable=True, comment="Face that it is on; NULL where the last run found it no more"
        ),
        sa.Column("kind", sa.Text(), nullable=False, comment="dark or bright, against its own surface"),
        sa.Column(
            "reasons",
            postgresql.ARRAY(sa.Text()),
            server_default=sa.text("'{}'"),
            nullable=False,
            comment="What speaks for it or against it",
        ),
        sa.Column(
            "confidence",
            sa.Double(),
            nullable=False,
            comment="Confidence that it differs and is none of an edge or of noise, 0 to 1",
        ),
        sa.Column(
            "contrast", sa.Double(), nullable=False, comment="Mean difference from its surface in standard deviations of it"
        ),
        sa.Column("difference", sa.Double(), nullable=False, comment="Mean difference from its surface, dB"),
        sa.Column("area", sa.Double(), nullable=False, comment="Area on its face, m²"),
        sa.Column("points", sa.BigInteger(), nullable=False, comment="Points of the scans on it"),
        sa.Column("scans", sa.Integer(), nullable=False, comment="Scans that saw it"),
        sa.Column(
            "chainage", sa.Double(), nullable=True, comment="Chainage of its middle, m; NULL of a site or beyond the sections"
        ),
        sa.Column("outline", _geometry("POLYGON"), nullable=False, comment="In its face's own plane, m"),
        sa.Column("map", _geometry("POLYGON"), nullable=False, comment="On the map, m; what stands upright is 2 cm wide"),
        sa.Column("surface", _geometry("POLYGONZ"), nullable=False, comment="In space, tunnel's SRID, m"),
        sa.Column(
            "review",
            sa.Text(),
            server_default=sa.text("'open'"),
            nullable=False,
            comment="open, confirmed or rejected, by an inspector",
        ),
        sa.Column("reviewed_by", sa.Text(), nullable=True, comment="Who reviewed it"),
        sa.Column("reviewed_at", sa.DateTime(timezone=True), nullable=True, comment="When it was reviewed"),
        sa.Column("remark", sa.Text(), nullable=True, comment="Inspector's remark"),
        sa.Column(
            "detected",
            sa.Boolean(),
            server_default=sa.text("true"),
            nullable=False,
            comment="Whether the last detection found it again",
        ),
        sa.Column(
            "created_at",
            sa.DateTime(timezone=True),
            server_default=sa.text("now()"),
            nullable=False,
            comment="When it was first found",
        ),
        sa.Column(
            "detected_at",
            sa.DateTime(timezone=True),
            server_default=sa.text("now()"),
            nullable=False,
            comment="When it was last found",
        ),
        sa.CheckConstraint("kind IN ('dark', 'bright')", name=op.f("spot_kind_check")),
        sa.CheckConstraint("review IN ('open', 'confirmed', 'rejected')", name=op.f("spot_review_check")),
        sa.ForeignKeyConstraint(["face_id"], ["tunnel.face.id"], name=op.f("spot_face_id_fkey"), ondelete="SET NULL"),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("spot_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name=op.f("spot_pkey")),
        schema="tunnel",
        comment="Spots that are darker or brighter than their own surface, in three geometries",
    )
    op.create_index(op.f("spot_face_id_idx"), "spot", ["face_id"], unique=False, schema="tunnel")
    op.create_index(op.f("spot_map_idx"), "spot", ["map"], unique=False, schema="tunnel", postgresql_using="gist")
    op.create_index(op.f("spot_survey_id_number_idx"), "spot", ["survey_id", "number"], unique=False, schema="tunnel")
    op.alter_column(
        "run",
        "stage",
        existing_type=sa.TEXT(),
        comment="read, load, axis, segments, sections, ground, detect; spheres, members",
        existing_comment="read, load, axis, segments, sections, ground, detect; spheres",
        existing_nullable=False,
        schema="tunnel",
    )
    op.alter_column(
        "entry",
        "view",
        existing_type=sa.TEXT(),
        comment="What was changed: anomaly, spot, axis_vertex or region",
        existing_comment="What was changed: anomaly, axis_vertex or region",
        existing_nullable=False,
        schema="tunnel_audit",
    )
