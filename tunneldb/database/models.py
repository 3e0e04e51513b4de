"""The tables of schema `tunnel`, as SQLAlchemy knows them.

Alembic compares these with the database; migrations are written by hand from the difference. Units: metres,
decibels, seconds, square metres, unless a comment says otherwise.
"""

from __future__ import annotations

import datetime as dt
from typing import Annotated, Any

from geoalchemy2 import Geometry, WKBElement
from sqlalchemy import (
    REAL,
    BigInteger,
    CheckConstraint,
    Column,
    DateTime,
    Double,
    ForeignKey,
    Identity,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    SmallInteger,
    Table,
    Text,
    UniqueConstraint,
    text,
)
from sqlalchemy.dialects.postgresql import ARRAY, INT8MULTIRANGE, JSONB
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

SCHEMA = "tunnel"

_NAMES = {
    "ix": "%(table_name)s_%(column_0_N_name)s_idx",
    "uq": "%(table_name)s_%(column_0_N_name)s_key",
    "ck": "%(table_name)s_%(constraint_name)s_check",
    "fk": "%(table_name)s_%(column_0_N_name)s_fkey",
    "pk": "%(table_name)s_pkey",
}

Floats = Annotated[list[float], mapped_column(ARRAY(Double))]
Reals = Annotated[list[float], mapped_column(ARRAY(REAL))]


class Base(DeclarativeBase):
    """Base of all models; gives the types and the constraints' names."""

    metadata = MetaData(schema=SCHEMA, naming_convention=_NAMES)
    type_annotation_map = {  # noqa: RUF012
        str: Text,
        float: Double,
        int: Integer,
        list[float]: ARRAY(Double),
        dt.datetime: DateTime(timezone=True),
        dict[str, Any]: JSONB,
        bytes: LargeBinary,
    }


def _geometry(kind: str) -> Geometry:
    """Return a geometry type without SRID: tunnels differ in theirs, so each value carries its own."""
    return Geometry(kind, spatial_index=False)


def _one_of(column: str, *values: str) -> CheckConstraint:
    listed = ", ".join(f"'{value}'" for value in values)
    return CheckConstraint(f"{column} IN ({listed})", name=column)


def _parent(table: str) -> ForeignKey:
    return ForeignKey(f"{SCHEMA}.{table}.id", ondelete="CASCADE")


_SURVEY = "Survey that the row belongs to"
_KM = "Kilometre: floor(chainage / 1000)"
_NOW = text("now()")
_CLOCK = text("clock_timestamp()")


class Tunnel(Base):
    """A structure with its given axis."""

    __tablename__ = "tunnel"
    __table_args__ = (
        CheckConstraint("spacing > 0", name="spacing"),
        {"comment": "A structure: its spatial reference, stationing and given axis"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    name: Mapped[str] = mapped_column(unique=True, comment="Name that the commands use")
    srid: Mapped[int] = mapped_column(comment="Spatial reference of all coordinates of this tunnel; projected, metres")
    start_chainage: Mapped[float] = mapped_column(
        server_default=text("0"), comment="Chainage of the given axis's first vertex, m"
    )
    spacing: Mapped[float] = mapped_column(
        server_default=text("10"), comment="Distance between vertices of the averaged axis, m of chainage"
    )
    alignment: Mapped[WKBElement] = mapped_column(
        _geometry("LINESTRINGZ"), comment="Axis as given, in growing chainage, in the tunnel's SRID"
    )
    created_at: Mapped[dt.datetime] = mapped_column(server_default=_NOW, comment="When it was added")


class Survey(Base):
    """One scanning campaign of a tunnel."""

    __tablename__ = "survey"
    __table_args__ = (
        _one_of("intensity_kind", "amplitude", "reflectance", "linear", "none"),
        _one_of("platform", "static", "mobile"),
        _one_of("reference", "none", "measured", "auto"),
        CheckConstraint("(intensity_dimension IS NULL) = (intensity_kind = 'none')", name="intensity_dimension"),
        Index(None, "tunnel_id"),
        {"comment": "A scanning campaign (an epoch) of a tunnel"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    tunnel_id: Mapped[int] = mapped_column(_parent("tunnel"), comment="Tunnel that was scanned")
    name: Mapped[str] = mapped_column(unique=True, comment="Name that the commands use")
    date: Mapped[dt.date] = mapped_column(comment="Day of the scan")
    intensity_dimension: Mapped[str | None] = mapped_column(
        comment="Dimension of the scan files that holds the intensity; none when the kind is none"
    )
    intensity_kind: Mapped[str] = mapped_column(
        comment="amplitude (dB, falls with range), reflectance (dB, range removed), linear (counts) or none"
    )
    platform: Mapped[str] = mapped_column(comment="static (rows in station) or mobile (rows in pose)")
    reference: Mapped[str] = mapped_column(
        server_default=text("'none'"),
        comment="Range curve: none, measured on a target (rows in reference) or auto, from the lining of each kilometre",
    )
    created_at: Mapped[dt.datetime] = mapped_column(server_default=_NOW, comment="When it was added")


class Pose(Base):
    """The scanner's trajectory."""

    __tablename__ = "pose"
    __table_args__ = {"comment": "Trajectory of a mobile scanner"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(_parent("survey"), primary_key=True, comment=_SURVEY)
    time: Mapped[float] = mapped_column(primary_key=True, comment="Time as in the points' gps_time, s")
    geom: Mapped[WKBElement] = mapped_column(_geometry("POINTZ"), comment="Scanner's position, tunnel's SRID, m")


class Station(Base):
    """Where a static scanner stood."""

    __tablename__ = "station"
    __table_args__ = {"comment": "Stations of a static scanner"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(_parent("survey"), primary_key=True, comment=_SURVEY)
    scan_id: Mapped[int] = mapped_column(
        primary_key=True, autoincrement=False, comment="Scan, as in the points' point_source_id"
    )
    geom: Mapped[WKBElement] = mapped_column(_geometry("POINTZ"), comment="Scanner's position, tunnel's SRID, m")


class Reference(Base):
    """The scanner's intensity over range."""

    __tablename__ = "reference"
    __table_args__ = {"comment": "Reference curve of the scanner: intensity over range (Xu et al. 2018)"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(_parent("survey"), primary_key=True, comment=_SURVEY)
    range_m: Mapped[float] = mapped_column(primary_key=True, comment="Range, m")
    intensity_db: Mapped[float] = mapped_column(comment="Intensity of the reference target, dB")


class ScanFile(Base):
    """One loaded file."""

    __tablename__ = "scan_file"
    __table_args__ = (
        UniqueConstraint("survey_id", "name"),
        {"comment": "Scan files that were loaded, with what was kept of them"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(_parent("survey"), comment=_SURVEY)
    name: Mapped[str] = mapped_column(comment="File name without its folder")
    path: Mapped[str] = mapped_column(comment="Where the file lay when it was loaded; read again at full density")
    checksum: Mapped[str] = mapped_column(comment="SHA-256 of the file, hexadecimal")
    bytes: Mapped[int] = mapped_column(BigInteger, comment="Size of the file, bytes")
    points: Mapped[int] = mapped_column(BigInteger, comment="Points in the file")
    noise: Mapped[int] = mapped_column(BigInteger, comment="Points dropped as noise")
    outside: Mapped[int] = mapped_column(BigInteger, comment="Points dropped as too far from the given axis")
    thinned: Mapped[int] = mapped_column(BigInteger, comment="Points dropped by thinning to survey density")
    kept: Mapped[int] = mapped_column(BigInteger, comment="Points kept, the rows in point")
    chainage_from: Mapped[float | None] = mapped_column(comment="Least chainage of the kept points, m")
    chainage_to: Mapped[float | None] = mapped_column(comment="Greatest chainage of the kept points, m")
    extent: Mapped[list[float] | None] = mapped_column(
        comment="Box of the kept points: xmin, ymin, zmin, xmax, ymax, zmax, tunnel's SRID, m"
    )
    srid: Mapped[int | None] = mapped_column(comment="Spatial reference that the file states, if it states one")
    loaded_at: Mapped[dt.datetime] = mapped_column(server_default=_NOW, comment="When it was loaded")


class FileKm(Base):
    """A kilometre that a file touches."""

    __tablename__ = "file_km"
    __table_args__ = {  # noqa: RUF012
        "comment": "Which kilometres a file touches. Points read and not loaded yet lie in fragment_s<survey>_f<file>_km<km>"
    }

    file_id: Mapped[int] = mapped_column(_parent("scan_file"), primary_key=True, comment="File (scan_file.id)")
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=_KM)
    rows: Mapped[int] = mapped_column(BigInteger, comment="Points of the file that wait or waited to be loaded there")
    points: Mapped[Any] = mapped_column(
        INT8MULTIRANGE,
        comment="Where in the file the points of the kilometre and 10 m to both sides are: ranges of point numbers from 0",
    )
    read_at: Mapped[dt.datetime] = mapped_column(server_default=_CLOCK, comment="When the file was read")
    loaded_at: Mapped[dt.datetime | None] = mapped_column(
        comment="When they were loaded into the kilometre; none while they wait"
    )


class Incoming(Base):
    """A file that waits to be read."""

    __tablename__ = "incoming"
    __table_args__ = {"comment": "Files that a batch is to read, until they are read"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(_parent("survey"), primary_key=True, comment=_SURVEY)
    name: Mapped[str] = mapped_column(primary_key=True, comment="File name without its folder")
    path: Mapped[str] = mapped_column(comment="Where the file lies")
    bytes: Mapped[int] = mapped_column(BigInteger, comment="Size of the file, bytes")
    points: Mapped[int] = mapped_column(BigInteger, comment="Points that its header announces; 0 if it is unreadable")
    km_from: Mapped[int | None] = mapped_column(comment="First kilometre that it may touch, by its header's box")
    km_to: Mapped[int | None] = mapped_column(comment="Last kilometre that it may touch, by its header's box")
    parameters: Mapped[dict[str, Any]] = mapped_column(server_default=text("'{}'"), comment="How it is to be read")
    requested_at: Mapped[dt.datetime] = mapped_column(server_default=_CLOCK, comment="When it was asked for")
    failed_at: Mapped[dt.datetime | None] = mapped_column(comment="When reading it failed")
    message: Mapped[str | None] = mapped_column(comment="Why it failed")


class Goal(Base):
    """What is wanted of a kilometre."""

    __tablename__ = "goal"
    __table_args__ = {"comment": "What batches want of each kilometre"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(_parent("survey"), primary_key=True, comment=_SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=_KM)
    stage: Mapped[str] = mapped_column(comment="Stage up to which the kilometre is to be brought")
    parameters: Mapped[dict[str, Any]] = mapped_column(server_default=text("'{}'"), comment="Parameters of the stages")
    requested_at: Mapped[dt.datetime] = mapped_column(server_default=_CLOCK, comment="When it was asked for")
    retry_after: Mapped[dt.datetime | None] = mapped_column(comment="Stages that failed before this moment are tried again")


class Worker(Base):
    """A worker."""

    __tablename__ = "worker"
    __table_args__ = {"comment": "Workers that serve the queue"}  # noqa: RUF012

    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, autoincrement=False, comment="Key: that of the queue's worker"
    )
    host: Mapped[str] = mapped_column(comment="Machine that it runs on")
    pid: Mapped[int] = mapped_column(comment="Its process there")
    started_at: Mapped[dt.datetime] = mapped_column(server_default=_CLOCK, comment="When it started")
    stop: Mapped[bool] = mapped_column(
        server_default=text("false"), comment="Whether it was asked to finish what it is at and leave"
    )


Point = Table(
    "point",
    Base.metadata,
    Column("survey_id", Integer, nullable=False, comment=_SURVEY),
    Column("km", Integer, nullable=False, comment=_KM + " along the given axis"),
    Column(
        "chainage",
        Double,
        nullable=False,
        comment="Chainage, m: along the given axis as loaded, along the axis found after stage segments; the rows' order",
    ),
    Column("gps_time", Double, nullable=False, comment="Time of the shot, as in the file, s"),
    Column("geom", _geometry("POINTZ"), nullable=False, comment="Position, tunnel's SRID, m"),
    Column("segment", Integer, comment="Number of the segment (segment.n) that the point lies in"),
    Column("scan_id", Integer, nullable=False, comment="Scan that it is of (point_source_id)"),
    Column("file_id", Integer, nullable=False, comment="File that it came from (scan_file.id)"),
    Column("intensity", REAL, nullable=False, comment="Intensity as the file has it; 0 when the kind is none"),
    Column("classification", SmallInteger, nullable=False, comment="Class as in the file (ASPRS)"),
    Column("class", SmallInteger, comment="Class found by stage ground (tunnel_api.class); none before it has run"),
    Index("point_chainage_idx", "chainage", postgresql_using="brin", postgresql_with={"pages_per_range": "16"}),
    postgresql_partition_by="LIST (survey_id)",
    comment="Points at survey density: partition point_s<survey> and in it point_s<survey>_km<km>, "
    "each in the order of chainage",
)


class AxisVertex(Base):
    """A vertex of the averaged axis."""

    __tablename__ = "axis_vertex"
    __table_args__ = (
        UniqueConstraint("survey_id", "n"),
        _one_of("source", "measured", "interpolated", "edited"),
        Index(None, "geom", postgresql_using="gist"),
        {"comment": "Axis of a survey: vertex n stands at chainage n * spacing of the given axis"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(_parent("survey"), comment=_SURVEY)
    n: Mapped[int] = mapped_column(comment="Number along the axis; its chainage is n * tunnel.spacing")
    km: Mapped[int] = mapped_column(comment=_KM)
    geom: Mapped[WKBElement] = mapped_column(_geometry("POINTZ"), comment="Position, tunnel's SRID, m")
    given: Mapped[WKBElement] = mapped_column(
        _geometry("POINTZ"), comment="Where the given axis has this chainage, tunnel's SRID, m"
    )
    points: Mapped[int] = mapped_column(comment="Points that were averaged; 0 unless measured")
    source: Mapped[str] = mapped_column(
        comment="measured (averaged), interpolated (too few points) or edited (by hand, kept by a rerun)"
    )
    edited_by: Mapped[str | None] = mapped_column(comment="Who moved it")
    edited_at: Mapped[dt.datetime | None] = mapped_column(comment="When it was moved")


class Segment(Base):
    """The tunnel between two vertices."""

    __tablename__ = "segment"
    __table_args__ = (
        UniqueConstraint("survey_id", "n"),
        Index(None, "geom", postgresql_using="gist"),
        Index(None, "survey_id", "chainage_from"),
        {"comment": "The tunnel between the planes at two consecutive vertices of the axis"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(_parent("survey"), comment=_SURVEY)
    n: Mapped[int] = mapped_column(comment="Number of its first vertex")
    km: Mapped[int] = mapped_column(comment=_KM)
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of its beginning, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage of its end, m")
    vertex_from: Mapped[Floats] = mapped_column(comment="First vertex: x, y, z, m")
    vertex_to: Mapped[Floats] = mapped_column(comment="Last vertex: x, y, z, m")
    tangent_from: Mapped[Floats] = mapped_column(comment="Unit tangent of the axis at the first vertex")
    tangent_to: Mapped[Floats] = mapped_column(comment="Unit tangent of the axis at the last vertex")
    geom: Mapped[WKBElement] = mapped_column(
        _geometry("LINESTRINGZ"), comment="Axis from the first vertex to the last, tunnel's SRID, m"
    )
    points: Mapped[int] = mapped_column(BigInteger, comment="Points that lie in it")


class Section(Base):
    """A cross-section."""

    __tablename__ = "section"
    __table_args__ = (
        UniqueConstraint("survey_id", "segment", "half"),
        Index(None, "survey_id", "chainage"),
        CheckConstraint("half IN (25, 75)", name="half"),
        {"comment": "Cross-sections at 25 % and 75 % of each segment, from angular classes"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(_parent("survey"), comment=_SURVEY)
    km: Mapped[int] = mapped_column(comment=_KM)
    segment: Mapped[int] = mapped_column(comment="Number of its segment (segment.n)")
    half: Mapped[int] = mapped_column(SmallInteger, comment="Where in the segment: 25 or 75 %")
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
        _geometry("LINESTRINGZ"), comment="The section as a line in space, tunnel's SRID, m"
    )
    points: Mapped[int] = mapped_column(comment="Points that it was made from")
    interpolated: Mapped[int] = mapped_column(comment="Classes that are not measured: empty or rejected")


class SectionClass(Base):
    """An angular class of a section."""

    __tablename__ = "section_class"
    __table_args__ = (
        _one_of("state", "measured", "rejected", "interpolated"),
        {"comment": "Angular classes of a section, with two-sigma rejection (Gonçalves et al. 2012)"},
    )

    section_id: Mapped[int] = mapped_column(
        BigInteger, _parent("section"), primary_key=True, comment="Section that it belongs to"
    )
    class_: Mapped[int] = mapped_column(
        "class", primary_key=True, autoincrement=False, comment="Number of the class, from the lowest angle"
    )
    angle: Mapped[float] = mapped_column(comment="Its angle from the crown, degrees, positive right")
    radius: Mapped[float] = mapped_column(comment="Distance of the surface from the axis at the angle, m")
    slope: Mapped[float | None] = mapped_column(
        comment="Inclination of the line through its points: outwards per metre to the right; none if empty"
    )
    sigma: Mapped[float | None] = mapped_column(comment="Standard deviation of its points from the line, m; none if empty")
    points: Mapped[int] = mapped_column(comment="Points that it keeps")
    state: Mapped[str] = mapped_column(
        comment="measured, rejected (an outlier among its neighbours) or interpolated (too few points)"
    )


class Ground(Base):
    """The ground across the tunnel at a metre of it."""

    __tablename__ = "ground"
    __table_args__ = (
        Index(None, "survey_id", "km"),
        {"comment": "The ground at each metre along the tunnel that has one, found by stage ground (Li et al. 2023)"},
    )

    survey_id: Mapped[int] = mapped_column(_parent("survey"), primary_key=True, comment=_SURVEY)
    n: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment="Metre: plan distance along the axis, m")
    km: Mapped[int] = mapped_column(comment=_KM)
    across: Mapped[float] = mapped_column(
        comment="Where the first height stands, m right of the axis; the next ones every 0.1 m"
    )
    height: Mapped[Floats] = mapped_column(comment="Height (z) of the ground, m; NaN where there is none")
    gamma: Mapped[float] = mapped_column(comment="Points up to this height above it are ground, m")
    foot: Mapped[Floats] = mapped_column(
        comment="Where the left and the right wall meet the ground, m right of the axis; NaN where there is no wall"
    )
    lean: Mapped[Floats] = mapped_column(
        comment="How far the left and the right wall lean to the right for each metre up there"
    )
    arc_left: Mapped[float | None] = mapped_column(comment="Arc at which the ground begins on the left, m")
    arc_right: Mapped[float | None] = mapped_column(comment="Arc at which the ground begins on the right, m")
    geom: Mapped[WKBElement] = mapped_column(
        _geometry("LINESTRINGZ"), comment="The ground from the left to the right, tunnel's SRID, m"
    )


class Lining(Base):
    """Where the lining lies in a kilometre, off the surface of the sections."""

    __tablename__ = "lining"
    __table_args__ = {  # noqa: RUF012
        "comment": "Local planes of the lining, of each kilometre, found by stage ground: a grid in the unrolled plane"
    }

    survey_id: Mapped[int] = mapped_column(_parent("survey"), primary_key=True, comment=_SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=_KM)
    cell: Mapped[float] = mapped_column(comment="Edge of a cell, m")
    box: Mapped[list[int]] = mapped_column(
        ARRAY(Integer), comment="First column (chainage / cell), first row (arc / cell), columns and rows of the grid"
    )
    offset: Mapped[bytes] = mapped_column(
        comment="Offset of the lining in each cell, m, by rows from the lowest arc; float32, little-endian, NaN for none"
    )
    spread: Mapped[bytes] = mapped_column(comment="Standard deviation of the lining's points about it, m; the same form")


class Cluster(Base):
    """Points that lie together and are neither ground nor lining."""

    __tablename__ = "cluster"
    __table_args__ = (
        Index(None, "survey_id", "km"),
        Index(None, "geom", postgresql_using="gist"),
        {"comment": "What stands in the tunnel or hangs on its lining, found by stage ground (DBSCAN, Li et al. 2023)"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(_parent("survey"), comment=_SURVEY)
    km: Mapped[int] = mapped_column(comment=_KM + " of its middle")
    class_: Mapped[int] = mapped_column("class", SmallInteger, comment="Class of its points (tunnel_api.class)")
    chainage_from: Mapped[float] = mapped_column(comment="Least chainage, m")
    chainage_to: Mapped[float] = mapped_column(comment="Greatest chainage, m")
    height_from: Mapped[float | None] = mapped_column(comment="Its lowest point above the ground, m; none without ground")
    height_to: Mapped[float | None] = mapped_column(comment="Its highest point above the ground, m; none without ground")
    points: Mapped[int] = mapped_column(BigInteger, comment="Points of survey density in it")
    cell: Mapped[float] = mapped_column(comment="Edge of its cells, m")
    cells: Mapped[list[int]] = mapped_column(
        ARRAY(Integer), comment="Cells that its points fill: floor(x / cell), floor(y / cell), floor(z / cell) of each"
    )
    geom: Mapped[WKBElement] = mapped_column(_geometry("POLYGON"), comment="Hull of it on the map, tunnel's SRID, m")


class TargetSphere(Base):
    """A target sphere as one scan saw it."""

    __tablename__ = "target_sphere"
    __table_args__ = (
        UniqueConstraint("survey_id", "number", "scan_id"),
        Index(None, "geom", postgresql_using="gist"),
        {"comment": "Target spheres, one row for each scan that saw one (Li et al. 2023)"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(_parent("survey"), comment=_SURVEY)
    km: Mapped[int] = mapped_column(comment=_KM)
    number: Mapped[int] = mapped_column(comment="Number of the sphere, along the tunnel; the same for all scans that saw it")
    scan_id: Mapped[int] = mapped_column(comment="Scan that saw it (point_source_id)")
    chainage: Mapped[float | None] = mapped_column(comment="Chainage of its centre, m; none where the tunnel has no segment")
    geom: Mapped[WKBElement] = mapped_column(_geometry("POINTZ"), comment="Centre, by the nominal radius, tunnel's SRID, m")
    radius: Mapped[float] = mapped_column(comment="Radius of the best sphere of any radius, a check, m")
    nominal: Mapped[float] = mapped_column(comment="Radius that was asked for, m")
    rms: Mapped[float] = mapped_column(comment="Root mean square of its points' distances from the sphere, m")
    sigma: Mapped[float] = mapped_column(comment="Standard deviation of the centre, from the fit, m")
    coverage: Mapped[float] = mapped_column(comment="Share of the sphere's surface that is seen, 0 to 1")
    points: Mapped[int] = mapped_column(comment="Points that it was fitted to")
    found_at: Mapped[dt.datetime] = mapped_column(server_default=_NOW, comment="When it was found")


class Radiometry(Base):
    """How the intensity of a kilometre was corrected."""

    __tablename__ = "radiometry"
    __table_args__ = {"comment": "Correction of the intensity, per kilometre (Xu et al. 2018)"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(_parent("survey"), primary_key=True, comment=_SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=_KM)
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
    """The range curve of a kilometre, found on its lining."""

    __tablename__ = "range_curve"
    __table_args__ = {"comment": "Range curve found on the lining of a kilometre, of surveys whose reference is auto"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(_parent("survey"), primary_key=True, comment=_SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=_KM)
    range_m: Mapped[Floats] = mapped_column(comment="Ranges, growing, m")
    intensity_db: Mapped[Floats] = mapped_column(comment="Intensity of dry lining at right angles there, dB")
    sigma_db: Mapped[Floats] = mapped_column(comment="Standard deviation of its shape, dB; NULL beyond the ranges seen")


class Coverage(Base):
    """What detection saw of the lining of a kilometre."""

    __tablename__ = "coverage"
    __table_args__ = {"comment": "Lining of a kilometre, what was seen of it and what is dark, by steps of chainage"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(_parent("survey"), primary_key=True, comment=_SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=_KM)
    step: Mapped[float] = mapped_column(comment="Length of a step, m; the first begins with the kilometre")
    lining: Mapped[Reals] = mapped_column(comment="Lining in each step, seen or not, in the unrolled plane, m²")
    seen: Mapped[Reals] = mapped_column(comment="What of it was seen within the limits of range and incidence, m²")
    wet: Mapped[Reals] = mapped_column(comment="What of that is wet: pixels below the threshold, after the median filter, m²")


class Region(Base):
    """A region drawn by the user."""

    __tablename__ = "region"
    __table_args__ = (
        _one_of("kind", "homogeneous", "dry"),
        Index(None, "geom", postgresql_using="gist"),
        Index(None, "survey_id"),
        {"comment": "Regions of the lining that the user has drawn, to be used in place of automatic ones"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(_parent("survey"), comment=_SURVEY)
    kind: Mapped[str] = mapped_column(comment="homogeneous (one material, for the roughness) or dry (for the threshold)")
    geom: Mapped[WKBElement] = mapped_column(_geometry("POLYGON"), comment="Region in the unrolled plane (chainage, arc), m")
    drawn_by: Mapped[str] = mapped_column(server_default=text("CURRENT_USER"), comment="Who drew it")
    drawn_at: Mapped[dt.datetime] = mapped_column(server_default=_NOW, comment="When it was drawn")


class Image(Base):
    """A block of an unrolled image."""

    __tablename__ = "image"
    __table_args__ = (
        _one_of("kind", "raw", "corrected", "offset", "state"),
        {
            "comment": "Unrolled images in blocks of 50 m: partition image_s<survey>",
            "postgresql_partition_by": "LIST (survey_id)",
        },
    )

    survey_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=_SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=_KM)
    kind: Mapped[str] = mapped_column(
        primary_key=True, comment="raw or corrected intensity, dB, offset from the surface, m, or state of the pixel"
    )
    block: Mapped[int] = mapped_column(
        primary_key=True, autoincrement=False, comment="Block along the tunnel: floor(chainage / 50)"
    )
    tiff: Mapped[bytes] = mapped_column(comment="GeoTIFF in the unrolled plane (chainage, arc), m")


class Anomaly(Base):
    """A leak, or what is dark but dry."""

    __tablename__ = "anomaly"
    __table_args__ = (
        _one_of("kind", "leak", "joint", "dark"),
        _one_of("judged", "leak", "joint", "dark"),
        _one_of("review", "open", "confirmed", "rejected"),
        Index(None, "survey_id", "km"),
        Index(None, "unrolled", postgresql_using="gist"),
        Index(None, "map", postgresql_using="gist"),
        {"comment": "What is darker than dry lining: leaks, joints and other dark spots, in three geometries"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(_parent("survey"), comment=_SURVEY)
    km: Mapped[int] = mapped_column(comment=_KM + " of its middle")
    chainage_from: Mapped[float] = mapped_column(comment="Least chainage, m")
    chainage_to: Mapped[float] = mapped_column(comment="Greatest chainage, m")
    arc_from: Mapped[float] = mapped_column(comment="Least arc, m, positive right looking up-chainage")
    arc_to: Mapped[float] = mapped_column(comment="Greatest arc, m, positive right looking up-chainage")
    clock: Mapped[float] = mapped_column(
        comment="Clock position of its middle, hours: 12 is the crown, 3 is right looking up-chainage"
    )
    kind: Mapped[str] = mapped_column(
        server_default=text("'leak'"), comment="What detection takes it for: leak, joint or dark (dark but dry)"
    )
    reasons: Mapped[list[str]] = mapped_column(
        ARRAY(Text), server_default=text("'{}'"), comment="Why, such as thin, straight, gradual, rectangular, recess"
    )
    confidence: Mapped[float | None] = mapped_column(comment="Confidence that it is of its kind, 0 to 1; none from before")
    contrast: Mapped[float | None] = mapped_column(
        comment="Mean drop in standard deviations of the dry lining about it; none from before"
    )
    judged: Mapped[str | None] = mapped_column(comment="What an inspector takes it for, where he says so")
    area: Mapped[float] = mapped_column(comment="Area on the surface, m²")
    drop_mean: Mapped[float] = mapped_column(comment="Mean drop below dry lining, dB")
    drop_max: Mapped[float] = mapped_column(comment="Greatest drop below dry lining, dB")
    image_share: Mapped[float] = mapped_column(comment="Share of its pixels that hold measured data, 0 to 1")
    unrolled: Mapped[WKBElement] = mapped_column(_geometry("POLYGON"), comment="In the unrolled plane (chainage, arc), m")
    map: Mapped[WKBElement] = mapped_column(_geometry("POLYGON"), comment="On the map strip beside the axis, tunnel's SRID, m")
    surface: Mapped[WKBElement] = mapped_column(_geometry("POLYGONZ"), comment="On the lining in space, tunnel's SRID, m")
    review: Mapped[str] = mapped_column(server_default=text("'open'"), comment="open, confirmed or rejected, by an inspector")
    reviewed_by: Mapped[str | None] = mapped_column(comment="Who reviewed it")
    reviewed_at: Mapped[dt.datetime | None] = mapped_column(comment="When it was reviewed")
    remark: Mapped[str | None] = mapped_column(comment="Inspector's remark")
    detected: Mapped[bool] = mapped_column(server_default=text("true"), comment="Whether the last detection found it again")
    created_at: Mapped[dt.datetime] = mapped_column(server_default=_NOW, comment="When it was first found")
    detected_at: Mapped[dt.datetime] = mapped_column(server_default=_NOW, comment="When it was last found")


class AnomalyPart(Base):
    """A dark region that an end of its kilometre cuts."""

    __tablename__ = "anomaly_part"
    __table_args__ = (
        Index(None, "survey_id", "km"),
        Index(None, "anomaly_id"),
        {"comment": "Dark regions cut by an end of their kilometre, from which anomalies over several are put together"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(_parent("survey"), comment=_SURVEY)
    km: Mapped[int] = mapped_column(comment=_KM)
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


class Run(Base):
    """One run of a stage."""

    __tablename__ = "run"
    __table_args__ = (
        _one_of("outcome", "running", "done", "failed"),
        Index(None, "survey_id", "stage", "km"),
        Index(None, "job_id"),
        {"comment": "Ledger of every stage that was run"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(_parent("survey"), comment=_SURVEY)
    km: Mapped[int | None] = mapped_column(comment="Kilometre; none for the whole survey")
    stage: Mapped[str] = mapped_column(comment="read, load, axis, segments, sections, ground, detect; spheres")
    parameters: Mapped[dict[str, Any]] = mapped_column(server_default=text("'{}'"), comment="Parameters that it ran with")
    versions: Mapped[dict[str, Any]] = mapped_column(
        server_default=text("'{}'"), comment="Versions of the program and of its libraries"
    )
    counts: Mapped[dict[str, Any]] = mapped_column(server_default=text("'{}'"), comment="What it counted and measured")
    backend_pid: Mapped[int] = mapped_column(server_default=text("pg_backend_pid()"), comment="Server process that it ran in")
    backend_start: Mapped[dt.datetime | None] = mapped_column(
        comment="When that process began, as in pg_stat_activity; tells a run that was cut off"
    )
    started_at: Mapped[dt.datetime] = mapped_column(server_default=text("clock_timestamp()"), comment="When it began")
    finished_at: Mapped[dt.datetime | None] = mapped_column(comment="When it ended")
    outcome: Mapped[str] = mapped_column(server_default=text("'running'"), comment="running, done or failed")
    message: Mapped[str | None] = mapped_column(comment="Why it failed")
    worker: Mapped[str | None] = mapped_column(comment="Machine and process that it ran on")
    job_id: Mapped[int | None] = mapped_column(BigInteger, comment="Job of the queue that it was, if it was one")
