"""Axis, segments and sections."""

from __future__ import annotations

import datetime as dt

from geoalchemy2 import WKBElement
from sqlalchemy import BigInteger, CheckConstraint, Identity, Index, SmallInteger, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import KM, SURVEY, Base, Floats, finite, geometry, one_of, parent


class AxisVertex(Base):
    """Vertex of the averaged axis."""

    __tablename__ = "axis_vertex"
    __table_args__ = (
        UniqueConstraint("survey_id", "n"),
        one_of("source", "measured", "interpolated", "edited"),
        finite("geom"),
        finite("given"),
        Index(None, "geom", postgresql_using="gist"),
        {"comment": "Axis of a survey: vertex n stands at chainage n * spacing of the given axis"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    n: Mapped[int] = mapped_column(comment="Number along the axis; its chainage is n * tunnel.spacing")
    km: Mapped[int] = mapped_column(comment=KM)
    geom: Mapped[WKBElement] = mapped_column(geometry("POINTZ"), comment="Position, tunnel's SRID, m")
    given: Mapped[WKBElement] = mapped_column(
        geometry("POINTZ"), comment="Position on the given axis at this chainage, tunnel's SRID, m"
    )
    points: Mapped[int] = mapped_column(comment="Points that were averaged; 0 unless measured")
    source: Mapped[str] = mapped_column(
        comment="measured (averaged), interpolated (too few points) or edited (by hand, kept by a rerun)"
    )
    remark: Mapped[str | None] = mapped_column(comment="Why the place that was measured is not taken, if it is not")
    edited_by: Mapped[str | None] = mapped_column(comment="Role that moved it")
    edited_at: Mapped[dt.datetime | None] = mapped_column(comment="Time of the last move")


class Segment(Base):
    """Part of the tunnel between two vertices."""

    __tablename__ = "segment"
    __table_args__ = (
        UniqueConstraint("survey_id", "n"),
        Index(None, "geom", postgresql_using="gist"),
        Index(None, "survey_id", "chainage_from"),
        {"comment": "The tunnel between the planes at two consecutive vertices of the axis"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    n: Mapped[int] = mapped_column(comment="Number of its first vertex")
    km: Mapped[int] = mapped_column(comment=KM)
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of its beginning, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage of its end, m")
    vertex_from: Mapped[Floats] = mapped_column(comment="First vertex: x, y, z, m")
    vertex_to: Mapped[Floats] = mapped_column(comment="Last vertex: x, y, z, m")
    tangent_from: Mapped[Floats] = mapped_column(comment="Unit tangent of the axis at the first vertex")
    tangent_to: Mapped[Floats] = mapped_column(comment="Unit tangent of the axis at the last vertex")
    geom: Mapped[WKBElement] = mapped_column(
        geometry("LINESTRINGZ"), comment="Axis from the first vertex to the last, tunnel's SRID, m"
    )
    points: Mapped[int] = mapped_column(BigInteger, comment="Points that lie in it")


class Section(Base):
    """Cross-section."""

    __tablename__ = "section"
    __table_args__ = (
        UniqueConstraint("survey_id", "segment", "half"),
        Index(None, "survey_id", "chainage"),
        CheckConstraint("half IN (25, 75)", name="half"),
        {"comment": "Cross-sections at 25 % and 75 % of each segment, from angular classes"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    segment: Mapped[int] = mapped_column(comment="Number of its segment (segment.n)")
    half: Mapped[int] = mapped_column(SmallInteger, comment="Position in the segment: 25 or 75 %")
    chainage: Mapped[float] = mapped_column(comment="Chainage of its plane, m")
    half_width: Mapped[float] = mapped_column(comment="Half the thickness of the slab that its points are from, m")
    angle_step: Mapped[float] = mapped_column(comment="Width of an angular class, degrees")
    radius: Mapped[Floats] = mapped_column(
        comment="Distance of the surface from the axis at each whole degree from -180 to 180, m"
    )
    arc: Mapped[Floats] = mapped_column(
        comment="Arc from the crown at each whole degree, m, positive right looking up-chainage"
    )
    geom: Mapped[WKBElement] = mapped_column(
        geometry("LINESTRINGZ"), comment="The section as a line in space, tunnel's SRID, m"
    )
    points: Mapped[int] = mapped_column(comment="Points that it was made from")
    interpolated: Mapped[int] = mapped_column(comment="Classes that are not measured: empty or rejected")


class SectionClass(Base):
    """Angular class of a section."""

    __tablename__ = "section_class"
    __table_args__ = (
        one_of("state", "measured", "rejected", "interpolated"),
        {"comment": "Angular classes of a section, with two-sigma rejection (Gonçalves et al. 2012)"},
    )

    section_id: Mapped[int] = mapped_column(
        BigInteger, parent("section"), primary_key=True, comment="Section that it belongs to"
    )
    class_: Mapped[int] = mapped_column(
        "class", primary_key=True, autoincrement=False, comment="Number of the class, from the lowest angle"
    )
    angle: Mapped[float] = mapped_column(comment="Angle from the crown, degrees, positive right")
    radius: Mapped[float] = mapped_column(comment="Distance of the surface from the axis at the angle, m")
    slope: Mapped[float | None] = mapped_column(
        comment="Inclination of the line through its points: outwards per metre to the right; none if empty"
    )
    sigma: Mapped[float | None] = mapped_column(comment="Standard deviation of its points from the line, m; none if empty")
    points: Mapped[int] = mapped_column(comment="Points that it keeps")
    state: Mapped[str] = mapped_column(
        comment="measured, rejected (an outlier among its neighbours) or interpolated (too few points)"
    )
