"""Ground, lining, clusters and target spheres."""

from __future__ import annotations

import datetime as dt

from geoalchemy2 import WKBElement
from sqlalchemy import BigInteger, Identity, Index, Integer, SmallInteger, UniqueConstraint
from sqlalchemy.dialects.postgresql import ARRAY
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import KM, NOW, SURVEY, Base, Floats, geometry, parent


class Ground(Base):
    """Ground across the tunnel at a metre of it."""

    __tablename__ = "ground"
    __table_args__ = (
        Index(None, "survey_id", "km"),
        {"comment": "The ground at each metre along the tunnel that has one, found by stage ground (Li et al. 2023)"},
    )

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    n: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment="Metre: plan distance along the axis, m")
    km: Mapped[int] = mapped_column(comment=KM)
    across: Mapped[float] = mapped_column(
        comment="Position of the first height, m right of the axis; the next ones every 0.1 m"
    )
    height: Mapped[Floats] = mapped_column(comment="Height (z) of the ground, m; NaN where there is none")
    gamma: Mapped[float] = mapped_column(comment="Points up to this height above it are ground, m")
    foot: Mapped[Floats] = mapped_column(
        comment="Feet of the left and the right wall, m right of the axis; NaN where there is no wall"
    )
    lean: Mapped[Floats] = mapped_column(
        comment="Inclination of the left and the right wall at their feet: m to the right for each metre up"
    )
    arc_left: Mapped[float | None] = mapped_column(comment="Arc at which the ground begins on the left, m")
    arc_right: Mapped[float | None] = mapped_column(comment="Arc at which the ground begins on the right, m")
    geom: Mapped[WKBElement] = mapped_column(
        geometry("LINESTRINGZ"), comment="The ground from the left to the right, tunnel's SRID, m"
    )


class Lining(Base):
    """Offset of the lining from the surface of the sections in a kilometre."""

    __tablename__ = "lining"
    __table_args__ = {  # noqa: RUF012
        "comment": "Local planes of the lining, of each kilometre, found by stage ground: a grid in the unrolled plane"
    }

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=KM)
    cell: Mapped[float] = mapped_column(comment="Edge of a cell, m")
    box: Mapped[list[int]] = mapped_column(
        ARRAY(Integer), comment="First column (chainage / cell), first row (arc / cell), columns and rows of the grid"
    )
    offset: Mapped[bytes] = mapped_column(
        comment="Offset of the lining in each cell, m, by rows from the lowest arc; float32, little-endian, NaN for none"
    )
    spread: Mapped[bytes] = mapped_column(comment="Standard deviation of the lining's points about it, m; the same form")


class Cluster(Base):
    """Connected points that are neither ground nor lining."""

    __tablename__ = "cluster"
    __table_args__ = (
        Index(None, "survey_id", "km"),
        Index(None, "geom", postgresql_using="gist"),
        {"comment": "What stands in the tunnel or hangs on its lining, found by stage ground (DBSCAN, Li et al. 2023)"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM + " of its middle")
    class_: Mapped[int] = mapped_column("class", SmallInteger, comment="Class of its points (tunnel_api.class)")
    chainage_from: Mapped[float] = mapped_column(comment="Least chainage, m")
    chainage_to: Mapped[float] = mapped_column(comment="Greatest chainage, m")
    height_from: Mapped[float | None] = mapped_column(comment="Lowest point above the ground, m; NULL without ground")
    height_to: Mapped[float | None] = mapped_column(comment="Highest point above the ground, m; NULL without ground")
    points: Mapped[int] = mapped_column(BigInteger, comment="Points of survey density in it")
    cell: Mapped[float] = mapped_column(comment="Edge of its cells, m")
    cells: Mapped[list[int]] = mapped_column(
        ARRAY(Integer), comment="Cells that its points fill: floor(x / cell), floor(y / cell), floor(z / cell) of each"
    )
    geom: Mapped[WKBElement] = mapped_column(geometry("POLYGON"), comment="Hull of the cluster on the map, tunnel's SRID, m")


class TargetSphere(Base):
    """Target sphere in one scan."""

    __tablename__ = "target_sphere"
    __table_args__ = (
        UniqueConstraint("survey_id", "number", "scan_id"),
        Index(None, "geom", postgresql_using="gist"),
        {"comment": "Target spheres, one row for each scan that saw one (Li et al. 2023)"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    number: Mapped[int] = mapped_column(comment="Number of the sphere, along the tunnel; the same for all scans that saw it")
    scan_id: Mapped[int] = mapped_column(comment="Scan that saw it (point_source_id)")
    chainage: Mapped[float | None] = mapped_column(comment="Chainage of its centre, m; none where the tunnel has no segment")
    geom: Mapped[WKBElement] = mapped_column(geometry("POINTZ"), comment="Centre, by the nominal radius, tunnel's SRID, m")
    radius: Mapped[float] = mapped_column(comment="Radius of the best sphere of any radius, a check, m")
    nominal: Mapped[float] = mapped_column(comment="Radius that was asked for, m")
    rms: Mapped[float] = mapped_column(comment="Root mean square of its points' distances from the sphere, m")
    sigma: Mapped[float] = mapped_column(comment="Standard deviation of the centre, from the fit, m")
    coverage: Mapped[float] = mapped_column(comment="Share of the sphere's surface that is seen, 0 to 1")
    points: Mapped[int] = mapped_column(comment="Points that it was fitted to")
    found_at: Mapped[dt.datetime] = mapped_column(server_default=NOW, comment="Time when it was found")
