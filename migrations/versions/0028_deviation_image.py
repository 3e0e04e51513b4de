"""Images of deviation, thickness between two surveys, and evenness beneath a straightedge.

Revision: 0028, after 0027.
"""

import sqlalchemy as sa
from alembic import op
from geoalchemy2 import Geometry
from sqlalchemy.dialects.postgresql import ARRAY

revision = "0028"
down_revision = "0027"
branch_labels = None
depends_on = None

LAYER = "layer IN ('lining', 'shotcrete', 'excavation')"


def upgrade() -> None:
    _image()
    _thickness()
    _evenness()
    op.alter_column(
        "run", "stage", schema="tunnel", existing_type=sa.Text(), existing_nullable=False,
        comment="read, load, axis, segments, sections, ground, detect; spheres, members, deviation, clearance, rings, compare, "
        "thickness, evenness",
        existing_comment="read, load, axis, segments, sections, ground, detect; spheres, members, deviation, clearance, rings, "
        "compare",
    )  # fmt: skip


def _image() -> None:
    op.drop_constraint(op.f("image_kind_check"), "image", schema="tunnel")
    op.create_check_constraint(
        op.f("image_kind_check"), "image",
        "kind IN ('raw', 'corrected', 'offset', 'state', 'deviation_lining', 'deviation_shotcrete', 'deviation_excavation')",
        schema="tunnel",
    )  # fmt: skip
    op.alter_column(
        "image", "kind", schema="tunnel",
        comment="raw or corrected intensity, dB, offset from the surface, m, state of the pixel, or deviation from the design "
        "profiles of a layer, m",
    )  # fmt: skip


def _thickness() -> None:
    op.create_table(
        "thickness_section",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Later survey"),
        sa.Column("before_id", sa.Integer(), nullable=False, comment="Earlier survey"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("layer", sa.Text(), nullable=False, comment="Layer whose profiles both were held against"),
        *(
            sa.Column(name, sa.Double(), nullable=False, comment=said)
            for name, said in (
                ("chainage_from", "Chainage of its beginning, m"),
                ("chainage_to", "Chainage of its end, m"),
                ("design_length", "Length of the profile in its middle, m"),
                ("compared_length", "What of that both surveys saw, m"),
                ("area", "Area between the two surfaces, of what both saw, m²"),
                ("noise_area", "Standard deviation of the area by the scatter of pixels, m²"),
                ("by_right", "By how much the area grows when the later survey moves to the right, m²/m"),
                ("by_up", "By how much the area grows when the later survey moves up, m²/m"),
            )
        ),
        *(
            sa.Column(name, sa.Double(), comment=said)
            for name, said in (
                ("thickness_mean", "Mean of the cells that both saw, m; NULL without any"),
                ("thickness_least", "Least of a cell, m"),
                ("least_at", "How far along the profile that is, m"),
            )
        ),
        sa.Column(
            "thickness", ARRAY(sa.REAL()), nullable=False,
            comment="In cells of equal length along the profile, from its beginning, m; NaN where either saw nothing",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("thickness_section_pkey")),
        *(
            sa.ForeignKeyConstraint(
                [column], ["tunnel.survey.id"], name=op.f(f"thickness_section_{column}_fkey"), ondelete="CASCADE"
            )
            for column in ("survey_id", "before_id")
        ),
        sa.UniqueConstraint(
            "survey_id", "before_id", "layer", "chainage_from",
            name=op.f("thickness_section_survey_id_before_id_layer_chainage_from_key"),
        ),
        sa.CheckConstraint(LAYER, name=op.f("thickness_section_layer_check")),
        schema="tunnel",
        comment="What lies between the linings of two surveys, along normals of a layer's profiles, in steps of chainage",
    )  # fmt: skip
    op.create_index(op.f("thickness_section_before_id_idx"), "thickness_section", ["before_id"], schema="tunnel")
    op.create_index(
        op.f("thickness_section_survey_id_thickness_least_idx"), "thickness_section", ["survey_id", "thickness_least"],
        schema="tunnel",
    )  # fmt: skip


def _evenness() -> None:
    op.create_table(
        "evenness_section",
        *_of_survey(),
        *(
            sa.Column(name, sa.Double(), nullable=False, comment=said)
            for name, said in (
                ("straightedge", "Length of the straightedge, m"),
                ("gap_limit", "Limit of the gap beneath it, m"),
                ("chainage_from", "Chainage of its beginning, m"),
                ("chainage_to", "Chainage of its end, m"),
                ("arc_from", "Arc of the first cell's edge, m"),
                ("cell", "Side of a cell, m"),
                ("lining_area", "Lining that was seen, m²"),
                ("measured_area", "What of that lay beneath a straightedge, along or around, m²"),
                ("over_area", "What of that has a greater gap than the limit, m²"),
            )
        ),
        *(
            sa.Column(name, sa.Double(), comment=said)
            for name, said in (
                ("gap_along", "Greatest gap beneath a straightedge laid along the tunnel, m; NULL where none could be laid"),
                ("gap_along_at", "Arc of that, m"),
                ("gap_around", "Greatest gap beneath one laid around the section, m; NULL where none could be laid"),
                ("gap_around_at", "Arc of that, m"),
                ("waviness", "Greatest depth of a hollow over the distance to its nearer rim; NULL where there is none"),
                ("sigma", "Standard deviation of a cell's mean by the scatter of pixels, m"),
            )
        ),
        *(
            sa.Column(
                name, ARRAY(sa.REAL()), nullable=False,
                comment=f"Greatest gap beneath a straightedge laid {name}, by cells of arc, m; NaN where none could be laid",
            )
            for name in ("along", "around")
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("evenness_section_pkey")),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("evenness_section_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.UniqueConstraint(
            "survey_id", "layer", "chainage_from", name=op.f("evenness_section_survey_id_layer_chainage_from_key")
        ),
        sa.CheckConstraint(LAYER, name=op.f("evenness_section_layer_check")),
        schema="tunnel",
        comment="Gaps beneath a straightedge on the lining, the curvature of the design taken out, in steps of chainage",
    )  # fmt: skip
    op.create_table(
        "evenness_area",
        *_of_survey(),
        sa.Column("area", sa.Double(), nullable=False, comment="Its area, m²"),
        sa.Column("gap", sa.Double(), nullable=False, comment="Greatest gap in it, m"),
        sa.Column("direction", sa.Text(), nullable=False, comment="along or around: how the straightedge lay"),
        sa.Column(
            "geom", Geometry("POLYGON", srid=-1, spatial_index=False), nullable=False, comment="In the unrolled plane, m"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("evenness_area_pkey")),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("evenness_area_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.CheckConstraint(LAYER, name=op.f("evenness_area_layer_check")),
        sa.CheckConstraint("direction IN ('along', 'around')", name=op.f("evenness_area_direction_check")),
        schema="tunnel",
        comment="Where the gap beneath a straightedge is greater than the limit; cut by the ends of kilometres",
    )
    for column in ("km", "gap"):
        op.create_index(
            op.f(f"evenness_area_survey_id_layer_{column}_idx"), "evenness_area", ["survey_id", "layer", column],
            schema="tunnel",
        )  # fmt: skip


def _of_survey() -> list[sa.Column]:
    return [
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("layer", sa.Text(), nullable=False, comment="Layer whose profiles are the template"),
    ]
