"""Rings of the linings of surveys, as defined and as measured."""

from __future__ import annotations

from sqlalchemy import BigInteger, CheckConstraint, Identity, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import KM, SURVEY, Base, Reals, one_of, parent

ORIGINS = ("length", "file", "found")
"""Sources of the rings of a survey."""


class Ring(Base):
    """Ring of a lining, from one joint around the tunnel to the next."""

    __tablename__ = "ring"
    __table_args__ = (
        UniqueConstraint("survey_id", "number"),
        Index(None, "survey_id", "chainage_from"),
        Index(None, "survey_id", "ovality"),
        one_of("origin", *ORIGINS),
        one_of("joint", "given", "seen", "missing"),
        one_of("shape", "ellipse", "circle", "none"),
        one_of("diameter_from", "option", "profile", "ring"),
        CheckConstraint("chainage_from < chainage_to", name="chainage"),
        {"comment": "Rings of the lining of a survey; values are NULL until measured, or if unknown"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    number: Mapped[int] = mapped_column(comment="Number of the ring")
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of the joint at its beginning, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage of the joint at its end, m")
    origin: Mapped[str] = mapped_column(comment="Source of the rings: length, file, or found")
    joint: Mapped[str] = mapped_column(comment="Joint at its beginning: given, seen, or missing")
    seen_share: Mapped[float | None] = mapped_column(comment="Share of its circumference that is seen; NULL: not measured")
    shape: Mapped[str | None] = mapped_column(comment="Fitted shape: ellipse, circle, or none")
    centre_right: Mapped[float | None] = mapped_column(comment="Distance of the centre to the right of the given axis, m")
    centre_right_se: Mapped[float | None] = mapped_column(comment="Standard error, m")
    centre_up: Mapped[float | None] = mapped_column(comment="Height of the centre above the given axis, m")
    centre_up_se: Mapped[float | None] = mapped_column(comment="Standard error, m")
    radius: Mapped[float | None] = mapped_column(comment="Mean radius, m")
    radius_se: Mapped[float | None] = mapped_column(comment="Standard error, m")
    diameter_largest: Mapped[float | None] = mapped_column(comment="Largest diameter of the ellipse, m")
    diameter_largest_se: Mapped[float | None] = mapped_column(comment="Standard error, m")
    diameter_smallest: Mapped[float | None] = mapped_column(comment="Smallest diameter of the ellipse, m")
    diameter_smallest_se: Mapped[float | None] = mapped_column(comment="Standard error, m")
    largest_clock: Mapped[float | None] = mapped_column(comment="Clock position of the largest diameter, degrees")
    largest_clock_se: Mapped[float | None] = mapped_column(comment="Standard error, degrees")
    ovality: Mapped[float | None] = mapped_column(comment="Largest less smallest diameter over the design diameter")
    ovality_se: Mapped[float | None] = mapped_column(comment="Standard error")
    design_diameter: Mapped[float | None] = mapped_column(comment="Diameter that ovality is a share of, m")
    diameter_from: Mapped[str | None] = mapped_column(
        comment="Source of the design diameter: option, profile, or ring (its own mean)"
    )
    harmonic: Mapped[Reals | None] = mapped_column(comment="Amplitudes of the radius by order, from 2, m; NaN untold")
    harmonic_se: Mapped[Reals | None] = mapped_column(comment="Their standard errors, m")
    harmonic_clock: Mapped[Reals | None] = mapped_column(comment="First clock position where each is outwards most, degrees")
    inward: Mapped[float | None] = mapped_column(
        comment="Least departure from the circle of the mean radius, m, negative inside"
    )
    inward_se: Mapped[float | None] = mapped_column(comment="Standard error, m")
    inward_clock: Mapped[float | None] = mapped_column(comment="Clock position of inward, degrees")
    outward: Mapped[float | None] = mapped_column(comment="Greatest departure from that circle, m")
    outward_se: Mapped[float | None] = mapped_column(comment="Standard error, m")
    outward_clock: Mapped[float | None] = mapped_column(comment="Clock position of outward, degrees")
    sigma: Mapped[float | None] = mapped_column(comment="Scatter of cells about what was fitted, m")
    step: Mapped[Reals | None] = mapped_column(
        comment="Steps from the ring before to this one in cells of arc, m, positive where this one stands in; NaN untold"
    )
    step_se: Mapped[Reals | None] = mapped_column(comment="Their standard errors, m")
    step_arc: Mapped[Reals | None] = mapped_column(comment="Arcs of the cells' middles, m")
    step_greatest: Mapped[float | None] = mapped_column(comment="Greatest step either way, m, with its sign")
    step_greatest_se: Mapped[float | None] = mapped_column(comment="Standard error, m")
    step_greatest_arc: Mapped[float | None] = mapped_column(comment="Arc of its place, m")
    lip: Mapped[float | None] = mapped_column(
        comment="Greatest step within the ring, between segments, m, positive where what follows clockwise stands in"
    )
    lip_se: Mapped[float | None] = mapped_column(comment="Standard error, m")
    lip_arc: Mapped[float | None] = mapped_column(comment="Arc of its place, m")
    remark: Mapped[str | None] = mapped_column(comment="Notes and limitations")
    circle_x: Mapped[float | None] = mapped_column(
        comment="Centre of the best-fit circle of all points, least squares of distances; tunnel's SRID, m"
    )
    circle_y: Mapped[float | None] = mapped_column(comment="Its y, m")
    circle_z: Mapped[float | None] = mapped_column(comment="Its height, m")
    circle_radius: Mapped[float | None] = mapped_column(comment="Radius of that circle, m")


class RingChord(Base):
    """Chord of a ring between two clock positions."""

    __tablename__ = "ring_chord"
    __table_args__ = (
        UniqueConstraint("ring_id", "clock_from", "clock_to"),
        {"comment": "Chords of rings between clock positions; convergence is how they change between surveys"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    ring_id: Mapped[int] = mapped_column(parent("ring"), comment="Ring that the chord is of")
    clock_from: Mapped[float] = mapped_column(comment="Clock position of its one end, degrees from the crown to the right")
    clock_to: Mapped[float] = mapped_column(comment="Clock position of its other end, degrees")
    length: Mapped[float | None] = mapped_column(comment="Length, m; NULL where an end is not seen")
    length_se: Mapped[float | None] = mapped_column(comment="Standard error, m")
