"""Intensity, images and dark regions."""

from __future__ import annotations

import datetime as dt
from typing import Any

from geoalchemy2 import WKBElement
from sqlalchemy import BigInteger, CheckConstraint, Computed, ForeignKey, Identity, Index, Integer, SmallInteger, Text, text
from sqlalchemy.dialects.postgresql import ARRAY
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import CLOCK, KM, NOW, SURVEY, Base, Floats, Reals, Review, geometry, one_of, parent
from tunneldb.database.models.finding import FindingKind, Severity

_SUMMED = ["kind", "judged", "review", "detected", "area", "wet", "aside"]
"""Columns that sums over anomalies need: they come from an index alone."""


class Radiometry(Base):
    """Correction of the intensity of a kilometre."""

    __tablename__ = "radiometry"
    __table_args__ = {"comment": "Correction of the intensity, per kilometre (Xu et al. 2018)"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=KM)
    roughness: Mapped[float | None] = mapped_column(comment="Oren-Nayar roughness, degrees")
    dry_mean: Mapped[float | None] = mapped_column(comment="Mean corrected intensity of dry lining, dB")
    dry_sigma: Mapped[float | None] = mapped_column(comment="Its standard deviation, dB")
    threshold: Mapped[float | None] = mapped_column(comment="Corrected intensity below which lining is wet, dB")
    sigma_raw: Mapped[float | None] = mapped_column(comment="Standard deviation of dry lining before correction, dB")
    sigma_lambert: Mapped[float | None] = mapped_column(comment="The same, incidence by Lambert, dB")
    sigma_oren_nayar: Mapped[float | None] = mapped_column(comment="The same, incidence by Oren-Nayar, dB")
    regions: Mapped[int] = mapped_column(comment="Homogeneous regions that the roughness is from")
    pixels: Mapped[int] = mapped_column(BigInteger, comment="Pixels of the image that show lining")
    wet_pixels: Mapped[int] = mapped_column(BigInteger, comment="Lining pixels found wet, after the median filter")


class RangeCurve(Base):
    """Range curve of a kilometre, estimated from its lining."""

    __tablename__ = "range_curve"
    __table_args__ = {"comment": "Range curve found on the lining of a kilometre, of surveys whose reference is auto"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=KM)
    range_m: Mapped[Floats] = mapped_column(comment="Ranges, growing, m")
    intensity_db: Mapped[Floats] = mapped_column(comment="Intensity of dry lining at right angles there, dB")
    sigma_db: Mapped[Floats] = mapped_column(comment="Standard deviation of its shape, dB; NULL beyond the ranges seen")


class Coverage(Base):
    """Lining of a kilometre inspected by detection."""

    __tablename__ = "coverage"
    __table_args__ = {"comment": "Lining of a kilometre, what was seen of it and what is dark, by steps of chainage"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=KM)
    step: Mapped[float] = mapped_column(comment="Length of a step, m; the first begins with the kilometre")
    lining: Mapped[Reals] = mapped_column(comment="Lining in each step, seen or not, in the unrolled plane, m²")
    seen: Mapped[Reals] = mapped_column(comment="What of it was seen within the limits of range and incidence, m²")
    wet: Mapped[Reals] = mapped_column(comment="What of that is wet: pixels below the threshold, after the median filter, m²")
    lining_total: Mapped[float | None] = mapped_column(
        Computed("tunnel.total(lining)", persisted=True), comment="Sum of lining, m²"
    )
    seen_total: Mapped[float | None] = mapped_column(Computed("tunnel.total(seen)", persisted=True), comment="Sum of seen, m²")
    wet_total: Mapped[float | None] = mapped_column(Computed("tunnel.total(wet)", persisted=True), comment="Sum of wet, m²")
    lining_sums: Mapped[Floats | None] = mapped_column(
        Computed("tunnel.running_sums(lining)", persisted=True), comment="Sum of lining before each step, and of all, m²"
    )
    seen_sums: Mapped[Floats | None] = mapped_column(
        Computed("tunnel.running_sums(seen)", persisted=True), comment="Sum of seen before each step, and of all, m²"
    )
    wet_sums: Mapped[Floats | None] = mapped_column(
        Computed("tunnel.running_sums(wet)", persisted=True), comment="Sum of wet before each step, and of all, m²"
    )


class Waterproof(Base):
    """Cached waterproofing of a kilometre, or a note that something has changed there."""

    __tablename__ = "waterproof"
    __table_args__ = (
        Index(None, "survey_id", "km"),
        {
            "comment": "Statistics of waterproofing of kilometres, and notes that something changed there: the statistics hold "
            "while their row is the only one of its kilometre. Deleting rows may make others hold that do not: tunneldb init "
            "works all out anew"
        },
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    chainage_from: Mapped[float | None] = mapped_column(
        comment="Where its stretch begins, m; NULL in a row that notes a change"
    )
    chainage_to: Mapped[float | None] = mapped_column(comment="Where it ends, m")
    lining_area: Mapped[float | None] = mapped_column(comment="Lining, seen or not, m²")
    seen_share: Mapped[float | None] = mapped_column(comment="Share of it that was seen")
    wet_area: Mapped[float | None] = mapped_column(comment="Area of the leaks within the kilometre, m²")
    wet_ratio: Mapped[float | None] = mapped_column(comment="wet_area, of the lining seen")
    patches: Mapped[int | None] = mapped_column(comment="Leaks in the kilometre or over its ends")
    largest_area: Mapped[float | None] = mapped_column(comment="Area of the largest of them, whole, m²")
    largest_leak: Mapped[int | None] = mapped_column(BigInteger, comment="Its id")
    window_patches: Mapped[int | None] = mapped_column(comment="Most leaks in any 100 m² of lining")
    window_from: Mapped[float | None] = mapped_column(comment="Where those 100 m² begin, m")
    window_to: Mapped[float | None] = mapped_column(comment="Where they end, m")
    window_wet_area: Mapped[float | None] = mapped_column(comment="Greatest wet area in any 100 m² of lining, m²")
    class_: Mapped[int | None] = mapped_column("class", comment="Best class of waterproofing that the lining seen keeps")


class Region(Base):
    """Region drawn by the user."""

    __tablename__ = "region"
    __table_args__ = (
        one_of("kind", "homogeneous", "dry"),
        Index(None, "geom", postgresql_using="gist"),
        Index(None, "survey_id"),
        {"comment": "Regions of the lining that the user has drawn, to be used in place of automatic ones"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    kind: Mapped[str] = mapped_column(comment="homogeneous (one material, for the roughness) or dry (for the threshold)")
    geom: Mapped[WKBElement] = mapped_column(geometry("POLYGON"), comment="Region in the unrolled plane (chainage, arc), m")
    drawn_by: Mapped[str] = mapped_column(server_default=text("CURRENT_USER"), comment="Who drew it")
    drawn_at: Mapped[dt.datetime] = mapped_column(server_default=NOW, comment="When it was drawn")
    reason: Mapped[str | None] = mapped_column(comment="Why; a dry region larger than the tunnel's limit needs one")
    waits: Mapped[bool] = mapped_column(
        server_default=text("false"),
        comment="Whether it waits for an operator, being larger than the tunnel's limit: until then it marks nothing",
    )
    approved_by: Mapped[str | None] = mapped_column(comment="Operator who put it in force, where it had to wait")
    approved_at: Mapped[dt.datetime | None] = mapped_column(comment="When")


class Image(Base):
    """Block of an unrolled image."""

    __tablename__ = "image"
    __table_args__ = (
        one_of(
            "kind", "raw", "corrected", "offset", "state", "deviation_lining", "deviation_shotcrete", "deviation_excavation"
        ),
        {
            "comment": "Unrolled images in blocks of 50 m: partition image_s<survey>",
            "postgresql_partition_by": "LIST (survey_id)",
        },
    )

    survey_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=KM)
    kind: Mapped[str] = mapped_column(
        primary_key=True,
        comment="raw or corrected intensity, dB, offset from the surface, m, state of the pixel, or deviation from the design "
        "profiles of a layer, m",
    )
    block: Mapped[int] = mapped_column(
        primary_key=True, autoincrement=False, comment="Block along the tunnel: floor(chainage / 50)"
    )
    tiff: Mapped[bytes] = mapped_column(comment="GeoTIFF in the unrolled plane (chainage, arc), m")


class FeatureList(Base):
    """Order of features."""

    __tablename__ = "feature_list"
    __table_args__ = {"comment": "In which order the features of anomalies are stored: versions of the program differ"}  # noqa: RUF012

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    names: Mapped[list[str]] = mapped_column(
        ARRAY(Text), unique=True, comment="Their names; outline: how much the outline tells, 0 to 1"
    )


class Anomaly(Review, Base):
    """Leak, or dry dark area."""

    __tablename__ = "anomaly"
    __table_args__ = (
        one_of("review", "open", "confirmed", "rejected"),
        one_of("origin", "detected", "drawn", "redrawn", "split", "merged"),
        CheckConstraint("width > 0", name="width"),
        CheckConstraint("merged_into <> id AND same_as <> id", name="other"),
        Index(None, "survey_id", "km", postgresql_include=[*_SUMMED, "drop_max"]),
        Index(None, "survey_id", "chainage_from", "chainage_to", postgresql_include=["id", *_SUMMED]),
        Index("anomaly_length_idx", "survey_id", text("(chainage_to - chainage_from)")),
        Index(None, "survey_id", "area"),
        Index(None, "survey_id", "created_at"),
        Index("anomaly_gone_idx", "survey_id", postgresql_where=text("NOT detected")),
        Index("anomaly_kind_idx", "survey_id", text("COALESCE(judged, kind)")),
        Index(None, "survey_id", "severity", postgresql_where=text("severity IS NOT NULL")),
        Index(
            "anomaly_uncounted_idx",
            "survey_id",
            postgresql_where=text("NOT (detected AND review <> 'rejected' AND NOT aside)"),
            postgresql_include=[
                "id",
                "kind",
                "judged",
                "severity",
                "review",
                "detected",
                "aside",
                "merged_into",
                "same_as",
                "dry_region_id",
            ],
        ),
        Index("anomaly_by_hand_idx", "survey_id", "chainage_from", postgresql_where=text("origin <> 'detected'")),
        Index(None, "feature_list_id"),
        Index("anomaly_kind_key_idx", "kind"),
        Index(None, "judged"),
        Index(None, "severity"),
        Index(None, "merged_into"),
        Index(None, "same_as", postgresql_where=text("same_as IS NOT NULL")),
        Index(None, "parent_id"),
        Index(None, "dry_region_id"),
        Index(None, "unrolled", postgresql_using="gist"),
        Index(None, "map", postgresql_using="gist"),
        {"comment": "Findings: leaks, joints and dark spots that were detected, and what people drew, in three geometries"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM + " of its middle")
    chainage_from: Mapped[float] = mapped_column(comment="Least chainage, m")
    chainage_to: Mapped[float] = mapped_column(comment="Greatest chainage, m")
    arc_from: Mapped[float] = mapped_column(comment="Least arc, m, positive right looking up-chainage")
    arc_to: Mapped[float] = mapped_column(comment="Greatest arc, m, positive right looking up-chainage")
    clock: Mapped[float] = mapped_column(
        comment="Clock position of its middle, hours: 12 is the crown, 3 is right looking up-chainage"
    )
    kind: Mapped[str] = mapped_column(
        ForeignKey(FindingKind.code),
        server_default=text("'leak'"),
        comment="What detection takes it for: leak, joint or dark (dark but dry); of what was drawn, what it was drawn as",
    )
    reasons: Mapped[list[str]] = mapped_column(
        ARRAY(Text), server_default=text("'{}'"), comment="Why, such as thin, straight, gradual, rectangular, recess"
    )
    confidence: Mapped[float | None] = mapped_column(comment="Confidence that it is of its kind, 0 to 1; none from before")
    contrast: Mapped[float | None] = mapped_column(
        comment="Mean drop in standard deviations of the dry lining about it; none from before"
    )
    judged: Mapped[str | None] = mapped_column(
        ForeignKey(FindingKind.code), comment="What an inspector takes it for, where he says so"
    )
    area: Mapped[float] = mapped_column(comment="Area on the surface, m²; of a line length times width, of a point 0")
    drop_mean: Mapped[float | None] = mapped_column(comment="Mean drop below dry lining, dB; none until measured")
    drop_max: Mapped[float | None] = mapped_column(comment="Greatest drop below dry lining, dB; none until measured")
    image_share: Mapped[float | None] = mapped_column(
        comment="Share of its pixels that hold measured data, 0 to 1; none until measured"
    )
    unrolled: Mapped[WKBElement] = mapped_column(geometry("POLYGON"), comment="In the unrolled plane (chainage, arc), m")
    map: Mapped[WKBElement] = mapped_column(geometry("POLYGON"), comment="On the map strip beside the axis, tunnel's SRID, m")
    surface: Mapped[WKBElement] = mapped_column(geometry("POLYGONZ"), comment="On the lining in space, tunnel's SRID, m")
    feature_list_id: Mapped[int | None] = mapped_column(
        ForeignKey(FeatureList.id), comment="Order of its features; none from before they were stored"
    )
    features: Mapped[Floats | None] = mapped_column(comment="What was measured of it; NaN what could not be")
    evidence: Mapped[dict[str, Any] | None] = mapped_column(
        comment="What each reason adds to the logarithm of the odds that it is a leak"
    )
    model: Mapped[str | None] = mapped_column(comment="Version of the model of evidence that judged it")
    origin: Mapped[str] = mapped_column(
        server_default=text("'detected'"),
        comment="How its outline came about: detected, drawn, redrawn, split or merged; detection changes the first alone",
    )
    by_hand: Mapped[bool] = mapped_column(
        server_default=text("false"), comment="Whether it was drawn, or split off what was: never detected"
    )
    severity: Mapped[int | None] = mapped_column(SmallInteger, ForeignKey(Severity.id), comment="Severity, 1 to 4")
    width: Mapped[float | None] = mapped_column(comment="Width of a line, such as a crack, m")
    length: Mapped[float | None] = mapped_column(comment="Length of a line on the surface, m")
    shape: Mapped[WKBElement | None] = mapped_column(
        geometry("GEOMETRY"),
        comment="The line or point that it is, if it is no polygon, in the unrolled plane, m",
    )
    shape_map: Mapped[WKBElement | None] = mapped_column(
        geometry("GEOMETRY"), comment="The same on the map strip, tunnel's SRID, m"
    )
    shape_surface: Mapped[WKBElement | None] = mapped_column(
        geometry("GEOMETRYZ"), comment="The same in space, tunnel's SRID, m"
    )
    drawn_by: Mapped[str | None] = mapped_column(comment="Who drew its outline last; none of what was detected")
    drawn_at: Mapped[dt.datetime | None] = mapped_column(comment="When its outline was drawn last")
    parent_id: Mapped[int | None] = mapped_column(
        ForeignKey("tunnel.anomaly.id", ondelete="SET NULL"), comment="Finding that it was split off"
    )
    merged_into: Mapped[int | None] = mapped_column(
        ForeignKey("tunnel.anomaly.id", ondelete="SET NULL"), comment="Finding that it is merged into: that one counts"
    )
    same_as: Mapped[int | None] = mapped_column(
        ForeignKey("tunnel.anomaly.id", ondelete="SET NULL"), comment="Finding that is the same: that one counts"
    )
    dry_region_id: Mapped[int | None] = mapped_column(
        ForeignKey(Region.id, ondelete="SET NULL"), comment="Dry region that it lies in: it does not count while it is open"
    )
    wet: Mapped[bool] = mapped_column(
        server_default=text("true"), comment="Whether its kind counts as wet: kept by the database, from finding_kind"
    )
    aside: Mapped[bool] = mapped_column(
        Computed(
            "merged_into IS NOT NULL OR same_as IS NOT NULL OR (dry_region_id IS NOT NULL AND review = 'open')", persisted=True
        ),
        comment="Whether another stands for it, or a dry region takes it away",
    )


class LearnedModel(Base):
    """Model of evidence adapted to the reviews of a tunnel."""

    __tablename__ = "learned_model"
    __table_args__ = (
        one_of("way", "recalibrated", "refit", "extended"),
        Index(None, "tunnel_id"),
        {"comment": "What was learned of each tunnel from reviews; the last that was not undone is in force"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    tunnel_id: Mapped[int] = mapped_column(parent("tunnel"), comment="Tunnel whose surveys it is for")
    base: Mapped[str] = mapped_column(comment="Version of the model that it adjusts")
    way: Mapped[str] = mapped_column(
        comment="recalibrated (slope and offset of the logarithm of the odds), refit (a factor for each reason, and an offset) "
        "or extended (terms of features, too)"
    )
    parameters: Mapped[dict[str, Any]] = mapped_column(
        comment="Slope, offset, factors by reason; centre, scale and weight by feature"
    )
    surveys: Mapped[list[str]] = mapped_column(ARRAY(Text), comment="Surveys whose reviews it was learned from")
    reviews: Mapped[dict[str, Any]] = mapped_column(comment="How many reviews of each kind")
    loss_base: Mapped[float] = mapped_column(
        comment="Mean negative logarithm of the probability of what was said, by the model that it adjusts"
    )
    loss: Mapped[float] = mapped_column(comment="The same, adjusted to reviews of other places")
    note: Mapped[str | None] = mapped_column(comment="What its maker says of it")
    applied_by: Mapped[str] = mapped_column(comment="Who applied it")
    active_from: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Since when it is in force")
    undone_by: Mapped[str | None] = mapped_column(comment="Who took it back")
    undone_at: Mapped[dt.datetime | None] = mapped_column(comment="When it was taken back")


class AnomalyPart(Base):
    """Dark region cut by an end of its kilometre."""

    __tablename__ = "anomaly_part"
    __table_args__ = (
        Index(None, "survey_id", "km"),
        Index(None, "anomaly_id"),
        {"comment": "Dark regions cut by an end of their kilometre, from which anomalies over several are put together"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    pixel: Mapped[float] = mapped_column(comment="Edge of a pixel, m")
    box: Mapped[list[int]] = mapped_column(
        ARRAY(Integer), comment="First column (chainage / pixel), first row (arc / pixel), columns and rows of the mask"
    )
    mask: Mapped[bytes] = mapped_column(comment="Its dark pixels, a bit each, row by row from the lowest arc")
    filled: Mapped[int] = mapped_column(BigInteger, comment="Its pixels that hold measured data")
    drop_sum: Mapped[float] = mapped_column(comment="Sum over them of the drop below dry lining, dB")
    drop_max: Mapped[float] = mapped_column(comment="Greatest drop below dry lining, dB")
    traits: Mapped[Floats] = mapped_column(
        server_default=text("'{}'"), comment="Sums over its pixels by which it is told what it is, see Region in leak/region.py"
    )
    anomaly_id: Mapped[int | None] = mapped_column(
        ForeignKey(Anomaly.id, ondelete="SET NULL"), comment="Anomaly that it is a part of, if it is large enough"
    )
