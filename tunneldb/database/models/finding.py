"""Findings: detected and drawn, their kinds, severities, photos and sums, and the regions that they are merged from."""

from __future__ import annotations

import datetime as dt
from typing import Any

from geoalchemy2 import WKBElement
from sqlalchemy import BigInteger, CheckConstraint, Computed, ForeignKey, Identity, Index, Integer, SmallInteger, Text, text
from sqlalchemy.dialects.postgresql import ARRAY
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import CLOCK, KM, SURVEY, Base, Floats, Review, at_most, bounded, geometry, one_of, parent
from tunneldb.database.models.leak import Region

_SUMMED = ["kind", "kind_override", "review", "detected", "area", "wet", "superseded"]
"""Columns that sums over findings need: they come from an index alone."""


class FindingKind(Base):
    """Kind of finding."""

    __tablename__ = "finding_kind"
    __table_args__ = (
        CheckConstraint("code ~ '^[a-z][a-z0-9_]{0,62}$'", name="code"),
        at_most("label", 200),
        CheckConstraint("geometries <@ '{polygon,line,point}' AND cardinality(geometries) BETWEEN 1 AND 3", name="geometries"),
        CheckConstraint("(code <> 'leak' OR wet) AND (code NOT IN ('joint', 'dark') OR NOT wet)", name="wet"),
        {"comment": "Kinds of findings, which an owner extends; those of detection are leak, joint and dark"},
    )

    id: Mapped[int] = mapped_column(Identity(), unique=True, comment="Key")
    code: Mapped[str] = mapped_column(primary_key=True, comment="Code, in lower case")
    label: Mapped[str] = mapped_column(comment="Name, in the owner's words")
    geometries: Mapped[list[str]] = mapped_column(ARRAY(Text), comment="Permitted geometries: polygon, line, point")
    wet: Mapped[bool] = mapped_column(
        server_default=text("false"), comment="True if findings of this kind count as wet in statistics and classes"
    )
    position: Mapped[int] = mapped_column(comment="Position in lists")
    active: Mapped[bool] = mapped_column(
        server_default=text("true"), comment="True if new findings can be drawn with this kind"
    )


class Severity(Base):
    """Degree of severity."""

    __tablename__ = "severity"
    __table_args__ = (
        CheckConstraint("id BETWEEN 1 AND 4", name="id"),
        at_most("label", 200),
        at_most("text", 1000),
        {"comment": "Words for the degrees of severity, which an owner changes to his own"},
    )

    id: Mapped[int] = mapped_column(SmallInteger, primary_key=True, autoincrement=False, comment="1, the least, to 4")
    label: Mapped[str] = mapped_column(comment="Name, in the owner's words")
    text: Mapped[str | None] = mapped_column(comment="Meaning")


class FindingSum(Base):
    """Change of the sums of findings by a change of findings."""

    __tablename__ = "finding_sum"
    __table_args__ = (
        Index(None, "survey_id"),
        {
            "comment": "What each change of findings adds to their numbers, areas and lengths: the sums of the rows are those "
            "of all findings. Rows are put together now and then"
        },
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    kind: Mapped[str] = mapped_column(comment="Kind, as judged")
    wet: Mapped[bool] = mapped_column(comment="True if they count as wet")
    origin: Mapped[str] = mapped_column(comment="Origin of their outlines")
    severity: Mapped[int | None] = mapped_column(SmallInteger, comment="Severity")
    state: Mapped[str] = mapped_column(comment="open or confirmed, which count, rejected, gone, dry, same or merged")
    measured: Mapped[bool] = mapped_column(comment="True if they were measured on the image")
    findings: Mapped[int] = mapped_column(BigInteger, comment="By how many they became more")
    area: Mapped[float] = mapped_column(comment="By how much their area grew, m²")
    length: Mapped[float] = mapped_column(comment="By how much the length of lines grew, m")
    extent: Mapped[float] = mapped_column(comment="The same, with what is no line as long as along the tunnel, m")


class FeatureList(Base):
    """Order of features."""

    __tablename__ = "feature_list"
    __table_args__ = {"comment": "In which order the features of findings are stored: versions of the program differ"}  # noqa: RUF012

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    names: Mapped[list[str]] = mapped_column(
        ARRAY(Text), unique=True, comment="Their names; outline: how much the outline tells, 0 to 1"
    )


class Finding(Review, Base):
    """Finding: a leak, a joint, a dry dark area, or what people drew."""

    __tablename__ = "finding"
    __table_args__ = (
        one_of("review", "open", "confirmed", "rejected"),
        one_of("origin", "detected", "drawn", "redrawn", "split", "merged"),
        CheckConstraint("width_mm > 0 AND width_mm <= 10000", name="width_mm"),
        bounded("place", "chainage_from", "chainage_to", "arc_from", "arc_to"),
        bounded("size", "area", "length", least=0),
        bounded("clock", "clock", least=0, most=12),
        at_most("remark", 10000),
        CheckConstraint("merged_into <> id AND same_as <> id", name="other"),
        Index(None, "survey_id", "km", postgresql_include=[*_SUMMED, "darkening_max"]),
        Index(None, "survey_id", "chainage_from", "chainage_to", postgresql_include=["id", *_SUMMED]),
        Index("finding_length_idx", "survey_id", text("(chainage_to - chainage_from)")),
        Index(None, "survey_id", "area"),
        Index(None, "survey_id", "created_at"),
        Index("finding_gone_idx", "survey_id", postgresql_where=text("NOT detected")),
        Index("finding_kind_idx", "survey_id", text("COALESCE(kind_override, kind)")),
        Index(None, "survey_id", "severity", postgresql_where=text("severity IS NOT NULL")),
        Index(
            "finding_uncounted_idx",
            "survey_id",
            postgresql_where=text("NOT (detected AND review <> 'rejected' AND NOT superseded)"),
            postgresql_include=[
                "id",
                "kind",
                "kind_override",
                "severity",
                "review",
                "detected",
                "superseded",
                "merged_into",
                "same_as",
                "dry_region_id",
            ],
        ),
        Index("finding_manual_idx", "survey_id", "chainage_from", postgresql_where=text("origin <> 'detected'")),
        Index(None, "feature_list_id"),
        Index("finding_kind_key_idx", "kind"),
        Index(None, "kind_override"),
        Index(None, "severity"),
        Index(None, "merged_into"),
        Index(None, "same_as", postgresql_where=text("same_as IS NOT NULL")),
        Index(None, "parent_id"),
        Index(None, "dry_region_id"),
        Index(None, "unrolled", postgresql_using="gist"),
        Index(None, "map", postgresql_using="gist"),
        {"comment": "Findings: leaks, joints and dry dark areas that were detected, and what people drew, in three geometries"},
    )

    id: Mapped[int] = mapped_column(
        BigInteger, Identity(always=True), primary_key=True, comment="Number by which lists, sheets, reports and QGIS name it"
    )
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
        comment="Kind that detection gave: leak, joint or dark (dry dark area); of what was drawn, the kind it was drawn as",
    )
    reasons: Mapped[list[str]] = mapped_column(
        ARRAY(Text), server_default=text("'{}'"), comment="Why, such as thin, straight, gradual, rectangular, recess"
    )
    confidence: Mapped[float | None] = mapped_column(comment="Confidence that it is of this kind, 0 to 1")
    contrast: Mapped[float | None] = mapped_column(
        comment="Mean darkening in standard deviations of the surrounding dry lining"
    )
    kind_override: Mapped[str | None] = mapped_column(
        ForeignKey(FindingKind.code), comment="Kind that an inspector gave instead"
    )
    area: Mapped[float] = mapped_column(comment="Area on the surface, m²; of a line length times width, of a point 0")
    darkening_mean: Mapped[float | None] = mapped_column(
        comment="Mean darkening, dB: how much darker than dry lining it is; NULL until measured"
    )
    darkening_max: Mapped[float | None] = mapped_column(comment="Greatest darkening, dB; NULL until measured")
    image_share: Mapped[float | None] = mapped_column(
        comment="Share of its pixels that hold measured data, 0 to 1; none until measured"
    )
    unrolled: Mapped[WKBElement] = mapped_column(geometry("POLYGON"), comment="In the unrolled plane (chainage, arc), m")
    map: Mapped[WKBElement] = mapped_column(geometry("POLYGON"), comment="On the map strip beside the axis, tunnel's SRID, m")
    surface: Mapped[WKBElement] = mapped_column(geometry("POLYGONZ"), comment="On the lining in space, tunnel's SRID, m")
    feature_list_id: Mapped[int | None] = mapped_column(
        ForeignKey(FeatureList.id), comment="Order of its features; none from before they were stored"
    )
    features: Mapped[Floats | None] = mapped_column(comment="Measured properties; NaN if one could not be measured")
    evidence: Mapped[dict[str, Any] | None] = mapped_column(
        comment="Contribution of each reason to the logarithm of the odds of a leak"
    )
    model: Mapped[str | None] = mapped_column(comment="Version of the model of evidence that classified it")
    origin: Mapped[str] = mapped_column(
        server_default=text("'detected'"),
        comment="Origin of its outline: detected, drawn, redrawn, split or merged; detection changes detected outlines only",
    )
    manual: Mapped[bool] = mapped_column(
        server_default=text("false"), comment="True if it was drawn, or split off from what was drawn: never detected"
    )
    severity: Mapped[int | None] = mapped_column(SmallInteger, ForeignKey(Severity.id), comment="Severity, 1 to 4")
    width_mm: Mapped[float | None] = mapped_column(comment="Width of a line, such as a crack, mm")
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
    drawn_by: Mapped[str | None] = mapped_column(comment="Role that drew its outline last; NULL if it was detected only")
    drawn_at: Mapped[dt.datetime | None] = mapped_column(comment="Time of the last drawing of its outline")
    parent_id: Mapped[int | None] = mapped_column(
        ForeignKey("tunnel.finding.id", ondelete="SET NULL"), comment="Finding that it was split off"
    )
    merged_into: Mapped[int | None] = mapped_column(
        ForeignKey("tunnel.finding.id", ondelete="SET NULL"), comment="Finding that it is merged into: that one counts"
    )
    same_as: Mapped[int | None] = mapped_column(
        ForeignKey("tunnel.finding.id", ondelete="SET NULL"), comment="Finding that is the same: that one counts"
    )
    dry_region_id: Mapped[int | None] = mapped_column(
        ForeignKey(Region.id, ondelete="SET NULL"), comment="Dry region that it lies in: it does not count while it is open"
    )
    wet: Mapped[bool] = mapped_column(
        server_default=text("true"), comment="True if its kind counts as wet: kept by the database, from finding_kind"
    )
    superseded: Mapped[bool] = mapped_column(
        Computed(
            "merged_into IS NOT NULL OR same_as IS NOT NULL OR (dry_region_id IS NOT NULL AND review = 'open')", persisted=True
        ),
        comment="True if another finding or a dry region takes its place",
    )


class CrackSearch(Base):
    """Part of the lining that was searched for cracks."""

    __tablename__ = "crack_search"
    __table_args__ = (
        CheckConstraint("char_length(source) BETWEEN 1 AND 1000", name="source"),
        Index(None, "survey_id"),
        {
            "comment": "Parts of the lining that a person or a network searched for cracks: only there, no crack means that "
            "there is none"
        },
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    area: Mapped[WKBElement] = mapped_column(geometry("MULTIPOLYGON"), comment="In the unrolled plane (chainage, arc), m")
    source: Mapped[str] = mapped_column(comment="What was searched, such as the name of a file")
    recorded_by: Mapped[str] = mapped_column(server_default=text("SESSION_USER"), comment="Role that recorded it")
    recorded_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time when it was recorded")


class Photo(Base):
    """Photo of a finding."""

    __tablename__ = "photo"
    __table_args__ = (
        CheckConstraint("path <> ''", name="path"),
        at_most("path", 2000),
        at_most("caption", 1000),
        Index(None, "finding_id"),
        {"comment": "Photos of findings, by path or URL"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    finding_id: Mapped[int] = mapped_column(parent("finding"), comment="Finding that it shows")
    path: Mapped[str] = mapped_column(comment="Path or URL")
    caption: Mapped[str | None] = mapped_column(comment="Caption")
    added_by: Mapped[str] = mapped_column(server_default=text("SESSION_USER"), comment="Role that added it")
    added_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time when it was added")


class PhotoFile(Base):
    """Photo that is stored in the database."""

    __tablename__ = "photo_file"
    __table_args__ = (
        CheckConstraint("name = encode(sha256(content), 'hex') || '.jpg'", name="name"),
        CheckConstraint("octet_length(content) <= 30000000", name="content"),
        {"comment": "Photos that are stored in the database, each once in a survey"},
    )

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    name: Mapped[str] = mapped_column(
        primary_key=True, comment="SHA-256 of the content in hexadecimal digits, and .jpg: the path of photos that show it"
    )
    content: Mapped[bytes] = mapped_column(comment="The photo as JPEG")
    added_by: Mapped[str] = mapped_column(server_default=text("SESSION_USER"), comment="Role that added it first")
    added_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time when it was added first")


class BoundaryRegion(Base):
    """Dark region that reaches an end of its kilometre."""

    __tablename__ = "boundary_region"
    __table_args__ = (
        Index(None, "survey_id", "km"),
        Index(None, "finding_id"),
        {"comment": "Dark regions that reach an end of their kilometre; findings across kilometres are merged from them"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    pixel: Mapped[float] = mapped_column(comment="Edge of a pixel, m")
    box: Mapped[list[int]] = mapped_column(
        ARRAY(Integer), comment="First column (chainage / pixel), first row (arc / pixel), columns and rows of the mask"
    )
    mask: Mapped[bytes] = mapped_column(comment="Dark pixels, one bit each, row by row from the smallest arc")
    filled: Mapped[int] = mapped_column(BigInteger, comment="Number of pixels with measured data")
    darkening_sum: Mapped[float] = mapped_column(comment="Sum over them of the darkening, dB")
    darkening_max: Mapped[float] = mapped_column(comment="Greatest darkening, dB")
    properties: Mapped[Floats] = mapped_column(
        server_default=text("'{}'"), comment="Sums over its pixels: RegionProperties of tunneldb/anomalies/regions.py"
    )
    finding_id: Mapped[int | None] = mapped_column(
        ForeignKey(Finding.id, ondelete="SET NULL"), comment="Finding that it is a part of, if it is large enough"
    )
