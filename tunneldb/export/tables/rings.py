"""Rings as a table: a row each, values and their standard errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tunneldb.csvfile import write_csv
from tunneldb.measures.rings.surveyed import RingRow, SurveyedRings

Chord = tuple[str, float, float]
"""Name of a chord, and the clock positions of its ends, °."""

Value = str | int | float | None

PERMILLE = 1000.0

_METRES, _SMALL, _DEGREES, _TURN, _PERMILLE = 4, 5, 2, 3, 3  # decimals; small is what is measured across the ring, m

SUMMARY = ("rings", "median", "95 % below", "greatest", "ring")


def rings_csv(surveyed: SurveyedRings, orders: int, chords: Sequence[Chord] = ()) -> str:
    """Return the table of rings as CSV; unknown values are empty."""
    records = ring_records(surveyed, orders, chords)
    return write_csv(list(records[0]), (record.values() for record in records))


def ring_records(surveyed: SurveyedRings, orders: int, chords: Sequence[Chord] = ()) -> list[dict[str, Value]]:
    """Return rings as mappings, with the columns in their order; unknown values are None."""
    rows = []
    for row in surveyed.rows:
        first = dict.fromkeys(_FIRST) | dict(_first(row, surveyed.diameter))
        rest = dict(_empty_rest(orders, chords)) | dict(_rest(row, orders, chords))
        used = 0 if row.ring is None else int(row.ring.used.sum())
        last = {"points": len(row.points), "used": used, "rejected": 0 if row.ring is None else len(row.points) - used}
        rows.append({"ring": row.name, **first, **rest, **last, "remark": "; ".join(row.remarks), **_circle(row)})
    return rows


def summary(surveyed: SurveyedRings) -> Iterator[tuple[str, ...]]:
    """Return the cells for `SUMMARY`, with the variable first: the distribution of each value over the rings."""
    values: dict[str, Callable[[RingRow], float]] = {
        "deviation to the right, mm": lambda row: 1e3 * abs(row.place.right.value) if row.place else math.nan,
        "deviation up, mm": lambda row: 1e3 * abs(row.place.up.value) if row.place else math.nan,
        "radius from the design's, mm": lambda row: 1e3 * abs(_radius(row) - surveyed.diameter / 2.0),
        "ovality, ‰": lambda row: _ovality(row, surveyed.diameter)[0],
    }
    for name, value in values.items():
        sizes = [(value(row), row.name) for row in surveyed.rows if row.ring is not None]
        known = [(size, ring) for size, ring in sizes if math.isfinite(size)]
        if known:
            middle, most = np.percentile([size for size, _ in known], [50, 95])
            yield name, str(len(known)), f"{middle:.1f}", f"{most:.1f}", f"{max(known)[0]:.1f}", max(known)[1]


_MAIN = ("x", "y", "z", "chainage", "deviation_right", "deviation_up", "radius", "ovality")
_CIRCLE = ("circle_x", "circle_y", "circle_z", "circle_radius")
_FIRST = (*_MAIN, *(f"{name}_se" for name in _MAIN))


def _first(row: RingRow, diameter: float) -> Iterator[tuple[str, Value]]:
    if row.ring is None:
        return
    ellipse = row.ring.adjustment.ellipse
    spread = np.sqrt(np.diag(row.ring.centre_covariance))
    for name, value, se in zip("xyz", row.ring.centre, spread, strict=True):
        yield from _pair(name, value, se, _METRES)
    if row.place is not None:
        yield from _pair("chainage", row.place.chainage.value, row.place.chainage.se, _METRES)
        yield from _pair("deviation_right", row.place.right.value, row.place.right.se, _SMALL)
        yield from _pair("deviation_up", row.place.up.value, row.place.up.se, _SMALL)
    yield from _pair("radius", ellipse.radius, math.sqrt(ellipse.covariance[2, 2]), _SMALL)
    yield from _pair("ovality", *_ovality(row, diameter), _PERMILLE)


def _circle(row: RingRow) -> dict[str, Value]:
    """Return the best-fit circle of all points: centre in the frame of the points, and radius, m."""
    if row.ring is None:
        return dict.fromkeys(_CIRCLE)
    size = _rounded(row.ring.circle[2], _SMALL)
    return dict(zip(_CIRCLE, (*(_rounded(value, _METRES) for value in row.ring.circle_centre), size), strict=True))


def _radius(row: RingRow) -> float:
    return math.nan if row.ring is None else row.ring.adjustment.ellipse.radius


def _ovality(row: RingRow, diameter: float) -> tuple[float, float]:
    """Return largest minus smallest diameter over the design diameter, and its standard error, ‰; NaN for a circle."""
    if row.ring is None or not row.ring.is_ellipse:
        return math.nan, math.nan
    ellipse = row.ring.adjustment.ellipse
    share = 4.0 * PERMILLE / diameter
    return share * ellipse.flattening, share * ellipse.flattening_se


def _empty_rest(orders: int, chords: Sequence[Chord]) -> Iterator[tuple[str, Value]]:
    """Return the columns after the first ones, in their order."""
    names = ["diameter_largest", "diameter_smallest", "largest_clock"]
    plain = ["model", "sigma", "gap"]
    for name in names:
        yield from ((name, None), (f"{name}_se", None))
    for order in range(2, orders + 1):
        yield from ((f"harmonic_{order}", None), (f"harmonic_{order}_se", None), (f"harmonic_{order}_clock", None))
    for name in ("inward", "outward"):
        yield from ((name, None), (f"{name}_se", None), (f"{name}_clock", None))
    for chord, _, _ in chords:
        yield from ((chord, None), (f"{chord}_se", None))
    for name in ("turn_right", "turn_up"):
        yield from ((name, None), (f"{name}_se", None))
    yield from ((name, None) for name in plain)


def _rest(row: RingRow, orders: int, chords: Sequence[Chord]) -> Iterator[tuple[str, Value]]:
    ring = row.ring
    if ring is None:
        return
    ellipse = ring.adjustment.ellipse
    if ring.is_ellipse:
        for name, semi, se in zip(("diameter_largest", "diameter_smallest"), ellipse.axes, ellipse.axes_se, strict=True):
            yield from _pair(name, 2.0 * semi, 2.0 * se, _SMALL)
        yield from _pair("largest_clock", ellipse.direction, ellipse.direction_se, _DEGREES)
        for order in range(2, orders + 1):
            size, se, clock = ring.harmonics.amplitude(order)
            yield from _pair(f"harmonic_{order}", size, se, _SMALL)
            yield f"harmonic_{order}_clock", _rounded(clock, _DEGREES)
    for name, departure in (("inward", ring.inward), ("outward", ring.outward)):
        yield from _pair(name, departure.size, departure.size_se, _SMALL)
        yield f"{name}_clock", _rounded(departure.clock, _DEGREES)
    for chord, first, second in chords:
        yield from _pair(chord, *ring.harmonics.chord(first, second), _SMALL)
    if row.place is not None:
        yield from _pair("turn_right", row.place.turn_right.value, row.place.turn_right.se, _TURN)
        yield from _pair("turn_up", row.place.turn_up.value, row.place.turn_up.se, _TURN)
    yield from (("model", "ellipse" if ring.is_ellipse else "circle"), ("sigma", _rounded(ring.adjustment.sigma, _SMALL)))
    yield "gap", _rounded(ring.gap, 1)


def _pair(name: str, value: float, se: float, decimals: int) -> Iterator[tuple[str, Value]]:
    known = math.isfinite(value)
    yield name, _rounded(value, decimals)
    yield f"{name}_se", _rounded(se, decimals + 1 if decimals < _SMALL else decimals) if known else None


def _rounded(value: float, decimals: int) -> float | None:
    return round(float(value), decimals) if math.isfinite(value) else None
