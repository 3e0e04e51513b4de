"""Rings of the linings of surveys.

Revision: 0026, after 0025.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import ARRAY

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None


def upgrade() -> None:
    _ring()
    _ring_chord()
    op.alter_column(
        "run", "stage", schema="tunnel", existing_type=sa.Text(), existing_nullable=False,
        comment="read, load, axis, segments, sections, ground, detect; spheres, members, deviation, clearance, rings",
        existing_comment="read, load, axis, segments, sections, ground, detect; spheres, members, deviation, clearance",
    )  # fmt: skip


def _ring() -> None:
    op.create_table(
        "ring",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("number", sa.Integer(), nullable=False, comment="Number of the ring"),
        sa.Column("chainage_from", sa.Double(), nullable=False, comment="Chainage of the joint at its beginning, m"),
        sa.Column("chainage_to", sa.Double(), nullable=False, comment="Chainage of the joint at its end, m"),
        sa.Column("origin", sa.Text(), nullable=False, comment="How the rings were given: length, file, or found"),
        sa.Column("joint", sa.Text(), nullable=False, comment="Joint at its beginning: given, seen, or missing"),
        sa.Column("seen_share", sa.Double(), comment="Share of its circumference that is seen; NULL: not measured"),
        sa.Column("shape", sa.Text(), comment="What was fitted: ellipse, circle, or none"),
        sa.Column("centre_right", sa.Double(), comment="How far its centre lies right of the given axis, m"),
        sa.Column("centre_right_se", sa.Double(), comment="Standard error, m"),
        sa.Column("centre_up", sa.Double(), comment="How far its centre lies above the given axis, m"),
        sa.Column("centre_up_se", sa.Double(), comment="Standard error, m"),
        sa.Column("radius", sa.Double(), comment="Mean radius, m"),
        sa.Column("radius_se", sa.Double(), comment="Standard error, m"),
        sa.Column("diameter_largest", sa.Double(), comment="Largest diameter of the ellipse, m"),
        sa.Column("diameter_largest_se", sa.Double(), comment="Standard error, m"),
        sa.Column("diameter_smallest", sa.Double(), comment="Smallest diameter of the ellipse, m"),
        sa.Column("diameter_smallest_se", sa.Double(), comment="Standard error, m"),
        sa.Column("largest_clock", sa.Double(), comment="Clock position of the largest diameter, degrees"),
        sa.Column("largest_clock_se", sa.Double(), comment="Standard error, degrees"),
        sa.Column("ovality", sa.Double(), comment="Largest less smallest diameter over the design diameter"),
        sa.Column("ovality_se", sa.Double(), comment="Standard error"),
        sa.Column("design_diameter", sa.Double(), comment="Diameter that ovality is a share of, m"),
        sa.Column("diameter_from", sa.Text(), comment="Where that is from: option, profile, or ring: its own mean"),
        sa.Column("harmonic", ARRAY(sa.REAL()), comment="Amplitudes of the radius by order, from 2, m; NaN untold"),
        sa.Column("harmonic_se", ARRAY(sa.REAL()), comment="Their standard errors, m"),
        sa.Column("harmonic_clock", ARRAY(sa.REAL()), comment="First clock position where each is outwards most, degrees"),
        sa.Column("inward", sa.Double(), comment="Least departure from the circle of the mean radius, m, negative inside"),
        sa.Column("inward_se", sa.Double(), comment="Standard error, m"),
        sa.Column("inward_clock", sa.Double(), comment="Its clock position, degrees"),
        sa.Column("outward", sa.Double(), comment="Greatest departure from that circle, m"),
        sa.Column("outward_se", sa.Double(), comment="Standard error, m"),
        sa.Column("outward_clock", sa.Double(), comment="Its clock position, degrees"),
        sa.Column("sigma", sa.Double(), comment="Scatter of cells about what was fitted, m"),
        sa.Column(
            "step", ARRAY(sa.REAL()),
            comment="Steps from the ring before to this one in cells of arc, m, positive where this one stands in; NaN untold",
        ),
        sa.Column("step_se", ARRAY(sa.REAL()), comment="Their standard errors, m"),
        sa.Column("step_arc", ARRAY(sa.REAL()), comment="Arcs of the cells' middles, m"),
        sa.Column("step_greatest", sa.Double(), comment="Greatest step either way, m, with its sign"),
        sa.Column("step_greatest_se", sa.Double(), comment="Standard error, m"),
        sa.Column("step_greatest_arc", sa.Double(), comment="Arc of its place, m"),
        sa.Column(
            "lip", sa.Double(),
            comment="Greatest step within the ring, between segments, m, positive where what follows clockwise stands in",
        ),
        sa.Column("lip_se", sa.Double(), comment="Standard error, m"),
        sa.Column("lip_arc", sa.Double(), comment="Arc of its place, m"),
        sa.Column("remark", sa.Text(), comment="What is to be known of it"),
        sa.PrimaryKeyConstraint("id", name=op.f("ring_pkey")),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f("ring_survey_id_fkey"), ondelete="CASCADE"),
        sa.UniqueConstraint("survey_id", "number", name=op.f("ring_survey_id_number_key")),
        sa.CheckConstraint("chainage_from < chainage_to", name=op.f("ring_chainage_check")),
        sa.CheckConstraint("diameter_from IN ('option', 'profile', 'ring')", name=op.f("ring_diameter_from_check")),
        sa.CheckConstraint("joint IN ('given', 'seen', 'missing')", name=op.f("ring_joint_check")),
        sa.CheckConstraint("origin IN ('length', 'file', 'found')", name=op.f("ring_origin_check")),
        sa.CheckConstraint("shape IN ('ellipse', 'circle', 'none')", name=op.f("ring_shape_check")),
        schema="tunnel",
        comment="Rings of the lining of a survey; what is measured of one is NULL until it is, or where it cannot be told",
    )  # fmt: skip
    op.create_index(op.f("ring_survey_id_chainage_from_idx"), "ring", ["survey_id", "chainage_from"], schema="tunnel")
    op.create_index(op.f("ring_survey_id_ovality_idx"), "ring", ["survey_id", "ovality"], schema="tunnel")


def _ring_chord() -> None:
    op.create_table(
        "ring_chord",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("ring_id", sa.BigInteger(), nullable=False, comment="Ring that the chord is of"),
        sa.Column(
            "clock_from", sa.Double(), nullable=False,
            comment="Clock position of its one end, degrees from the crown to the right",
        ),
        sa.Column("clock_to", sa.Double(), nullable=False, comment="Clock position of its other end, degrees"),
        sa.Column("length", sa.Double(), comment="Length, m; NULL where an end is not seen"),
        sa.Column("length_se", sa.Double(), comment="Standard error, m"),
        sa.PrimaryKeyConstraint("id", name=op.f("ring_chord_pkey")),
        sa.ForeignKeyConstraint(["ring_id"], ["tunnel.ring.id"], name=op.f("ring_chord_ring_id_fkey"), ondelete="CASCADE"),
        sa.UniqueConstraint("ring_id", "clock_from", "clock_to", name=op.f("ring_chord_ring_id_clock_from_clock_to_key")),
        schema="tunnel",
        comment="Chords of rings between clock positions; convergence is how they change between surveys",
    )  # fmt: skip
