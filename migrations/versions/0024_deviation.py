"""Design profiles, and how far linings deviate from them.

Revision: 0024, after 0023.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import ARRAY

revision = "0024"
down_revision = "0023"
branch_labels = None
depends_on = None

LAYER = "layer IN ('lining', 'shotcrete', 'excavation')"


def upgrade() -> None:
    _design_profile()
    _deviation_section()
    op.alter_column(
        "run", "stage", schema="tunnel", existing_type=sa.Text(), existing_nullable=False,
        comment="read, load, axis, segments, sections, ground, detect; spheres, members, deviation",
        existing_comment="read, load, axis, segments, sections, ground, detect; spheres, members",
    )  # fmt: skip


def _design_profile() -> None:
    op.create_table(
        "design_profile",
        sa.Column("id", sa.Integer(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("tunnel_id", sa.Integer(), nullable=False, comment="Tunnel that the row belongs to"),
        sa.Column("name", sa.Text(), nullable=False, comment="Its name"),
        sa.Column("layer", sa.Text(), nullable=False, comment="lining, shotcrete or excavation"),
        sa.Column(
            "chainage_from", sa.Double(), nullable=False, comment="Chainage of the given axis from which it holds, m"
        ),
        sa.Column("chainage_to", sa.Double(), nullable=False, comment="Chainage up to which it holds, m"),
        sa.Column(
            "outline", ARRAY(sa.Double()), nullable=False,
            comment="Of each vertex: right of the axis, above it, m, and bulge of what leads to the next; clockwise looking "
            "up-chainage, closed where the last vertex is the first",
        ),
        sa.Column("source", sa.Text(), nullable=False, comment="File that it was read from"),
        sa.Column(
            "added_at", sa.DateTime(timezone=True), server_default=sa.text("clock_timestamp()"), nullable=False,
            comment="When it was added",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("design_profile_pkey")),
        sa.ForeignKeyConstraint(
            ["tunnel_id"], ["tunnel.tunnel.id"], name=op.f("design_profile_tunnel_id_fkey"), ondelete="CASCADE"
        ),
        sa.UniqueConstraint("tunnel_id", "layer", "name", name=op.f("design_profile_tunnel_id_layer_name_key")),
        sa.CheckConstraint(LAYER, name=op.f("design_profile_layer_check")),
        sa.CheckConstraint("chainage_from < chainage_to", name=op.f("design_profile_chainage_check")),
        sa.CheckConstraint(
            "cardinality(outline) >= 6 AND cardinality(outline) % 3 = 0", name=op.f("design_profile_outline_check")
        ),
        schema="tunnel",
        comment="Design profiles of a tunnel, by layer; between two of a layer the one goes over into the other linearly",
    )  # fmt: skip


def _deviation_section() -> None:
    op.create_table(
        "deviation_section",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("layer", sa.Text(), nullable=False, comment="Layer of the profile: lining, shotcrete or excavation"),
        sa.Column("profile", sa.Text(), nullable=False, comment="Name of the profile, of a transition both"),
        *(
            sa.Column(name, sa.Double(), nullable=False, comment=said)
            for name, said in (
                ("chainage_from", "Chainage of its beginning, m"),
                ("chainage_to", "Chainage of its end, m"),
                ("design_length", "Length of the profile in its middle, m"),
                ("seen_length", "What of that is seen, m"),
                ("overbreak", "Area outside the profile, of what is seen, m²"),
                ("underbreak", "Area inside the profile, of what is seen, m²"),
                ("noise_area", "Standard deviation of underbreak less overbreak by the scatter of pixels, m²"),
                ("over_right", "By how much overbreak grows when the axis moves to the right, m²/m"),
                ("over_up", "By how much overbreak grows when the axis moves up, m²/m"),
                ("under_right", "By how much underbreak grows when the axis moves to the right, m²/m"),
                ("under_up", "By how much underbreak grows when the axis moves up, m²/m"),
            )
        ),
        sa.Column(
            "sigma", sa.Double(),
            comment="Scatter of pixels within cells: noise, and the lining's texture, m; NULL where nothing is seen",
        ),
        sa.Column(
            "shift_right", sa.Double(),
            comment="How far the lining as a whole lies right of the profile, m; NULL where too little is seen",
        ),
        sa.Column("shift_up", sa.Double(), comment="How far it lies above it, m"),
        *(
            sa.Column(name, sa.Double(), comment=said)
            for name, said in (
                ("deviation_mean", "Mean deviation of the cells seen, m; NULL where nothing is seen"),
                ("deviation_least", "Least mean of a cell, m: the greatest overbreak"),
                ("least_at", "How far along the profile that is, m"),
                ("deviation_greatest", "Greatest mean of a cell, m: the greatest underbreak"),
                ("greatest_at", "How far along the profile that is, m"),
            )
        ),
        sa.Column(
            "deviation", ARRAY(sa.REAL()), nullable=False,
            comment="Mean deviation in cells of equal length along the profile, from its beginning, m, positive inside; NaN "
            "unseen",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("deviation_section_pkey")),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("deviation_section_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.UniqueConstraint(
            "survey_id", "layer", "chainage_from", name=op.f("deviation_section_survey_id_layer_chainage_from_key")
        ),
        sa.CheckConstraint(LAYER, name=op.f("deviation_section_layer_check")),
        schema="tunnel",
        comment="Deviation of the lining from its design profile, in steps of chainage and of length along the profile",
    )  # fmt: skip
    for column in ("overbreak", "underbreak"):
        op.create_index(
            op.f(f"deviation_section_survey_id_layer_{column}_idx"), "deviation_section", ["survey_id", "layer", column],
            schema="tunnel",
        )  # fmt: skip
