"""Measures of one ring of a scanned lining: shape, seen share, chords, lip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.measures.rings.compute.joint_steps import MARGIN, Lip, greatest_lip
from tunneldb.measures.rings.compute.patches import Patches, row_medians, straightened
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.shape.departures import clock_of
from tunneldb.shape.rings import MIN_POINTS, Ring, RingRefusedError, fit_ring

MAX_DEPARTURE_SHARE = 0.03
"""Maximum departure of a tenth of a ring from its ellipse, as a share of the radius; beyond it centre and radius mean nothing.
Lining squeezed to the limit departs by less: 2 % is usual, mostly ovality."""

CHORD_REACH = 3.0
"""Half-width of the window around a clock position whose median is the end of a chord, °."""

_MIN_END_ROWS = 4  # rows
_MEDIAN_ERROR = 1.2533  # standard error of a median relative to that of a mean


@dataclass(frozen=True)
class RingChord:
    """Chord between two clock positions, °; length and standard error in m, NaN if an end is not seen."""

    clock_from: float
    clock_to: float
    length: float
    se: float


@dataclass(frozen=True)
class LiningRing:
    """Measures of a ring.

    Attributes
    ----------
    seen_share : float
        Seen share of the rows of arc that the lining covers, 0 to 1.
    ring : Ring or None
        Shape; None if there is none.
    lip : Lip or None
        Greatest lip; None if none is significant.
    chords : tuple of RingChord
        The requested chords.
    remark : str
        Reason for a missing shape, or a remark on it; may be empty.
    """

    seen_share: float
    ring: Ring | None
    lip: Lip | None
    chords: tuple[RingChord, ...]
    remark: str


def measure_ring(
    patches: Patches, low: float, high: float, girth: float, chords: Sequence[tuple[float, float]] = (), orders: int = 6
) -> LiningRing:
    """Measure a ring.

    Parameters
    ----------
    patches : Patches
        Patches of the ring; more are allowed.
    low, high : float
        Chainage of its joints, m.
    girth : float
        Length of its whole section, floor included, m.
    chords
        Clock positions of the ends of each chord, °.
    orders : int
        Number of harmonics of the radius.
    """
    own = patches.between(low + MARGIN, high - MARGIN)
    places = row_medians(straightened(own)) if len(own.chainage) else np.full((len(own.arc), 2), np.nan)
    seen = np.isfinite(places[:, 0])
    side = float(np.median(np.diff(own.arc))) if len(own.arc) > 1 else 0.0
    share = min(float(seen.sum()) * side / girth, 1.0) if girth > 0.0 else 0.0
    if seen.sum() < MIN_POINTS:
        none = tuple(RingChord(*chord, np.nan, np.nan) for chord in chords)
        return LiningRing(share, None, None, none, "lining not seen")
    points = places[seen]
    ring, remark = _shape(points, orders)
    middle = ring.adjustment.ellipse.centre if ring is not None else 0.5 * (points.min(axis=0) + points.max(axis=0))
    measured = tuple(_chord(points, middle, *chord) for chord in chords)
    return LiningRing(share, ring, greatest_lip(places, own.arc), measured, remark)


def _shape(points: Float, orders: int) -> tuple[Ring | None, str]:
    try:
        ring = fit_ring(points, orders=orders)
    except RingRefusedError as refused:
        return None, str(refused)
    off = float(np.quantile(np.abs(ring.adjustment.distance), 0.9))
    radius = ring.adjustment.ellipse.radius
    if off > MAX_DEPARTURE_SHARE * radius:
        return None, f"not round: a tenth of it departs by more than {1e3 * off:.0f} mm from an ellipse"
    return (
        ring,
        "" if ring.is_ellipse else f"ellipse not determined (a gap of {ring.gap:.0f}°): centre and radius are from a circle",
    )


def _chord(points: Float, middle: Float, first: float, second: float) -> RingChord:
    """Return the chord between the lining's places at two clock positions about a middle."""
    clock, radius = clock_of(points, middle), np.linalg.norm(points - middle, axis=1)
    ends, errors = [], []
    for position in (first, second):
        near = np.abs((clock - position + 180.0) % 360.0 - 180.0) <= CHORD_REACH
        if near.sum() < _MIN_END_ROWS:
            return RingChord(first, second, np.nan, np.nan)
        away = float(np.median(radius[near]))
        scatter = MAD_TO_SIGMA * float(np.median(np.abs(radius[near] - away)))
        turn = np.radians(position)
        ends.append(away * np.array([np.sin(turn), np.cos(turn)]))
        errors.append(_MEDIAN_ERROR * scatter / np.sqrt(near.sum()))
    span = ends[0] - ends[1]
    length = float(np.linalg.norm(span))
    along = [abs(float(end @ span)) / (float(np.linalg.norm(end)) * length) for end in ends]
    return RingChord(first, second, length, float(np.hypot(along[0] * errors[0], along[1] * errors[1])))
