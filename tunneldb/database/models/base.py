"""Common parts of all models: base class, names of constraints, types and common columns."""

from __future__ import annotations

import datetime as dt
from typing import Annotated, Any

from geoalchemy2 import Geometry
from sqlalchemy import REAL, CheckConstraint, DateTime, Double, ForeignKey, Integer, LargeBinary, MetaData, Text, text
from sqlalchemy.dialects.postgresql import ARRAY, JSONB
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

SCHEMA = "tunnel"
AUDIT_SCHEMA = "tunnel_audit"

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
    """Base of all models; defines types and names of constraints."""

    metadata = MetaData(schema=SCHEMA, naming_convention=_NAMES)
    type_annotation_map = {  # noqa: RUF012
        str: Text,
        float: Double,
        int: Integer,
        list[float]: ARRAY(Double),
        list[str]: ARRAY(Text),
        dt.datetime: DateTime(timezone=True),
        dict[str, Any]: JSONB,
        bytes: LargeBinary,
    }


def geometry(kind: str) -> Geometry:
    """Return a geometry type without SRID: the SRID differs between tunnels, so each value has its own."""
    return Geometry(kind, spatial_index=False)


def one_of(column: str, *values: str) -> CheckConstraint:
    """Return the constraint that a column has one of these values."""
    listed = ", ".join(f"'{value}'" for value in values)
    return CheckConstraint(f"{column} IN ({listed})", name=column)


def bounded(name: str, *columns: str, least: float = -1e8, most: float = 1e8) -> CheckConstraint:
    """Return the constraint that numbers are finite and between two values; by default metres within 100,000 km."""
    # BETWEEN would be restored from a dump as another expression
    terms = (f"{column} >= '{least:.0f}'::float8 AND {column} <= '{most:.0f}'::float8" for column in columns)
    return CheckConstraint(" AND ".join(terms), name=name)


def at_most(column: str, characters: int) -> CheckConstraint:
    """Return the constraint that a text has at most a number of characters."""
    return CheckConstraint(f"char_length({column}) <= {characters}", name=f"{column}_at_most_{characters}_characters")


def finite(column: str) -> CheckConstraint:
    """Return the constraint that the coordinates of a point are numbers within 100,000 km."""
    terms = (
        f"coalesce(public.st_{axis}({column}) BETWEEN '-100000000'::float8 AND '100000000'::float8, false)" for axis in "xyz"
    )
    return CheckConstraint(" AND ".join(terms), name=f"{column}_finite")


def parent(table: str) -> ForeignKey:
    """Return the reference to a row of another table, with whose deletion this row is deleted."""
    return ForeignKey(f"{SCHEMA}.{table}.id", ondelete="CASCADE")


TUNNEL = "Tunnel that the row belongs to"
SURVEY = "Survey that the row belongs to"
KM = "Kilometre: floor(chainage / 1000)"
NOW = text("now()")
CLOCK = text("clock_timestamp()")


class Review:
    """Review of a finding by an inspector, and whether the last detection found it; a mixin of tables of findings."""

    review: Mapped[str] = mapped_column(server_default=text("'open'"), comment="open, confirmed or rejected, by an inspector")
    reviewed_by: Mapped[str | None] = mapped_column(comment="Role that reviewed it")
    reviewed_at: Mapped[dt.datetime | None] = mapped_column(comment="Time of the last review")
    remark: Mapped[str | None] = mapped_column(comment="Inspector's remark")
    detected: Mapped[bool] = mapped_column(server_default=text("true"), comment="True if the last detection found it again")
    created_at: Mapped[dt.datetime] = mapped_column(server_default=NOW, comment="Time when it was first found")
    detected_at: Mapped[dt.datetime] = mapped_column(server_default=NOW, comment="Time when it was last found")
