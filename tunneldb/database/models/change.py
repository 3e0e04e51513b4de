"""Changes between two surveys of a tunnel; rows belong to the later survey, and are deleted with either."""

from __future__ import annotations

from geoalchemy2 import WKBElement
from sqlalchemy import BigInteger, CheckConstraint, Computed, Identity, Index, UniqueConstraint
from sqlalchemy.dialects.postgresql import ARRAY
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import KM, SURVEY, Base, Reals, geometry, one_of, parent

OLD = "Survey that it is compared with"
STATES = ("new", "grown", "shrunk", "same", "dry", "kind", "unseen")
"""Results of the comparison of leaks."""


class ChangeSection(Base):
    """Movement of a section of lining as a whole, and its remaining change."""

    __tablename__ = "change_section"
    __table_args__ = (
        UniqueConstraint("survey_id", "old_survey_id", "chainage_from"),
        Index(None, "survey_id", "old_survey_id", "shift"),
        Index(
            "change_section_sums_idx",
            "survey_id",
            "old_survey_id",
            "chainage_from",
            postgresql_include=["chainage_to", "seen_old", "seen_both", "shift"],
        ),
        Index(None, "old_survey_id"),
        {"comment": "Rigid motion of sections of lining between two surveys, and what remains of their change without it"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    old_survey_id: Mapped[int] = mapped_column(parent("survey"), comment=OLD)
    km: Mapped[int] = mapped_column(comment=KM)
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of its beginning, of the older survey, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage of its end, m")
    seen_old: Mapped[float] = mapped_column(comment="Lining that the older survey saw, m²")
    seen_new: Mapped[float] = mapped_column(comment="Lining that the newer survey saw, m²")
    seen_both: Mapped[float] = mapped_column(comment="Lining that both saw: what was compared, m²")
    shift: Mapped[float | None] = mapped_column(
        Computed("sqrt(shift_right * shift_right + shift_up * shift_up)", persisted=True),
        comment="Shift at right angles to the axis, m",
    )
    shift_right: Mapped[float | None] = mapped_column(comment="Shift of the whole to the right, m; NULL: not determined")
    shift_right_se: Mapped[float | None] = mapped_column(comment="Standard error of shift_right, m")
    shift_up: Mapped[float | None] = mapped_column(comment="Shift up, m; NULL: not determined")
    shift_up_se: Mapped[float | None] = mapped_column(comment="Standard error of shift_up, m")
    shift_along: Mapped[float | None] = mapped_column(comment="Shift up-chainage, m; NULL: not determined")
    shift_along_se: Mapped[float | None] = mapped_column(comment="Standard error of shift_along, m")
    roll: Mapped[float | None] = mapped_column(comment="Turn about the axis, rad; NULL: not determined")
    roll_se: Mapped[float | None] = mapped_column(comment="Standard error of roll, rad")
    yaw: Mapped[float | None] = mapped_column(comment="Turn about the upward direction, rad; NULL: not determined")
    yaw_se: Mapped[float | None] = mapped_column(comment="Standard error of yaw, rad")
    pitch: Mapped[float | None] = mapped_column(comment="Turn about the direction to the right, rad; NULL: not determined")
    pitch_se: Mapped[float | None] = mapped_column(comment="Standard error of pitch, rad")
    change_rms: Mapped[float | None] = mapped_column(
        comment="Root mean square of what remains beyond noise, m; NULL where nothing was compared"
    )
    change_least: Mapped[float | None] = mapped_column(comment="Least mean of a window of 3 by 3 cells, m: greatest outwards")
    change_greatest: Mapped[float | None] = mapped_column(comment="Greatest mean of a window, m: greatest inwards")
    lod: Mapped[float | None] = mapped_column(comment="Median level of detection of its cells, 95 %, m")
    cell: Mapped[float] = mapped_column(comment="Side of a cell, m")
    arc_from: Mapped[float] = mapped_column(comment="Arc at which the first of change begins, m")
    change: Mapped[Reals] = mapped_column(
        comment="Mean remaining change of each cell along the arc over the section's length, m, positive inwards; "
        "NaN: not inspected"
    )


class ChangeImage(Base):
    """Cells of a kilometre as an image."""

    __tablename__ = "change_image"
    __table_args__ = (
        one_of("kind", "change", "lod"),
        Index(None, "old_survey_id"),
        {"comment": "Change of the lining between two surveys by cells, as GeoTIFF in the unrolled plane of the older one"},
    )

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    old_survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=OLD)
    km: Mapped[int] = mapped_column(primary_key=True, comment=KM)
    kind: Mapped[str] = mapped_column(
        primary_key=True, comment="change (what remains without the rigid motion, positive inwards) or lod, m"
    )
    tiff: Mapped[bytes] = mapped_column(comment="GeoTIFF: x is the chainage, y the arc, of the older survey, m")


class ChangeRegion(Base):
    """Area of lining with a significant change."""

    __tablename__ = "change_region"
    __table_args__ = (
        Index(None, "survey_id", "old_survey_id", "chainage_from"),
        Index(None, "old_survey_id"),
        Index(None, "unrolled", postgresql_using="gist"),
        Index(None, "map", postgresql_using="gist"),
        {"comment": "Regions of lining that changed significantly between two surveys"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    old_survey_id: Mapped[int] = mapped_column(parent("survey"), comment=OLD)
    km: Mapped[int] = mapped_column(comment=KM)
    chainage_from: Mapped[float] = mapped_column(comment="Least chainage, of the older survey, m")
    chainage_to: Mapped[float] = mapped_column(comment="Greatest chainage, m")
    arc_from: Mapped[float] = mapped_column(comment="Least arc, m, positive right looking up-chainage")
    arc_to: Mapped[float] = mapped_column(comment="Greatest arc, m")
    clock: Mapped[float] = mapped_column(comment="Clock position of its middle, hours")
    area: Mapped[float] = mapped_column(comment="Area of its cells, m²")
    change_mean: Mapped[float] = mapped_column(comment="Mean change, positive inwards, m")
    lod: Mapped[float] = mapped_column(comment="Level of detection of the mean, 95 %, m")
    change_extreme: Mapped[float] = mapped_column(comment="Mean of the window of 3 by 3 cells that changed most, m")
    unrolled: Mapped[WKBElement] = mapped_column(
        geometry("POLYGON"), comment="In the unrolled plane (chainage, arc) of the older survey, m"
    )
    map: Mapped[WKBElement] = mapped_column(geometry("POLYGON"), comment="On the map strip beside the axis, tunnel's SRID, m")
    surface: Mapped[WKBElement] = mapped_column(geometry("POLYGONZ"), comment="On the lining in space, tunnel's SRID, m")


class LeakChange(Base):
    """Leaks at one place in both surveys."""

    __tablename__ = "leak_change"
    __table_args__ = (
        one_of("state", *STATES),
        CheckConstraint("cardinality(old_ids) + cardinality(new_ids) > 0", name="ids"),
        Index(None, "survey_id", "old_survey_id", "chainage_from", postgresql_include=["chainage_to", "area_old", "area_new"]),
        Index(None, "survey_id", "old_survey_id", "state"),
        Index(None, "old_survey_id"),
        Index(None, "old_ids", postgresql_using="gin"),
        Index(None, "unrolled", postgresql_using="gist"),
        Index(None, "map", postgresql_using="gist"),
        {"comment": "What became of leaks between two surveys: those that touch each other are one group"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    old_survey_id: Mapped[int] = mapped_column(parent("survey"), comment=OLD)
    km: Mapped[int] = mapped_column(comment=KM + " of its middle")
    state: Mapped[str] = mapped_column(
        comment="new, grown, shrunk, same, dry (again), kind (another in the newer survey), unseen (one survey "
        "inspected too little)"
    )
    old_ids: Mapped[list[int]] = mapped_column(ARRAY(BigInteger), comment="Findings of the older survey")
    new_ids: Mapped[list[int]] = mapped_column(ARRAY(BigInteger), comment="Findings of the newer survey")
    old_kinds: Mapped[list[str]] = mapped_column(comment="Their kinds")
    new_kinds: Mapped[list[str]] = mapped_column(comment="Their kinds")
    area_old: Mapped[float] = mapped_column(comment="Wet area in the older survey, m²")
    area_old_se: Mapped[float] = mapped_column(comment="Standard error of area_old from resolution and threshold, m²")
    area_new: Mapped[float] = mapped_column(comment="Wet area in the newer survey, m²")
    area_new_se: Mapped[float] = mapped_column(comment="Standard error of area_new from resolution and threshold, m²")
    seen_old: Mapped[float] = mapped_column(comment="Share of the place that the older survey saw, 0 to 1")
    seen_new: Mapped[float] = mapped_column(comment="Share of the place that the newer survey saw, 0 to 1")
    chainage_from: Mapped[float] = mapped_column(comment="Least chainage, of the older survey, m")
    chainage_to: Mapped[float] = mapped_column(comment="Greatest chainage, m")
    clock: Mapped[float] = mapped_column(comment="Clock position of its largest part, hours")
    unrolled: Mapped[WKBElement] = mapped_column(
        geometry("MULTIPOLYGON"), comment="Wet area in either survey, in the unrolled plane of the older survey, m"
    )
    map: Mapped[WKBElement] = mapped_column(
        geometry("MULTIPOLYGON"), comment="On the map strip beside the axis, tunnel's SRID, m"
    )
    surface: Mapped[WKBElement] = mapped_column(geometry("MULTIPOLYGONZ"), comment="On the lining in space, tunnel's SRID, m")
