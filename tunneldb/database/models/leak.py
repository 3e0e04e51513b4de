"""Intensity, images, inspected lining, and models adapted to reviews."""

from __future__ import annotations

import datetime as dt
from typing import Any

from geoalchemy2 import WKBElement
from sqlalchemy import BigInteger, CheckConstraint, Computed, Identity, Index, Text, text
from sqlalchemy.dialects.postgresql import ARRAY
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import CLOCK, KM, NOW, SURVEY, Base, Floats, Reals, at_most, geometry, one_of, parent


class Radiometry(Base):
    """Correction of the intensity of a kilometre."""

    __tablename__ = "radiometry"
    __table_args__ = {"comment": "Correction of the intensity, per kilometre (Xu et al. 2018)"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=KM)
    roughness: Mapped[float | None] = mapped_column(comment="Oren-Nayar roughness, degrees")
    dry_mean: Mapped[float | None] = mapped_column(comment="Mean corrected intensity of dry lining, dB")
    dry_sigma: Mapped[float | None] = mapped_column(comment="Standard deviation of the dry lining, dB")
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
    seen: Mapped[Reals] = mapped_column(comment="Inspected part of it, within the limits of range and incidence, m²")
    wet: Mapped[Reals] = mapped_column(
        comment="Wet part of the inspected lining (pixels below the threshold, after the median filter), m²"
    )
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


class DarkBand(Base):
    """Dark band along the tunnel; detection does not decide whether it is wet."""

    __tablename__ = "dark_band"
    __table_args__ = (
        Index(None, "survey_id", "chainage_from"),
        {"comment": "Dark bands along the tunnel that are part of the background, in pieces: wet or dirty is not decided"},
    )

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=KM)
    n: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment="Number in the kilometre, from 0")
    chainage_from: Mapped[float] = mapped_column(comment="Beginning, m")
    chainage_to: Mapped[float] = mapped_column(comment="End, m")
    arc_from: Mapped[float] = mapped_column(comment="Least arc, m, positive right looking up-chainage")
    arc_to: Mapped[float] = mapped_column(comment="Greatest arc, m")
    darkening: Mapped[float] = mapped_column(comment="Mean difference from the brightest lining beside it, dB")
    area: Mapped[float] = mapped_column(comment="Lining in it that was seen, m²")


class Detectability(Base):
    """Leaks that detection would find in a block of the inspected lining."""

    __tablename__ = "detectability"
    __table_args__ = (
        Index(None, "survey_id", "km"),
        {"comment": "Leaks that detection would find, by blocks of the inspected lining; written by stage detect"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    chainage_from: Mapped[float] = mapped_column(comment="Beginning of the block's inspected lining, m")
    chainage_to: Mapped[float] = mapped_column(comment="End of it, m")
    arc_from: Mapped[float] = mapped_column(comment="Smallest arc of it, m, from the crown, positive right")
    arc_to: Mapped[float] = mapped_column(comment="Greatest arc of it, m")
    lining_area: Mapped[float] = mapped_column(comment="Inspected lining, m²")
    trials: Mapped[int] = mapped_column(comment="Synthetic leaks in the kilometre from which this is estimated")
    demand_area: Mapped[float] = mapped_column(comment="Area of the leaks that must be found (leak.demand_area), m²")
    demand_drop: Mapped[float] = mapped_column(comment="Darkening of these leaks (leak.demand_drop), dB")
    probability: Mapped[float | None] = mapped_column(
        comment="Probability that such a leak is found if it lies anywhere in the block; NULL: unknown"
    )
    smallest_1_5_db: Mapped[float | None] = mapped_column(
        comment="Area of the smallest leak of 1.5 dB found with 90 % probability, m², at least 0.05; NULL: none up to 3 m² is, "
        "or unknown"
    )
    smallest_3_db: Mapped[float | None] = mapped_column(comment="The same for leaks of 3 dB, m²")
    smallest_6_db: Mapped[float | None] = mapped_column(comment="The same for leaks of 6 dB, m²")


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
        comment="Beginning of the stretch, m; NULL in a row that marks a change"
    )
    chainage_to: Mapped[float | None] = mapped_column(comment="End of the stretch, m")
    lining_area: Mapped[float | None] = mapped_column(comment="Lining, seen or not, m²")
    seen_share: Mapped[float | None] = mapped_column(comment="Share of it that was seen")
    wet_area: Mapped[float | None] = mapped_column(comment="Area of the leaks within the kilometre, m²")
    wet_ratio: Mapped[float | None] = mapped_column(comment="wet_area as a share of the inspected lining")
    patches: Mapped[int | None] = mapped_column(comment="Leaks in the kilometre or over its ends")
    largest_area: Mapped[float | None] = mapped_column(comment="Area of the largest of them, whole, m²")
    largest_leak: Mapped[int | None] = mapped_column(BigInteger, comment="Id of the largest leak")
    window_patches: Mapped[int | None] = mapped_column(comment="Most leaks in any 100 m² of lining")
    window_from: Mapped[float | None] = mapped_column(comment="Chainage at which those 100 m² begin, m")
    window_to: Mapped[float | None] = mapped_column(comment="Chainage at which those 100 m² end, m")
    window_wet_area: Mapped[float | None] = mapped_column(comment="Greatest wet area in any 100 m² of lining, m²")
    class_: Mapped[int | None] = mapped_column(
        "class", comment="Best class of waterproofing whose limits the inspected lining meets"
    )
    undecided_area: Mapped[float | None] = mapped_column(comment="Dark bands that may be wet or dirty, m²")
    class_if_wet: Mapped[int | None] = mapped_column(comment="Best class if those bands are wet")


class Region(Base):
    """Region drawn by the user."""

    __tablename__ = "region"
    __table_args__ = (
        one_of("kind", "homogeneous", "dry"),
        at_most("reason", 10000),
        Index(None, "geom", postgresql_using="gist"),
        Index(None, "survey_id"),
        {"comment": "Regions of the lining that the user has drawn, to be used in place of automatic ones"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    kind: Mapped[str] = mapped_column(comment="homogeneous (one material, for the roughness) or dry (for the threshold)")
    geom: Mapped[WKBElement] = mapped_column(geometry("POLYGON"), comment="Region in the unrolled plane (chainage, arc), m")
    drawn_by: Mapped[str] = mapped_column(server_default=text("CURRENT_USER"), comment="Role that drew it")
    drawn_at: Mapped[dt.datetime] = mapped_column(server_default=NOW, comment="Time of the drawing")
    reason: Mapped[str | None] = mapped_column(comment="Why; a dry region larger than the tunnel's limit needs one")
    pending_approval: Mapped[bool] = mapped_column(
        server_default=text("false"),
        comment="True if it waits for the approval of an operator, being larger than the tunnel's limit; until then "
        "it has no effect",
    )
    approved_by: Mapped[str | None] = mapped_column(comment="Operator who put it in force, where it had to wait")
    approved_at: Mapped[dt.datetime | None] = mapped_column(comment="When")


class Image(Base):
    """Block of an unrolled image."""

    __tablename__ = "image"
    __table_args__ = (
        CheckConstraint(
            "kind ~ '^(overview_)?(raw|corrected|offset|rgb|state|deviation_lining|deviation_shotcrete|deviation_excavation"
            "|imported_[a-z0-9][a-z0-9-]{0,39})$'",
            name="kind",
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
        comment="raw or corrected intensity, dB, offset from the surface, m, colour (rgb), state of the pixel, or deviation "
        "from the design profiles of a layer, m; imported_NAME: an image of another instrument (tunnel.imported_image); "
        "overview_KIND: the same of a whole kilometre, with pixels of about 0.4 m",
    )
    block: Mapped[int] = mapped_column(
        primary_key=True,
        autoincrement=False,
        comment="Block along the tunnel: floor(chainage / 50); of an overview the first of its kilometre",
    )
    tiff: Mapped[bytes] = mapped_column(comment="GeoTIFF in the unrolled plane (chainage, arc), m")


class SegmentationNetwork(Base):
    """Segmentation network that an owner trained."""

    __tablename__ = "segmentation_network"
    __table_args__ = {  # noqa: RUF012
        "comment": "Segmentation networks that owners trained (tunneldb run --set detect.model=FILE.onnx)"
    }

    id: Mapped[int] = mapped_column(
        primary_key=True, autoincrement=False, comment="Key, the value of detect.model: the first 31 bits of the checksum"
    )
    version: Mapped[str] = mapped_column(comment="Name of the network")
    checksum: Mapped[str] = mapped_column(unique=True, comment="SHA-256 of the file")
    model: Mapped[bytes] = mapped_column(comment="The file (ONNX)")
    added_by: Mapped[str] = mapped_column(server_default=text("session_user"), comment="Role that added it")
    added_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time when it was added")


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
    reviews: Mapped[dict[str, Any]] = mapped_column(comment="Number of reviews of each kind")
    loss_base: Mapped[float] = mapped_column(
        comment="Mean negative logarithm of the probability of what was said, by the model that it adjusts"
    )
    loss: Mapped[float] = mapped_column(comment="The same, adjusted to reviews of other places")
    note: Mapped[str | None] = mapped_column(comment="Note of the person who applied it")
    applied_by: Mapped[str] = mapped_column(comment="Role that applied it")
    active_from: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Since when it is in force")
    undone_by: Mapped[str | None] = mapped_column(comment="Role that undid it")
    undone_at: Mapped[dt.datetime | None] = mapped_column(comment="Time when it was undone")
