"""Elements of tunnels, and the schemes by which owners rate them."""

from __future__ import annotations

import datetime as dt

from sqlalchemy import CheckConstraint, Identity, Integer, Text, UniqueConstraint, text
from sqlalchemy.dialects.postgresql import ARRAY
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import CLOCK, TUNNEL, Base, Floats, at_most, bounded, one_of, parent


class ElementSet(Base):
    """Division of a tunnel into elements."""

    __tablename__ = "element_set"
    __table_args__ = (
        UniqueConstraint("tunnel_id", "name"),
        at_most("name", 100),
        one_of("source", "file", "length", "rings", "joints"),
        {"comment": "Divisions of tunnels into elements that are rated: rings, blocks, stretches, zones"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    tunnel_id: Mapped[int] = mapped_column(parent("tunnel"), comment=TUNNEL)
    name: Mapped[str] = mapped_column(comment="Name")
    source: Mapped[str] = mapped_column(comment="file, length (equal stretches), rings or joints (of a survey)")
    added_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time when it was added")


class Element(Base):
    """Element of a tunnel."""

    __tablename__ = "element"
    __table_args__ = (
        UniqueConstraint("element_set_id", "number"),
        at_most("name", 200),
        bounded("place", "chainage_from", "chainage_to"),
        CheckConstraint("chainage_from < chainage_to", name="order"),
        CheckConstraint(
            "(clock_from IS NULL) = (clock_to IS NULL) AND clock_from >= 0 AND clock_from <= 12 AND clock_to >= 0"
            " AND clock_to <= 12 AND clock_from <> clock_to",
            name="clock",
        ),
        {"comment": "Elements of tunnels: stretches of the lining, all round or between two clock positions"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    element_set_id: Mapped[int] = mapped_column(parent("element_set"), comment="Division that it is part of")
    number: Mapped[int] = mapped_column(Integer, comment="Number in its division, from 1")
    name: Mapped[str] = mapped_column(comment="Name, such as a ring number")
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of its beginning, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage of its end, m")
    clock_from: Mapped[float | None] = mapped_column(
        comment="Clock position at which it begins, clockwise looking up-chainage, hours; NULL: all round"
    )
    clock_to: Mapped[float | None] = mapped_column(comment="Clock position at which it ends, hours")


class RatingScheme(Base):
    """Scheme by which an owner rates elements."""

    __tablename__ = "rating_scheme"
    __table_args__ = (
        UniqueConstraint("name", "version"),
        at_most("name", 100),
        at_most("version", 100),
        at_most("source", 1000),
        CheckConstraint("cardinality(results) BETWEEN 2 AND 20", name="results"),
        CheckConstraint("min_inspected >= 0 AND min_inspected <= 1", name="min_inspected"),
        CheckConstraint(
            "(totals IS NULL) = (total_results IS NULL) AND cardinality(totals) >= 1 AND cardinality(totals) <= 20"
            " AND cardinality(totals) = cardinality(total_results)",
            name="totals",
        ),
        {"comment": "Schemes by which owners rate elements; a version is never changed"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    name: Mapped[str] = mapped_column(comment="Name")
    version: Mapped[str] = mapped_column(comment="Version")
    source: Mapped[str] = mapped_column(comment="Directive or standard with section, in the owner's words")
    valid_from: Mapped[dt.date | None] = mapped_column(comment="Date from which it is valid")
    results: Mapped[list[str]] = mapped_column(ARRAY(Text), comment="Results from the best to the worst")
    min_inspected: Mapped[float] = mapped_column(
        server_default=text("0.95"), comment="Inspected share below which a result is a lower bound, 0 to 1"
    )
    totals: Mapped[Floats | None] = mapped_column(
        comment="Limits of the sum of the rules' points, ascending; NULL: the worst result of all rules is that of an element"
    )
    total_results: Mapped[list[str] | None] = mapped_column(ARRAY(Text), comment="Result at each total")
    totals_inclusive: Mapped[bool] = mapped_column(
        server_default=text("true"), comment="True if a sum equal to a total reaches it"
    )
    added_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time when it was added")


_MEASURES = ("area", "share", "largest_area", "length", "density_length", "width_mm", "severity", "count", "growth")


class RatingRule(Base):
    """Rule of a scheme: limits of a measure, with results or points; or a matrix of two measures."""

    __tablename__ = "rating_rule"
    __table_args__ = (
        at_most("text", 500),
        one_of("measure", *_MEASURES),
        one_of("by_measure", *_MEASURES),
        CheckConstraint("cardinality(limits) >= 1 AND cardinality(limits) <= 20", name="limits"),
        CheckConstraint(
            "(by_measure IS NULL) = (by_kinds IS NULL) AND (by_measure IS NULL) = (by_limits IS NULL)"
            " AND (by_measure IS NULL) = (by_inclusive IS NULL)"
            " AND cardinality(by_limits) >= 1 AND cardinality(by_limits) <= 20",
            name="by",
        ),
        CheckConstraint(
            "cardinality(results) = CASE WHEN points IS NOT NULL THEN 0 WHEN by_measure IS NULL THEN cardinality(limits)"
            " ELSE (cardinality(limits) + 1) * (cardinality(by_limits) + 1) END",
            name="results",
        ),
        CheckConstraint("by_measure IS NULL OR points IS NULL", name="points"),
        CheckConstraint("cardinality(points) = cardinality(limits)", name="point_count"),
        {"comment": "Rules of rating schemes"},
    )

    scheme_id: Mapped[int] = mapped_column(parent("rating_scheme"), primary_key=True, comment="Scheme")
    number: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=False, comment="Number of the rule, from 1")
    text: Mapped[str] = mapped_column(comment="Rule in the owner's words")
    kinds: Mapped[list[str]] = mapped_column(ARRAY(Text), comment="Codes of the kinds of findings; empty: all wet ones")
    measure: Mapped[str] = mapped_column(
        comment="area (m², sum), share (area over the inspected lining), largest_area (m²), length (m, sum), density_length"
        " (m per m² of inspected lining), width_mm (greatest), severity (greatest), count, or growth (m² of area per year since"
        " the earlier inspection)"
    )
    inclusive: Mapped[bool] = mapped_column(comment="True if a value equal to a limit reaches it")
    limits: Mapped[Floats] = mapped_column(comment="Limits in ascending order")
    results: Mapped[list[str]] = mapped_column(
        ARRAY(Text),
        comment="Result at each limit; of a matrix, row by row, one row for each class of the measure, from below the first"
        " limit; empty if the rule has points",
    )
    points: Mapped[Floats | None] = mapped_column(comment="Points at each limit, of a scheme with totals")
    by_measure: Mapped[str | None] = mapped_column(comment="Second measure of a matrix, whose classes are its columns")
    by_kinds: Mapped[list[str] | None] = mapped_column(ARRAY(Text), comment="Kinds of findings of the second measure")
    by_inclusive: Mapped[bool | None] = mapped_column(
        comment="True if a value equal to a limit of the second measure reaches it"
    )
    by_limits: Mapped[Floats | None] = mapped_column(comment="Limits of the second measure in ascending order")
