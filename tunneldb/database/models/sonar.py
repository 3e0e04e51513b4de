"""Sonar scans below the water, registered to the laser's points above it (Moisan et al.)."""

from __future__ import annotations

import datetime as dt

from geoalchemy2 import WKBElement
from sqlalchemy import BigInteger, Identity, Index, SmallInteger, Text, UniqueConstraint
from sqlalchemy.dialects.postgresql import ARRAY
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import KM, NOW, SURVEY, Base, Floats, geometry, one_of, parent


class SonarScan(Base):
    """Sonar scan with its pose."""

    __tablename__ = "sonar_scan"
    __table_args__ = (
        one_of("state", "determined", "weak", "undetermined", "given"),
        UniqueConstraint("survey_id", "name"),
        {"comment": "Sonar scans below the water, with their poses in the tunnel"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    name: Mapped[str] = mapped_column(comment="Name of the file")
    path: Mapped[str] = mapped_column(comment="Path of the file at registration")
    checksum: Mapped[str] = mapped_column(comment="SHA-256 of the file, hexadecimal")
    bytes: Mapped[int] = mapped_column(BigInteger, comment="Size of the file")
    up: Mapped[int] = mapped_column(comment="1 if the file's z axis points up, -1 if down, as given")
    water_level: Mapped[float] = mapped_column(comment="Height of the water, as was said, m")
    state: Mapped[str] = mapped_column(
        comment="determined, weak (known worse than it should be), undetermined, or given (the file is in the tunnel's system)"
    )
    undetermined: Mapped[list[str]] = mapped_column(ARRAY(Text), comment="Directions that are known badly or not at all")
    rotation: Mapped[Floats | None] = mapped_column(
        comment="3 × 3, row by row; NULL where no pose was found, or none is needed"
    )
    translation: Mapped[Floats | None] = mapped_column(comment="Place of the sonar in the tunnel's SRID, m")
    scale: Mapped[float | None] = mapped_column(comment="Factor of its coordinates: speed of sound over that assumed")
    covariance: Mapped[Floats | None] = mapped_column(
        comment="7 × 7, row by row: turns about x, y, z through the sonar, rad, shifts along them, m, and scale"
    )
    registered_at: Mapped[dt.datetime] = mapped_column(server_default=NOW, comment="Time of the registration")
    points: Mapped[int | None] = mapped_column(BigInteger, comment="Points of the file; NULL before it is loaded")
    false_echoes: Mapped[int | None] = mapped_column(BigInteger, comment="Number of false echoes, which are left out")
    outside: Mapped[int | None] = mapped_column(
        BigInteger, comment="Number of points beyond the axis or too far from the sonar"
    )
    kept: Mapped[int | None] = mapped_column(BigInteger, comment="Rows of it in tunnel.sonar_point")
    loaded_at: Mapped[dt.datetime | None] = mapped_column(comment="Time when its points were loaded with this pose")


class RegistrationResidual(Base):
    """Residual between a sonar scan and an object of its fit."""

    __tablename__ = "registration_residual"
    __table_args__ = (
        one_of("kind", "wall", "ladder", "waterline", "scan"),
        Index(None, "scan_id"),
        {"comment": "What is left between sonar scans and what they were fitted to"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    scan_id: Mapped[int] = mapped_column(parent("sonar_scan"), comment="Sonar scan")
    kind: Mapped[str] = mapped_column(comment="wall, ladder, waterline or scan (where two sonar scans overlap)")
    name: Mapped[str] = mapped_column(comment="Side of the wall, name of the ladder or of the other scan's file")
    count: Mapped[int] = mapped_column(comment="Patches or points that were compared")
    median: Mapped[float] = mapped_column(comment="Median of the absolute distances, m")
    p95: Mapped[float] = mapped_column(comment="95th percentile of the residuals, m")


class Ladder(Base):
    """Ladder in the water, as seen by the laser."""

    __tablename__ = "ladder"
    __table_args__ = (
        UniqueConstraint("survey_id", "name"),
        {"comment": "Ladders that stand in the water, as the laser sees them above it"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    name: Mapped[str] = mapped_column(comment="Name in the file of ladders")
    origin: Mapped[Floats] = mapped_column(comment="Middle between its stiles at its height zero, tunnel's SRID, m")
    axes: Mapped[Floats] = mapped_column(comment="3 × 3, row by row: unit vectors across, up and out to the water")
    rms: Mapped[float] = mapped_column(comment="Root mean square distance of the laser's points, m")
    rungs: Mapped[list[int]] = mapped_column(ARRAY(BigInteger), comment="Numbers of the rungs that the laser saw")
    scans: Mapped[list[str]] = mapped_column(ARRAY(Text), comment="Names of the sonar scans that saw it")


class SonarPoint(Base):
    """Point of a sonar scan, thinned."""

    __tablename__ = "sonar_point"
    __table_args__ = (
        Index(None, "survey_id", "km"),
        Index(None, "survey_id", "chainage"),
        Index(None, "scan_id"),
        {"comment": "Points of sonar scans in the tunnel, thinned and without false echoes"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    scan_id: Mapped[int] = mapped_column(parent("sonar_scan"), comment="Sonar scan")
    chainage: Mapped[float] = mapped_column(comment="Chainage by the given axis, m")
    across: Mapped[float] = mapped_column(comment="Place right of the given axis, m")
    classification: Mapped[int] = mapped_column(
        SmallInteger, comment="40 bed, 41 surface of the water, 42 submerged lining, 43 submerged object"
    )
    geom: Mapped[WKBElement] = mapped_column(geometry("POINTZ"), comment="Place in the tunnel's SRID, m")


class Bed(Base):
    """Cell of the bed, 1 m along and 0.1 m across."""

    __tablename__ = "bed"
    __table_args__ = (
        UniqueConstraint("survey_id", "n", "across_n"),
        Index(None, "survey_id", "km"),
        {"comment": "The bed below the water in cells of 1 m along and 0.1 m across; cells that no sonar saw are not there"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    n: Mapped[int] = mapped_column(comment="Metre of chainage at which it begins")
    across_n: Mapped[int] = mapped_column(comment="Tenth of a metre right of the axis at which it begins")
    height: Mapped[float] = mapped_column(comment="Median height of the bed, m")
    depth: Mapped[float] = mapped_column(comment="Depth of the bed below the water, m")
    sigma: Mapped[float] = mapped_column(comment="Standard deviation of its height, that of the scans' poses included, m")
    points: Mapped[int] = mapped_column(comment="Points of the bed in it")


class WaterLevel(Base):
    """Water in a kilometre, with the time since which its sonar results are unchanged."""

    __tablename__ = "water_level"
    __table_args__ = (
        UniqueConstraint("survey_id", "km"),
        {"comment": "The water in kilometres into which sonar scans were loaded"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    height: Mapped[float | None] = mapped_column(
        comment="Height of the water surface, m; NULL if sonar scans were loaded and none is left"
    )
    changed_at: Mapped[dt.datetime] = mapped_column(
        comment="Time when sonar points were last loaded into the kilometre, or removed from it"
    )
