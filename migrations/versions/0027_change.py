"""What changed between two surveys of a tunnel.

Revision: 0027, after 0026.
"""

import sqlalchemy as sa
from alembic import op
from geoalchemy2 import Geometry
from sqlalchemy.dialects.postgresql import ARRAY

revision = "0027"
down_revision = "0026"
branch_labels = None
depends_on = None


def upgrade() -> None:
    _change_section()
    _change_image()
    _change_region()
    _leak_change()
    op.alter_column(
        "run", "stage", schema="tunnel", existing_type=sa.Text(), existing_nullable=False,
        comment="read, load, axis, segments, sections, ground, detect; spheres, members, deviation, clearance, rings, compare",
        existing_comment="read, load, axis, segments, sections, ground, detect; spheres, members, deviation, clearance, rings",
    )  # fmt: skip


def _geometry(kind: str) -> Geometry:
    return Geometry(kind, spatial_index=False)


def _change_section() -> None:
    op.create_table(
        "change_section",
        sa.Column(
            "id",
            sa.BigInteger(),
            sa.Identity(always=True),
            nullable=False,
            comment="Key",
        ),
        sa.Column(
            "survey_id",
            sa.Integer(),
            nullable=False,
            comment="Survey that the row belongs to",
        ),
        sa.Column(
            "old_survey_id",
            sa.Integer(),
            nullable=False,
            comment="Survey that it is compared with",
        ),
        sa.Column(
            "km",
            sa.Integer(),
            nullable=False,
            comment="Kilometre: floor(chainage / 1000)",
        ),
        sa.Column(
            "chainage_from",
            sa.Double(),
            nullable=False,
            comment="Chainage of its beginning, of the older survey, m",
        ),
        sa.Column(
            "chainage_to",
            sa.Double(),
            nullable=False,
            comment="Chainage of its end, m",
        ),
        sa.Column(
            "seen_old",
            sa.Double(),
            nullable=False,
            comment="Lining that the older survey saw, m²",
        ),
        sa.Column(
            "seen_new",
            sa.Double(),
            nullable=False,
            comment="Lining that the newer survey saw, m²",
        ),
        sa.Column(
            "seen_both",
            sa.Double(),
            nullable=False,
            comment="Lining that both saw: what was compared, m²",
        ),
        sa.Column(
            "shift",
            sa.Double(),
            sa.Computed("sqrt(shift_right * shift_right + shift_up * shift_up)", persisted=True),
            nullable=True,
            comment="Shift at right angles to the axis, m",
        ),
        sa.Column(
            "shift_right",
            sa.Double(),
            nullable=True,
            comment="Shift of the whole to the right, m; NULL: not determined",
        ),
        sa.Column(
            "shift_right_se",
            sa.Double(),
            nullable=True,
            comment="Its standard error, m",
        ),
        sa.Column(
            "shift_up",
            sa.Double(),
            nullable=True,
            comment="Shift up, m; NULL: not determined",
        ),
        sa.Column(
            "shift_up_se",
            sa.Double(),
            nullable=True,
            comment="Its standard error, m",
        ),
        sa.Column(
            "shift_along",
            sa.Double(),
            nullable=True,
            comment="Shift up-chainage, m; NULL: not determined",
        ),
        sa.Column(
            "shift_along_se",
            sa.Double(),
            nullable=True,
            comment="Its standard error, m",
        ),
        sa.Column(
            "roll",
            sa.Double(),
            nullable=True,
            comment="Turn about the axis, rad; NULL: not determined",
        ),
        sa.Column(
            "roll_se",
            sa.Double(),
            nullable=True,
            comment="Its standard error, rad",
        ),
        sa.Column(
            "yaw",
            sa.Double(),
            nullable=True,
            comment="Turn about the upward direction, rad; NULL: not determined",
        ),
        sa.Column(
            "yaw_se",
            sa.Double(),
            nullable=True,
            comment="Its standard error, rad",
        ),
        sa.Column(
            "pitch",
            sa.Double(),
            nullable=True,
            comment="Turn about the direction to the right, rad; NULL: not determined",
        ),
        sa.Column(
            "pitch_se",
            sa.Double(),
            nullable=True,
            comment="Its standard error, rad",
        ),
        sa.Column(
            "change_rms",
            sa.Double(),
            nullable=True,
            comment="Root mean square of what remains beyond noise, m; NULL where nothing was compared",
        ),
        sa.Column(
            "change_least",
            sa.Double(),
            nullable=True,
            comment="Least mean of a window of 3 by 3 cells, m: greatest outwards",
        ),
        sa.Column(
            "change_greatest",
            sa.Double(),
            nullable=True,
            comment="Greatest mean of a window, m: greatest inwards",
        ),
        sa.Column(
            "lod",
            sa.Double(),
            nullable=True,
            comment="Median level of detection of its cells, 95 %, m",
        ),
        sa.Column(
            "cell",
            sa.Double(),
            nullable=False,
            comment="Side of a cell, m",
        ),
        sa.Column(
            "arc_from",
            sa.Double(),
            nullable=False,
            comment="Arc at which the first of change begins, m",
        ),
        sa.Column(
            "change",
            ARRAY(sa.REAL()),
            nullable=False,
            comment="Mean of what remains, of each cell along the arc over the section's length, m, positive "
            "inwards; NaN unseen",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("change_section_pkey")),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("change_section_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["old_survey_id"], ["tunnel.survey.id"], name=op.f("change_section_old_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.UniqueConstraint(
            "survey_id", "old_survey_id", "chainage_from", name=op.f("change_section_survey_id_old_survey_id_chainage_from_key")
        ),
        schema="tunnel",
        comment="Rigid motion of sections of lining between two surveys, and what remains of their change without it",
    )
    op.create_index(op.f("change_section_old_survey_id_idx"), "change_section", ["old_survey_id"], schema="tunnel")
    op.create_index(
        "change_section_sums_idx",
        "change_section",
        ["survey_id", "old_survey_id", "chainage_from"],
        schema="tunnel",
        postgresql_include=["chainage_to", "seen_old", "seen_both", "shift"],
    )
    op.create_index(
        op.f("change_section_survey_id_old_survey_id_shift_idx"),
        "change_section",
        ["survey_id", "old_survey_id", "shift"],
        schema="tunnel",
    )


def _change_image() -> None:
    op.create_table(
        "change_image",
        sa.Column(
            "survey_id",
            sa.Integer(),
            nullable=False,
            comment="Survey that the row belongs to",
        ),
        sa.Column(
            "old_survey_id",
            sa.Integer(),
            nullable=False,
            comment="Survey that it is compared with",
        ),
        sa.Column(
            "km",
            sa.Integer(),
            nullable=False,
            comment="Kilometre: floor(chainage / 1000)",
        ),
        sa.Column(
            "kind",
            sa.Text(),
            nullable=False,
            comment="change (what remains without the rigid motion, positive inwards) or lod, m",
        ),
        sa.Column(
            "tiff",
            sa.LargeBinary(),
            nullable=False,
            comment="GeoTIFF: x is the chainage, y the arc, of the older survey, m",
        ),
        sa.PrimaryKeyConstraint("survey_id", "old_survey_id", "km", "kind", name=op.f("change_image_pkey")),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("change_image_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["old_survey_id"], ["tunnel.survey.id"], name=op.f("change_image_old_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.CheckConstraint("kind IN ('change', 'lod')", name=op.f("change_image_kind_check")),
        schema="tunnel",
        comment="Change of the lining between two surveys by cells, as GeoTIFF in the unrolled plane of the older one",
    )
    op.create_index(op.f("change_image_old_survey_id_idx"), "change_image", ["old_survey_id"], schema="tunnel")


def _change_region() -> None:
    op.create_table(
        "change_region",
        sa.Column(
            "id",
            sa.BigInteger(),
            sa.Identity(always=True),
            nullable=False,
            comment="Key",
        ),
        sa.Column(
            "survey_id",
            sa.Integer(),
            nullable=False,
            comment="Survey that the row belongs to",
        ),
        sa.Column(
            "old_survey_id",
            sa.Integer(),
            nullable=False,
            comment="Survey that it is compared with",
        ),
        sa.Column(
            "km",
            sa.Integer(),
            nullable=False,
            comment="Kilometre: floor(chainage / 1000)",
        ),
        sa.Column(
            "chainage_from",
            sa.Double(),
            nullable=False,
            comment="Least chainage, of the older survey, m",
        ),
        sa.Column(
            "chainage_to",
            sa.Double(),
            nullable=False,
            comment="Greatest chainage, m",
        ),
        sa.Column(
            "arc_from",
            sa.Double(),
            nullable=False,
            comment="Least arc, m, positive right looking up-chainage",
        ),
        sa.Column(
            "arc_to",
            sa.Double(),
            nullable=False,
            comment="Greatest arc, m",
        ),
        sa.Column(
            "clock",
            sa.Double(),
            nullable=False,
            comment="Clock position of its middle, hours",
        ),
        sa.Column(
            "area",
            sa.Double(),
            nullable=False,
            comment="Area of its cells, m²",
        ),
        sa.Column(
            "change_mean",
            sa.Double(),
            nullable=False,
            comment="Mean change, positive inwards, m",
        ),
        sa.Column(
            "lod",
            sa.Double(),
            nullable=False,
            comment="Level of detection of the mean, 95 %, m",
        ),
        sa.Column(
            "change_extreme",
            sa.Double(),
            nullable=False,
            comment="Mean of the window of 3 by 3 cells that changed most, m",
        ),
        sa.Column(
            "unrolled",
            _geometry("POLYGON"),
            nullable=False,
            comment="In the unrolled plane (chainage, arc) of the older survey, m",
        ),
        sa.Column(
            "map",
            _geometry("POLYGON"),
            nullable=False,
            comment="On the map strip beside the axis, tunnel's SRID, m",
        ),
        sa.Column(
            "surface",
            _geometry("POLYGONZ"),
            nullable=False,
            comment="On the lining in space, tunnel's SRID, m",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("change_region_pkey")),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("change_region_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["old_survey_id"], ["tunnel.survey.id"], name=op.f("change_region_old_survey_id_fkey"), ondelete="CASCADE"
        ),
        schema="tunnel",
        comment="Regions of lining that changed significantly between two surveys",
    )
    op.create_index(op.f("change_region_map_idx"), "change_region", ["map"], schema="tunnel", postgresql_using="gist")
    op.create_index(op.f("change_region_old_survey_id_idx"), "change_region", ["old_survey_id"], schema="tunnel")
    op.create_index(
        op.f("change_region_survey_id_old_survey_id_chainage_from_idx"),
        "change_region",
        ["survey_id", "old_survey_id", "chainage_from"],
        schema="tunnel",
    )
    op.create_index(op.f("change_region_unrolled_idx"), "change_region", ["unrolled"], schema="tunnel", postgresql_using="gist")


def _leak_change() -> None:
    op.create_table(
        "leak_change",
        sa.Column(
            "id",
            sa.BigInteger(),
            sa.Identity(always=True),
            nullable=False,
            comment="Key",
        ),
        sa.Column(
            "survey_id",
            sa.Integer(),
            nullable=False,
            comment="Survey that the row belongs to",
        ),
        sa.Column(
            "old_survey_id",
            sa.Integer(),
            nullable=False,
            comment="Survey that it is compared with",
        ),
        sa.Column(
            "km",
            sa.Integer(),
            nullable=False,
            comment="Kilometre: floor(chainage / 1000) of its middle",
        ),
        sa.Column(
            "state",
            sa.Text(),
            nullable=False,
            comment="new, grown, shrunk, same, dry (again), kind (another in the newer survey), unseen (not "
            "told, for too little was seen by one of them)",
        ),
        sa.Column(
            "old_ids",
            ARRAY(sa.BigInteger()),
            nullable=False,
            comment="Findings of the older survey",
        ),
        sa.Column(
            "new_ids",
            ARRAY(sa.BigInteger()),
            nullable=False,
            comment="Findings of the newer survey",
        ),
        sa.Column(
            "old_kinds",
            ARRAY(sa.Text()),
            nullable=False,
            comment="Their kinds",
        ),
        sa.Column(
            "new_kinds",
            ARRAY(sa.Text()),
            nullable=False,
            comment="Their kinds",
        ),
        sa.Column(
            "area_old",
            sa.Double(),
            nullable=False,
            comment="Wet area in the older survey, m²",
        ),
        sa.Column(
            "area_old_se",
            sa.Double(),
            nullable=False,
            comment="Its standard error by resolution and threshold, m²",
        ),
        sa.Column(
            "area_new",
            sa.Double(),
            nullable=False,
            comment="Wet area in the newer survey, m²",
        ),
        sa.Column(
            "area_new_se",
            sa.Double(),
            nullable=False,
            comment="Its standard error by resolution and threshold, m²",
        ),
        sa.Column(
            "seen_old",
            sa.Double(),
            nullable=False,
            comment="Share of the place that the older survey saw, 0 to 1",
        ),
        sa.Column(
            "seen_new",
            sa.Double(),
            nullable=False,
            comment="Share of the place that the newer survey saw, 0 to 1",
        ),
        sa.Column(
            "chainage_from",
            sa.Double(),
            nullable=False,
            comment="Least chainage, of the older survey, m",
        ),
        sa.Column(
            "chainage_to",
            sa.Double(),
            nullable=False,
            comment="Greatest chainage, m",
        ),
        sa.Column(
            "clock",
            sa.Double(),
            nullable=False,
            comment="Clock position of its largest part, hours",
        ),
        sa.Column(
            "unrolled",
            _geometry("MULTIPOLYGON"),
            nullable=False,
            comment="What is wet in either, in the unrolled plane of the older survey, m",
        ),
        sa.Column(
            "map",
            _geometry("MULTIPOLYGON"),
            nullable=False,
            comment="On the map strip beside the axis, tunnel's SRID, m",
        ),
        sa.Column(
            "surface",
            _geometry("MULTIPOLYGONZ"),
            nullable=False,
            comment="On the lining in space, tunnel's SRID, m",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("leak_change_pkey")),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name=op.f("leak_change_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["old_survey_id"], ["tunnel.survey.id"], name=op.f("leak_change_old_survey_id_fkey"), ondelete="CASCADE"
        ),
        sa.CheckConstraint("cardinality(old_ids) + cardinality(new_ids) > 0", name=op.f("leak_change_ids_check")),
        sa.CheckConstraint(
            "state IN ('new', 'grown', 'shrunk', 'same', 'dry', 'kind', 'unseen')", name=op.f("leak_change_state_check")
        ),
        schema="tunnel",
        comment="What became of leaks between two surveys: those that touch each other are one group",
    )
    op.create_index(op.f("leak_change_map_idx"), "leak_change", ["map"], schema="tunnel", postgresql_using="gist")
    op.create_index(op.f("leak_change_old_survey_id_idx"), "leak_change", ["old_survey_id"], schema="tunnel")
    op.create_index(
        op.f("leak_change_survey_id_old_survey_id_chainage_from_idx"),
        "leak_change",
        ["survey_id", "old_survey_id", "chainage_from"],
        schema="tunnel",
        postgresql_include=["chainage_to", "area_old", "area_new"],
    )
    op.create_index(
        op.f("leak_change_survey_id_old_survey_id_state_idx"),
        "leak_change",
        ["survey_id", "old_survey_id", "state"],
        schema="tunnel",
    )
    op.create_index(op.f("leak_change_unrolled_idx"), "leak_change", ["unrolled"], schema="tunnel", postgresql_using="gist")
