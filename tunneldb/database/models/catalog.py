"""Tunnels and their alignments, surveys and scanner positions."""

from __future__ import annotations

import datetime as dt

from geoalchemy2 import WKBElement
from sqlalchemy import CheckConstraint, Identity, Index, SmallInteger, text
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import NOW, SURVEY, TUNNEL, Base, bounded, finite, geometry, one_of, parent


class Tunnel(Base):
    """Structure with its given axis; a site has none."""

    __tablename__ = "tunnel"
    __table_args__ = (
        CheckConstraint("spacing BETWEEN 0.1 AND 1000", name="spacing"),
        bounded("dry_region_limit", "dry_region_limit", least=0),
        bounded("start_chainage", "start_chainage"),
        {"comment": "A structure: its spatial reference, stationing and given axis"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    name: Mapped[str] = mapped_column(unique=True, comment="Name that the commands use")
    srid: Mapped[int] = mapped_column(
        comment="Spatial reference of all coordinates of this tunnel; projected, metres; 0: local metres, of no place on Earth"
    )
    start_chainage: Mapped[float] = mapped_column(
        server_default=text("0"), comment="Chainage of the given axis's first vertex, m"
    )
    dry_region_limit: Mapped[float] = mapped_column(
        server_default=text("50"),
        comment="Area above which a dry region must say why it is drawn, and waits for an operator, m²",
    )
    spacing: Mapped[float] = mapped_column(
        server_default=text("10"), comment="Distance between vertices of the averaged axis, m of chainage"
    )
    alignment: Mapped[WKBElement | None] = mapped_column(
        geometry("LINESTRINGZ"),
        comment="Axis as given, in growing chainage, in the tunnel's SRID; NULL of a site",
    )
    design: Mapped[str | None] = mapped_column(
        comment="Source of the given axis: file and alignment, file and layer, or scan; NULL for a table"
    )
    created_at: Mapped[dt.datetime] = mapped_column(server_default=NOW, comment="Time when it was added")


class AlignmentElement(Base):
    """Element of a tunnel's design alignment."""

    __tablename__ = "alignment_element"
    __table_args__ = (
        one_of("plane", "horizontal", "vertical"),
        one_of("kind", "line", "arc", "clothoid", "grade", "parabola", "circle"),
        CheckConstraint("length > 0", name="length"),
        {"comment": "Elements of the design alignment, where the given axis came as one (LandXML, IFC)"},
    )

    tunnel_id: Mapped[int] = mapped_column(parent("tunnel"), primary_key=True, comment=TUNNEL)
    plane: Mapped[str] = mapped_column(primary_key=True, comment="horizontal or vertical")
    n: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment="Number along the alignment, from 1")
    kind: Mapped[str] = mapped_column(comment="line, arc, clothoid (horizontal); grade, parabola, circle (vertical)")
    chainage: Mapped[float] = mapped_column(comment="Chainage of its beginning, m")
    length: Mapped[float] = mapped_column(comment="Length in plan, m")
    x: Mapped[float | None] = mapped_column(comment="Easting of the beginning of a horizontal element, tunnel's SRID, m")
    y: Mapped[float | None] = mapped_column(comment="Northing of the beginning of a horizontal element, tunnel's SRID, m")
    bearing: Mapped[float | None] = mapped_column(
        comment="Direction in which a horizontal one begins, radians from the x axis towards y"
    )
    curvature_from: Mapped[float | None] = mapped_column(
        comment="Curvature of a horizontal one at its beginning, 1/m, positive to the left; in between it is linear"
    )
    curvature_to: Mapped[float | None] = mapped_column(comment="The same at its end, 1/m")
    z: Mapped[float | None] = mapped_column(comment="Height at which a vertical one begins, m")
    grade_from: Mapped[float | None] = mapped_column(comment="Rise per metre in plan of a vertical one at its beginning")
    grade_to: Mapped[float | None] = mapped_column(comment="The same at its end")


class StationEquation(Base):
    """Piece of a tunnel's own stationing."""

    __tablename__ = "station_equation"
    __table_args__ = (
        CheckConstraint("direction IN (-1, 1)", name="direction"),
        {"comment": "Stationing of tunnels whose stations jump or run backwards, piece by piece; others have no rows"},
    )

    tunnel_id: Mapped[int] = mapped_column(parent("tunnel"), primary_key=True, comment=TUNNEL)
    chainage: Mapped[float] = mapped_column(
        primary_key=True, autoincrement=False, comment="Chainage (distance) from which the piece holds, m"
    )
    station: Mapped[float] = mapped_column(comment="Station there, m")
    direction: Mapped[int] = mapped_column(
        SmallInteger, server_default=text("1"), comment="1 where stations grow with chainage, -1 where they run backwards"
    )


class Survey(Base):
    """One scanning campaign of a tunnel."""

    __tablename__ = "survey"
    __table_args__ = (
        one_of("intensity_kind", "amplitude", "reflectance", "linear", "none"),
        one_of("platform", "static", "mobile", "unknown"),
        one_of("reference", "none", "measured", "auto"),
        CheckConstraint("(intensity_dimension IS NULL) = (intensity_kind = 'none')", name="intensity_dimension"),
        CheckConstraint("date BETWEEN '1900-01-01' AND '2199-12-31'", name="date"),
        Index(None, "tunnel_id"),
        {"comment": "A scanning campaign (an epoch) of a tunnel"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    tunnel_id: Mapped[int] = mapped_column(parent("tunnel"), comment="Tunnel that was scanned")
    name: Mapped[str] = mapped_column(unique=True, comment="Name that the commands use")
    date: Mapped[dt.date] = mapped_column(comment="Day of the scan")
    intensity_dimension: Mapped[str | None] = mapped_column(
        comment="Dimension of the scan files that holds the intensity; none when the kind is none"
    )
    intensity_kind: Mapped[str] = mapped_column(
        comment="amplitude (dB, falls with range), reflectance (dB, range removed), linear (counts) or none"
    )
    platform: Mapped[str] = mapped_column(
        comment="static (rows in station), mobile (rows in pose), or unknown: range and incidence are not corrected"
    )
    reference: Mapped[str] = mapped_column(
        server_default=text("'none'"),
        comment="Range curve: none, measured on a target (rows in reference) or auto, from the lining of each kilometre",
    )
    created_at: Mapped[dt.datetime] = mapped_column(server_default=NOW, comment="Time when it was added")
    positions_note: Mapped[str | None] = mapped_column(comment="Notes on its scanner positions: poses left out, gaps")
    time_offset: Mapped[float] = mapped_column(
        server_default=text("0"), comment="Seconds added to the times of its trajectory's file"
    )
    poses_accepted: Mapped[bool] = mapped_column(
        server_default=text("false"), comment="True if files are loaded although their points do not fit the scanner positions"
    )
    longest_interval: Mapped[float | None] = mapped_column(
        comment="Longest interval of its trajectory that is interpolated over, s; NULL without a trajectory"
    )
    trajectory_gaps: Mapped[list[float] | None] = mapped_column(
        comment="Longer intervals of its trajectory: times from and to, one after the other, s; NULL without a trajectory"
    )
    settings_at: Mapped[dt.datetime | None] = mapped_column(
        comment="Time of the last change of scanner positions, reference or intensity"
    )


class Pose(Base):
    """Pose of the scanner's trajectory."""

    __tablename__ = "pose"
    __table_args__ = (finite("geom"), {"comment": "Trajectory of a mobile scanner"})

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    time: Mapped[float] = mapped_column(primary_key=True, comment="Time as in the points' gps_time, s")
    geom: Mapped[WKBElement] = mapped_column(geometry("POINTZ"), comment="Scanner's position, tunnel's SRID, m")


class Station(Base):
    """Position of a static scanner."""

    __tablename__ = "station"
    __table_args__ = (finite("geom"), {"comment": "Stations of a static scanner"})

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    scan_id: Mapped[int] = mapped_column(
        primary_key=True, autoincrement=False, comment="Scan, as in the points' point_source_id"
    )
    geom: Mapped[WKBElement] = mapped_column(geometry("POINTZ"), comment="Scanner's position, tunnel's SRID, m")


class Reference(Base):
    """Intensity of the scanner by range."""

    __tablename__ = "reference"
    __table_args__ = {"comment": "Reference curve of the scanner: intensity over range (Xu et al. 2018)"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    range_m: Mapped[float] = mapped_column(primary_key=True, comment="Range, m")
    intensity_db: Mapped[float] = mapped_column(comment="Intensity of the reference target, dB")
