"""Structures: members, their faces, and spots that differ from their own surface (Ono et al.)."""

from __future__ import annotations

from geoalchemy2 import WKBElement
from sqlalchemy import BigInteger, ForeignKey, Identity, Index, SmallInteger, Text, UniqueConstraint, text
from sqlalchemy.dialects.postgresql import ARRAY
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import SURVEY, Base, Floats, Review, at_most, geometry, one_of, parent


class Member(Base):
    """Beam, pipe or plate: connected faces."""

    __tablename__ = "member"
    __table_args__ = (
        one_of("kind", "flat", "pipe", "profile"),
        UniqueConstraint("survey_id", "number"),
        {"comment": "Members of structures: faces that belong together, joined where others hide them"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    number: Mapped[int] = mapped_column(comment="Number in the survey, from 1; dimension member in written files")
    kind: Mapped[str] = mapped_column(
        comment="flat (planes that lie in one), pipe (cylinders about one axis) or profile (sides of one beam)"
    )
    length: Mapped[float] = mapped_column(comment="Length along its line, gaps counted, m")
    area: Mapped[float] = mapped_column(comment="Area of its faces, m²")
    bimodal: Mapped[bool] = mapped_column(
        comment="True if the reference surface is unknown, because too much of the surface differs"
    )
    chainage: Mapped[float | None] = mapped_column(comment="Chainage of its middle, m; NULL of a site or beyond the sections")
    line: Mapped[WKBElement] = mapped_column(
        geometry("LINESTRINGZ"), comment="Middle line, tunnel's SRID, m; for a flat member, along its longest side"
    )


class Face(Base):
    """Plane or cylinder of a member."""

    __tablename__ = "face"
    __table_args__ = (
        one_of("kind", "flat", "pipe"),
        UniqueConstraint("survey_id", "number"),
        Index(None, "member_id"),
        Index(None, "surface", postgresql_using="gist"),
        {"comment": "Faces of members: planes and cylinders grown in the scans' points"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    member_id: Mapped[int] = mapped_column(parent("member"), comment="Member that it belongs to")
    number: Mapped[int] = mapped_column(comment="Number in the survey, from 1; dimension face in written files")
    side: Mapped[int] = mapped_column(comment="Side of its member, from 1: faces of one plane or pipe are of one side")
    kind: Mapped[str] = mapped_column(comment="flat (a plane) or pipe (a part of a cylinder)")
    origin: Mapped[Floats] = mapped_column(comment="Origin of its unrolled coordinates, on the axis of a pipe: x, y, z, m")
    axis: Mapped[Floats] = mapped_column(comment="Axis of a pipe; of a plane its normal, towards the scanners")
    across: Mapped[Floats] = mapped_column(
        comment="Direction at right angles to it from which unrolled coordinates count: u of a plane, v = 0 of a pipe"
    )
    radius: Mapped[float | None] = mapped_column(comment="Radius of a pipe, m; NULL of a plane")
    inside: Mapped[bool] = mapped_column(comment="True if a pipe was scanned from inside")
    rms: Mapped[float] = mapped_column(comment="Root mean square of its points' distances from it, m")
    points: Mapped[int] = mapped_column(BigInteger, comment="Points of the scans on it")
    area: Mapped[float] = mapped_column(comment="Area within its outline, m²")
    seen_share: Mapped[float] = mapped_column(comment="Share of it that could be judged, 0 to 1")
    incidence_from: Mapped[float | None] = mapped_column(comment="Least angle of incidence at which it was judged, degrees")
    incidence_to: Mapped[float | None] = mapped_column(comment="Greatest angle of incidence at which it was judged, degrees")
    level: Mapped[float | None] = mapped_column(comment="Intensity of its own surface, dB; NULL if it could not be determined")
    sigma: Mapped[float | None] = mapped_column(comment="Standard deviation about it, dB")
    bimodal: Mapped[bool] = mapped_column(
        comment="True if more than half of the inspected part differs, so that the reference surface is unknown"
    )
    chainage: Mapped[float | None] = mapped_column(comment="Chainage of its middle, m; NULL of a site or beyond the sections")
    outline: Mapped[WKBElement] = mapped_column(geometry("MULTIPOLYGON"), comment="In its own plane, of a cylinder unrolled, m")
    surface: Mapped[WKBElement] = mapped_column(geometry("MULTIPOLYGONZ"), comment="In space, tunnel's SRID, m")


class Spot(Review, Base):
    """Area that differs from its own surface."""

    __tablename__ = "spot"
    __table_args__ = (
        one_of("kind", "dark", "bright"),
        one_of("review", "open", "confirmed", "rejected"),
        at_most("remark", 10000),
        Index(None, "survey_id", "number"),
        Index(None, "face_id"),
        Index(None, "map", postgresql_using="gist"),
        {"comment": "Spots that are darker or brighter than their own surface, in three geometries"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    number: Mapped[int] = mapped_column(comment="Number in the tunnel or site, the same in the next survey")
    face_id: Mapped[int | None] = mapped_column(
        ForeignKey(Face.id, ondelete="SET NULL"), comment="Face that it is on; NULL where the last run found it no more"
    )
    kind: Mapped[str] = mapped_column(comment="dark or bright, against its own surface")
    reasons: Mapped[list[str]] = mapped_column(ARRAY(Text), server_default=text("'{}'"), comment="Evidence for and against it")
    confidence: Mapped[float] = mapped_column(comment="Confidence that it differs and is none of an edge or of noise, 0 to 1")
    contrast: Mapped[float] = mapped_column(comment="Mean difference from its surface in standard deviations of it")
    difference: Mapped[float] = mapped_column(comment="Mean difference from its surface, dB")
    area: Mapped[float] = mapped_column(comment="Area on its face, m²")
    points: Mapped[int] = mapped_column(BigInteger, comment="Points of the scans on it")
    scans: Mapped[int] = mapped_column(comment="Scans that saw it")
    rgb: Mapped[list[int] | None] = mapped_column(
        ARRAY(SmallInteger), comment="Mean colour of its points: red, green, blue, 0 to 255; NULL where they have none"
    )
    chainage: Mapped[float | None] = mapped_column(comment="Chainage of its middle, m; NULL of a site or beyond the sections")
    outline: Mapped[WKBElement] = mapped_column(geometry("POLYGON"), comment="In its face's own plane, m")
    map: Mapped[WKBElement] = mapped_column(geometry("POLYGON"), comment="On the map, m; what stands upright is 2 cm wide")
    surface: Mapped[WKBElement] = mapped_column(geometry("POLYGONZ"), comment="In space, tunnel's SRID, m")
