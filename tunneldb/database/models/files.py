"""Scan files, and the points kept from them."""

from __future__ import annotations

import datetime as dt
from typing import Any

from sqlalchemy import REAL, BigInteger, Column, Double, Identity, Index, Integer, SmallInteger, Table, UniqueConstraint, text
from sqlalchemy.dialects.postgresql import INT4RANGE, INT8MULTIRANGE
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import CLOCK, KM, NOW, SURVEY, Base, geometry, parent


class ScanFile(Base):
    """Loaded file."""

    __tablename__ = "scan_file"
    __table_args__ = (
        UniqueConstraint("survey_id", "name"),
        {"comment": "Scan files that were loaded, with what was kept of them"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    name: Mapped[str] = mapped_column(comment="File name without its folder")
    path: Mapped[str] = mapped_column(comment="Path of the file")
    checksum: Mapped[str] = mapped_column(comment="SHA-256 of the file, hexadecimal")
    bytes: Mapped[int] = mapped_column(BigInteger, comment="Size of the file, bytes")
    points: Mapped[int] = mapped_column(BigInteger, comment="Points in the file")
    noise: Mapped[int] = mapped_column(BigInteger, comment="Points dropped as noise")
    outside: Mapped[int] = mapped_column(BigInteger, comment="Points dropped as too far from the given axis")
    invalid: Mapped[int] = mapped_column(
        BigInteger, server_default="0", comment="Points dropped as their coordinates, time or intensity are no numbers"
    )
    unposed: Mapped[int] = mapped_column(
        BigInteger, server_default="0", comment="Points dropped as the scanner's position is not known"
    )
    thinned: Mapped[int] = mapped_column(BigInteger, comment="Points dropped by thinning to survey density")
    kept: Mapped[int] = mapped_column(BigInteger, comment="Points kept, the rows in point")
    chainage_from: Mapped[float | None] = mapped_column(comment="Least chainage of the kept points, m")
    chainage_to: Mapped[float | None] = mapped_column(comment="Greatest chainage of the kept points, m")
    extent: Mapped[list[float] | None] = mapped_column(
        comment="Box of the kept points: xmin, ymin, zmin, xmax, ymax, zmax, tunnel's SRID, m"
    )
    beyond_before: Mapped[int] = mapped_column(
        BigInteger,
        server_default="0",
        comment="Number of points outside that lie before the beginning of the extended given axis",
    )
    beyond_after: Mapped[int] = mapped_column(
        BigInteger, server_default="0", comment="Number of points outside that lie after the end of the extended given axis"
    )
    reach_before: Mapped[float] = mapped_column(
        server_default="0", comment="Distance before the beginning of the given axis within which nearly all of these lie, m"
    )
    reach_after: Mapped[float] = mapped_column(
        server_default="0", comment="Distance after the end of the given axis within which nearly all of these lie, m"
    )
    intensity_note: Mapped[str | None] = mapped_column(
        comment="Doubts about its intensity: saturated, or another kind by its values"
    )
    pose_note: Mapped[str | None] = mapped_column(comment="Doubts about the scanner positions of its points")
    header_note: Mapped[str | None] = mapped_column(comment="Difference between the header and the points, with both values")
    coordinate_note: Mapped[str | None] = mapped_column(
        comment="Conversion of its coordinates to metres, and contradictions in what it states of them"
    )
    unit: Mapped[str] = mapped_column(server_default="m", comment="Unit of its x and y: m, cm, mm, ft, us-ft or in")
    height_unit: Mapped[str] = mapped_column(server_default="m", comment="Unit of its z: m, cm, mm, ft, us-ft or in")
    srid: Mapped[int | None] = mapped_column(comment="Spatial reference that the file states, if it states one")
    loaded_at: Mapped[dt.datetime] = mapped_column(server_default=NOW, comment="Time of loading")


class FileKm(Base):
    """Kilometre that a file touches."""

    __tablename__ = "file_km"
    __table_args__ = {  # noqa: RUF012
        "comment": "Which kilometres a file touches. Points read and not loaded yet lie in fragment_s<survey>_f<file>_km<km>"
    }

    file_id: Mapped[int] = mapped_column(parent("scan_file"), primary_key=True, comment="File (scan_file.id)")
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=KM)
    rows: Mapped[int] = mapped_column(BigInteger, comment="Points of the file that wait or waited to be loaded there")
    points: Mapped[Any] = mapped_column(
        INT8MULTIRANGE,
        comment="Ranges of point numbers, from 0, of the kilometre and 10 m on both sides",
    )
    seconds: Mapped[Any | None] = mapped_column(
        INT8MULTIRANGE,
        comment="Time range of these points: whole seconds around their gps_time; NULL if unknown",
    )
    read_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time of reading")
    loaded_at: Mapped[dt.datetime | None] = mapped_column(comment="Time of loading")


class Incoming(Base):
    """File that waits to be read."""

    __tablename__ = "incoming"
    __table_args__ = {"comment": "Files that a batch is to read, until they are read"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    name: Mapped[str] = mapped_column(primary_key=True, comment="File name without its folder")
    path: Mapped[str] = mapped_column(comment="Path of the file")
    bytes: Mapped[int] = mapped_column(BigInteger, comment="Size of the file, bytes")
    points: Mapped[int] = mapped_column(BigInteger, comment="Points that its header announces; 0 if it is unreadable")
    km_from: Mapped[int | None] = mapped_column(
        comment="First kilometre that it probably touches, by header or sample; NULL if unknown. The points decide"
    )
    km_to: Mapped[int | None] = mapped_column(
        comment="Last kilometre that it probably touches, by header or sample; NULL if unknown. The points decide"
    )
    parameters: Mapped[dict[str, Any]] = mapped_column(server_default=text("'{}'"), comment="Parameters of reading")
    stage: Mapped[str | None] = mapped_column(
        comment="Last stage to run in the kilometres that get points of it; NULL for load"
    )
    stage_parameters: Mapped[dict[str, Any]] = mapped_column(
        server_default=text("'{}'"), comment="Parameters of the stages in these kilometres"
    )
    kilometres: Mapped[Any | None] = mapped_column(
        INT4RANGE, comment="Kilometres that are run up to this stage, others are only loaded; NULL for all"
    )
    requested_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time of the request")
    failed_at: Mapped[dt.datetime | None] = mapped_column(comment="Time of the failure")
    message: Mapped[str | None] = mapped_column(comment="Why it failed")


Point = Table(
    "point",
    Base.metadata,
    Column("survey_id", Integer, nullable=False, comment=SURVEY),
    Column("km", Integer, nullable=False, comment=KM + " along the given axis"),
    Column(
        "chainage",
        Double,
        nullable=False,
        comment="Chainage, m: along the given axis as loaded, along the axis found after stage segments; the rows' order",
    ),
    Column("gps_time", Double, nullable=False, comment="Time of the shot, as in the file, s"),
    Column("geom", geometry("POINTZ"), nullable=False, comment="Position, tunnel's SRID, m"),
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
