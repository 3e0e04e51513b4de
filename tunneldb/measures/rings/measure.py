"""Rings of a survey's lining: defined by length, by a file or by their joints, and measured kilometre by kilometre."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.csvfile import read_csv
from tunneldb.errors import UserError
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.measures.deviation.compute import STATIONS
from tunneldb.measures.rings.compute.joint_steps import MARGIN, REACH, Steps, joint_steps
from tunneldb.measures.rings.compute.joints import Joints, NoRingsError, column_signals, follow, peaks, ring_length, strength
from tunneldb.measures.rings.compute.lining_ring import LiningRing, measure_ring
from tunneldb.measures.rings.lining_patches import LiningPatches, load_images
from tunneldb.measures.rings.rows import (
    MeasuredRing,
    RingBounds,
    length_before,
    load_bounds,
    save_definition,
    save_rings,
)
from tunneldb.progress import StartProgress
from tunneldb.raster.state import shows_lining
from tunneldb.shape.circle import taubin
from tunneldb.shape.profile import Profile
from tunneldb.stages.on_demand import measure_kilometres, refuse_beyond
from tunneldb.stages.run import nothing_yet
from tunneldb.stages.stale import Result, refuse_blocked, result_states
from tunneldb.store.design import load_profiles
from tunneldb.store.images import survey_blocks
from tunneldb.store.surface import load_alignment, survey_ends
from tunneldb.store.survey import Survey

MIN_LENGTH, MAX_LENGTH = 0.3, 20.0
"""Limits of a ring's length, m."""

_ROUND = 0.002  # m: so near to one circle lies each point of a profile that is one


@dataclass(frozen=True)
class RingOptions:
    """Options of the measurement of rings.

    Attributes
    ----------
    diameter : float or None
        Design diameter, m; None: that of a circular profile, else the ring's own.
    chords : tuple of (float, float)
        Clock positions of the ends, °.
    """

    diameter: float | None = None
    chords: tuple[tuple[float, float], ...] = ()

    @property
    def plain(self) -> dict[str, Any]:
        """Options as the ledger keeps them."""
        return {"diameter": self.diameter, "chords": [list(chord) for chord in self.chords]}


def rings_by_length(conn: psycopg.Connection[Any], survey: Survey, length: float, start: float | None) -> list[RingBounds]:
    """Return whole rings of one length between the ends of a survey; a joint is at ``start``, else at its beginning."""
    low, high = _ends(conn, survey)
    first = low if start is None else start + length * np.ceil((low - start) / length - 1e-9)
    joints = np.asarray(first + length * np.arange(int((high - first) / length + 1e-9) + 1), dtype=np.float64)
    return _between(joints, survey)


def rings_of_file(conn: psycopg.Connection[Any], survey: Survey, path: Path) -> list[RingBounds]:
    """Read rings from a CSV file: number, chainage_from, chainage_to."""
    table = read_csv(path, ("number", "chainage_from", "chainage_to"))
    low, high = _ends(conn, survey)
    numbers = table["number"]
    for row, (begin, end) in enumerate(table.columns(("chainage_from", "chainage_to")).tolist()):
        if not MIN_LENGTH <= end - begin <= MAX_LENGTH:
            raise table.error(row, f"a ring must be {MIN_LENGTH:g} to {MAX_LENGTH:g} m long, not {end - begin:g}")
        if numbers[row] != round(numbers[row]) or abs(numbers[row]) > np.iinfo(np.int32).max:
            raise table.error(row, f"a ring's number must be whole, of at most nine digits, not {numbers[row]:g}")
    order = np.argsort(table["chainage_from"], kind="stable")
    over = np.flatnonzero(table["chainage_from"][order[1:]] < table["chainage_to"][order[:-1]] - 1e-6)
    if len(over):
        raise table.error(int(order[over[0] + 1]), f"ring {numbers[order[over[0] + 1]]:.0f} begins within the one before it")
    values, counts = np.unique(numbers, return_counts=True)
    if (counts > 1).any():
        raise UserError(f"{path}: ring {values[np.argmax(counts)]:.0f} occurs more than once")
    rings = [RingBounds(int(numbers[k]), float(table["chainage_from"][k]), float(table["chainage_to"][k])) for k in order]
    if not any(ring.high > low and ring.low < high for ring in rings):
        raise UserError(f"{path}: no ring is within survey {survey.name}, {low:.1f} to {high:.1f} m")
    return rings


def find_rings(conn: psycopg.Connection[Any], survey: Survey, begin: StartProgress) -> tuple[list[RingBounds], Joints]:
    """Find rings between the joints that the images show.

    Raises
    ------
    UserError
        If no ring length is found.
    """
    blocks = survey_blocks(conn, survey, "offset")
    if not blocks:
        raise nothing_yet(conn, survey, "has no offset image")
    advance = begin(f"joints of {survey.name}", len(blocks))
    places, weights = [], []
    for run in np.split(np.array(blocks), np.flatnonzero(np.diff(blocks) > 1) + 1):
        signals, start, pixel = _signals(conn, survey, run.tolist(), advance)
        at, weight = peaks(strength(signals, pixel), pixel)
        places.append(start + (at + 0.5) * pixel)
        weights.append(weight)
    where, weight = np.concatenate(places), np.concatenate(weights)
    try:
        found = follow(where, weight, ring_length(where, weight))
    except NoRingsError as refused:
        raise UserError(f"survey {survey.name}: rings not found: {refused}; give --length or --rings") from None
    states = np.where(found.seen, "seen", "missing").tolist()
    pairs = zip(found.chainage[:-1].tolist(), found.chainage[1:].tolist(), states[:-1], strict=True)
    return [RingBounds(k, low, high, state) for k, (low, high, state) in enumerate(pairs, 1)], found


def _signals(
    conn: psycopg.Connection[Any], survey: Survey, blocks: Sequence[int], advance: Callable[[float], None]
) -> tuple[Float, float, float]:
    """Return the signals of the columns of consecutive blocks, the chainage of their beginning, and the pixel, m."""
    parts: list[Float] = []
    start, pixel = 0.0, 0.0
    for block in blocks:
        images = load_images(conn, survey, block, ("offset", "corrected", "state"))
        offset, level = images["offset"], images.get("corrected")
        if not parts:
            start, pixel = offset.transform.c, offset.transform.a
        shown = shows_lining(images["state"].values) if "state" in images else np.isfinite(offset.values)
        blank = np.float32(np.nan)
        parts.append(
            column_signals(
                None if level is None else np.where(shown, level.values, blank), np.where(shown, offset.values, blank), pixel
            )
        )
        advance(1)
    return np.concatenate(parts, axis=1), start, pixel


def define_rings(conn: psycopg.Connection[Any], survey: Survey, rings: Sequence[RingBounds], origin: str) -> int:
    """Make these the rings of a survey, in one transaction; return how many are new."""
    with conn.transaction():
        return save_definition(conn, survey, rings, origin)


def measure_survey_rings(
    conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, options: RingOptions | None, begin: StartProgress
) -> list[int]:
    """Bring the rings of a stretch up to date, each kilometre in one transaction; return those that were made.

    Parameters
    ----------
    conn : Connection
        Idle.
    low, high : float
        Chainage, m.
    options : RingOptions or None
        None: those by which rings were measured last.
    begin : callable
        See `tunneldb.progress.StartProgress`.
    """
    refuse_beyond(conn, survey, low, high)
    result = Result(survey, "rings")
    states = result_states(conn, result)
    profiles = load_profiles(conn, survey.tunnel_id, "lining")
    axis = load_alignment(conn, survey, STATIONS)
    conn.rollback()
    last = {km: state.parameters.get("options", {}) for km, state in states.items() if state.parameters}
    usual = last[max(last)] if last else RingOptions().plain
    states = {km: state for km, state in states.items() if (km + 1) * KILOMETRE > low and km * KILOMETRE < high}
    refuse_blocked(states, survey.name, "rings")
    plain = {km: last.get(km, usual) if options is None else options.plain for km in states}

    def measure(km: int) -> dict[str, int]:
        rings = load_bounds(conn, survey, km)
        source = LiningPatches(conn, survey, km, axis)
        before = length_before(conn, survey, rings[0].low) if rings else 0.0
        measured = [_measured(source, ring, rings[k - 1] if k else before, plain[km], profiles) for k, ring in enumerate(rings)]
        save_rings(conn, survey, measured)
        return {"rings": len(rings), "fitted": sum(one.ring.ring is not None for one in measured)}

    return measure_kilometres(
        conn, result, states, lambda km: {"options": plain[km]}, measure, f"rings of {survey.name}", begin
    )


def _measured(
    source: LiningPatches, bounds: RingBounds, before: RingBounds | float, options: dict[str, Any], profiles: Sequence[Profile]
) -> MeasuredRing:
    length = bounds.high - bounds.low
    chords = [(float(first), float(second)) for first, second in options["chords"]]
    patches = source.between(bounds.low - REACH - MARGIN, bounds.high)
    middle = 0.5 * (bounds.low + bounds.high)
    diameter, diameter_from = _diameter(options["diameter"], profiles, middle)
    if patches is None or len(patches.chainage) < 2:
        nothing = np.empty(0)
        return MeasuredRing(
            bounds, LiningRing(0.0, None, None, (), "no image"), Steps(nothing, nothing, nothing), None, diameter_from
        )
    if isinstance(before, RingBounds):
        ahead = before.high - before.low if abs(before.high - bounds.low) < 1e-3 else 0.0
    else:
        ahead = before
    ring = measure_ring(patches, bounds.low, bounds.high, source.girth(middle), chords)
    centre = None if ring.ring is None else source.in_space(middle, *ring.ring.circle[:2].tolist())
    return MeasuredRing(bounds, ring, joint_steps(patches, bounds.low, ahead, length), diameter, diameter_from, centre)


def _diameter(given: float | None, profiles: Sequence[Profile], chainage: float) -> tuple[float | None, str]:
    """Return the design diameter at a chainage and its source; None for the ring's own."""
    if given is not None:
        return given, "option"
    for profile in profiles:
        if profile.chainage_from <= chainage <= profile.chainage_to:
            points = profile.outline.flattened()
            circle = taubin(points)
            if circle is not None and np.abs(np.linalg.norm(points - circle[:2], axis=1) - circle[2]).max() <= _ROUND:
                return 2.0 * float(circle[2]), "profile"
    return None, "ring"


def _ends(conn: psycopg.Connection[Any], survey: Survey) -> tuple[float, float]:
    ends = survey_ends(conn, survey)
    if ends is None:
        raise nothing_yet(conn, survey, "has no segments")
    return ends


def _between(joints: Float, survey: Survey) -> list[RingBounds]:
    if len(joints) < 2:
        raise UserError(f"survey {survey.name} is shorter than a ring")
    return [RingBounds(k, *pair) for k, pair in enumerate(zip(joints[:-1].tolist(), joints[1:].tolist(), strict=True), 1)]
