"""Clearance outlines of tunnels, and distances of objects from them in surveys."""

from __future__ import annotations

import datetime as dt
from typing import Any

from sqlalchemy import BigInteger, Identity, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import CLOCK, KM, SURVEY, TUNNEL, Base, Floats, Reals, geometry, parent


class Gauge(Base):
    """Outline that must be clear around each track."""

    __tablename__ = "gauge"
    __table_args__ = (UniqueConstraint("tunnel_id", "name"), {"comment": "Outlines that are to be clear about tracks or lanes"})

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    tunnel_id: Mapped[int] = mapped_column(parent("tunnel"), comment=TUNNEL)
    name: Mapped[str] = mapped_column(comment="Name")
    outline: Mapped[Floats] = mapped_column(
        comment="Vertices: to the right of the track's centre, above its running surface, m, and bulge of the edge to"
        " the next vertex"
    )
    source: Mapped[str] = mapped_column(comment="File that it was read from")
    checksum: Mapped[str] = mapped_column(comment="MD5 of the outline")
    added_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time when it was added")


class ClearanceSection(Base):
    """Metre of a track compared with an outline."""

    __tablename__ = "clearance_section"
    __table_args__ = (
        UniqueConstraint("survey_id", "gauge", "track", "chainage_from"),
        Index(None, "survey_id", "gauge", "margin"),
        {"comment": "Least distance of what stands in the tunnel from an outline about a track, by metre"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    gauge: Mapped[str] = mapped_column(comment="Name of the outline")
    track: Mapped[str] = mapped_column(comment="single; left or right; of more than two their number from the left; given")
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of its beginning along the given axis, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage of its end, m")
    track_right: Mapped[float] = mapped_column(comment="Middle of the track right of the given axis, m")
    track_up: Mapped[float] = mapped_column(comment="Plane of the running surface there above the given axis, m")
    cant: Mapped[float] = mapped_column(comment="Height of the left rail above the right rail, m")
    curvature: Mapped[float] = mapped_column(comment="Curvature of the track in plan, positive to the right, 1/m")
    widened_left: Mapped[float] = mapped_column(comment="By how much the outline is wider on the left, without roll, m")
    widened_right: Mapped[float] = mapped_column(comment="By how much on the right, m")
    roll: Mapped[float] = mapped_column(comment="Roll of the vehicle, positive to the right, rad")
    margin: Mapped[float | None] = mapped_column(comment="Least distance, m, negative inside; NULL where nothing that counts")
    margin_se: Mapped[float | None] = mapped_column(comment="Standard error of the margin from the track only, m")
    clock: Mapped[float | None] = mapped_column(comment="Direction of that point, degrees from straight above to the right")
    class_: Mapped[int | None] = mapped_column("class", comment="Class of that point")
    cluster_id: Mapped[int | None] = mapped_column(BigInteger, comment="Cluster of stage ground that it lies in, if any")
    margins: Mapped[Reals] = mapped_column(comment="Least distance in each 5° by clock, from straight above, m; NaN: nothing")
    seen_share: Mapped[float] = mapped_column(comment="Share of the directions with a return of anything, 0 to 1")
    points: Mapped[int] = mapped_column(comment="Points that count")
    inside: Mapped[int] = mapped_column(comment="Number of these inside the gauge")
    stray: Mapped[int] = mapped_column(comment="Points inside without company, or noise: they do not count")
    passing: Mapped[int] = mapped_column(comment="Points inside of objects and spheres, which may be gone: they do not count")
    ground: Mapped[int] = mapped_column(comment="Points inside that are ground or rail: they do not count")
    outline: Mapped[Floats] = mapped_column(comment="The outline widened, as in gauge")
    geom: Mapped[Any | None] = mapped_column(geometry("PointZ"), comment="The point with the least distance")


class ClearanceInfringement(Base):
    """Group of points inside an outline."""

    __tablename__ = "clearance_infringement"
    __table_args__ = (
        Index(None, "survey_id", "gauge", "depth"),
        {"comment": "Groups of points inside an outline, in pieces of 10 m at most"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    gauge: Mapped[str] = mapped_column(comment="Name of the outline")
    track: Mapped[str] = mapped_column(comment="As of clearance_section")
    chainage_from: Mapped[float] = mapped_column(comment="First place along the given axis, m")
    chainage_to: Mapped[float] = mapped_column(comment="Last place, m")
    depth: Mapped[float] = mapped_column(comment="Greatest depth inside the gauge, m")
    clock: Mapped[float] = mapped_column(comment="Direction of its deepest point, degrees from straight above to the right")
    class_: Mapped[int] = mapped_column("class", comment="Class of its points")
    counts: Mapped[bool] = mapped_column(comment="False of objects and spheres, which may be gone")
    cluster_id: Mapped[int | None] = mapped_column(BigInteger, comment="Cluster of stage ground with its deepest point, if any")
    points: Mapped[int] = mapped_column(comment="Number of points")
    unrolled: Mapped[Any | None] = mapped_column(
        geometry("MultiPolygon"), comment="Area covered in the unrolled plane (chainage and arc); NULL away from the lining"
    )
    geom: Mapped[Any] = mapped_column(geometry("MultiPointZ"), comment="Points, at most 200, deepest first")
