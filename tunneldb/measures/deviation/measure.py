"""Deviation of a survey's lining from its design profiles, kilometre by kilometre."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Bool, Float
from tunneldb.classification.classes import PointClass
from tunneldb.geometry.alignment import Alignment
from tunneldb.geometry.stationing import KILOMETRE
from tunneldb.geometry.surface import Surface
from tunneldb.measures.deviation.compute import section_deviation
from tunneldb.measures.deviation.rows import (
    STEP,
    Step,
    deviation_inputs,
    load_offsets,
    replace_image,
    save_steps,
    stale_kilometres,
)
from tunneldb.raster.geotiff import Raster
from tunneldb.shape.profile import Deviation, Stretch, deviation
from tunneldb.stages.on_demand import Begin, measure_kilometres, refuse_beyond, refuse_stale
from tunneldb.stages.run import nothing_yet
from tunneldb.store.design import load_design
from tunneldb.store.scene import load_scene
from tunneldb.store.surface import load_alignment, load_surface, survey_ends
from tunneldb.store.survey import Survey

STATIONS = 1.0
"""Stations of the given axis are so close, m: between them its curve is followed to 0.01 mm."""

_ARM = 5.0  # m from the axis, where the planes of the measured axis are held against those of the given one


@dataclass(frozen=True)
class Design:
    """What a kilometre is held against: its surface, the given axis, and the profiles about that."""

    surface: Surface
    axis: Alignment
    stretches: Sequence[Stretch]

    def places(self, chainage: Float, arc: Float, offset: Raster) -> tuple[Float, Float, Float]:
        """Chainage along the given axis (c,), and where pixels lie about it, right and up, both (c, r), m.

        The planes of the measured axis and of the given one differ by fractions of a degree: of each column the place of three
        points is worked out, and that of all others is linear between them.
        """
        right, up = self.surface.section_points(chainage, arc, offset.values)
        origin, _, to_right, upwards = np.moveaxis(self.surface.frames(chainage), 1, 0)
        held = np.isfinite(origin[:, 0])
        moved = np.full((3, len(chainage), 3), np.nan)
        for k, points in enumerate((origin, origin + _ARM * to_right, origin + _ARM * upwards)):
            moved[k, held] = self.axis.across(points[held])
        base, by_right, by_up = moved[0], (moved[1] - moved[0]) / _ARM, (moved[2] - moved[0]) / _ARM
        placed = [base[:, k, None] + by_right[:, k, None] * right + by_up[:, k, None] * up for k in (1, 2)]
        return base[:, 0], placed[0], placed[1]

    def deviation(self, offset: Raster, lining: Bool) -> tuple[Float, Deviation]:
        """Chainage along the given axis of the columns of a block, and deviation of its pixels of lining, (c, r)."""
        chainage, arc = offset.places()
        shown = replace(offset, values=np.where(lining, offset.values, np.float32(np.nan)))
        along, right, up = self.places(chainage, arc, shown)
        found = Deviation(*(np.full(right.shape, np.nan) for _ in range(3)))
        for stretch in self.stretches:
            held = np.flatnonzero((along >= stretch.low) & (along < stretch.high))
            if len(held):
                part = deviation(stretch, along[held], right[held], up[held])
                found.distance[held], found.share[held], found.curvature[held] = part.distance, part.share, part.curvature
        return along, found


def measure_deviation(
    conn: psycopg.Connection[Any],
    survey: Survey,
    layer: str,
    low: float,
    high: float,
    begin: Begin,
) -> list[int]:
    """Bring the deviation of the kilometres of a stretch up to date, each in a transaction of its own; return which were.

    Parameters
    ----------
    conn : Connection
        Idle.
    layer : str
        Layer of the profiles.
    low, high : float
        Chainage, m.
    begin : callable
        See `tunneldb.stages.on_demand.Begin`.

    Raises
    ------
    UserError
        If the layer has no profile, or the survey no offset image where it has one.
    """
    refuse_beyond(conn, survey, low, high)
    there = measurable_kilometres(conn, survey, layer, low, high)

    def measure(km: int) -> dict[str, Any]:
        steps, note = _kilometre(conn, survey, km, layer)
        save_steps(conn, survey, km, layer, steps)
        sums = {
            "steps": len(steps),
            "overbreak": sum(step.figures.overbreak * (step.high - step.low) for step in steps),
            "underbreak": sum(step.figures.underbreak * (step.high - step.low) for step in steps),
        }
        return {**sums, "note": note} if note else sums

    return measure_kilometres(
        conn, survey, "deviation", [km for km, why in there.items() if why is not None],
        lambda km: deviation_inputs(conn, survey, km, layer), measure, f"deviation of {survey.name}", begin,
    )  # fmt: skip


def measurable_kilometres(
    conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float
) -> dict[int, str | None]:
    """Kilometres of a stretch that can be held against a layer, and why each has to be; None of those that are up to date.

    Raises
    ------
    UserError
        As `measure_deviation` does.
    """
    load_design(conn, survey.tunnel_id, survey.tunnel, layer)
    there = stale_kilometres(conn, survey, layer, low, high)
    conn.rollback()
    if not there:
        raise nothing_yet(conn, survey, f"has no offset image where layer {layer} has a profile")
    refuse_stale(there, survey.name, "deviation")
    return there


def load_design_of(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str) -> Design:
    """Load what a kilometre is held against."""
    return Design(
        load_surface(conn, survey, km * KILOMETRE, (km + 1) * KILOMETRE),
        load_alignment(conn, survey, STATIONS),
        load_design(conn, survey.tunnel_id, survey.tunnel, layer),
    )


def deviation_blocks(
    conn: psycopg.Connection[Any], survey: Survey, km: int, design: Design
) -> Iterator[tuple[Raster, Float, Deviation]]:
    """Blocks of a kilometre: the offset image, chainage of its columns along the given axis, deviation of its pixels."""
    classes: Callable[[Raster], Bool] | None = None
    for offset, lining in load_offsets(conn, survey, km):
        if lining is None:
            classes = classes or lining_by_class(conn, survey, km, design.surface)
            lining = classes(offset)
        yield offset, *design.deviation(offset, lining)


def _kilometre(conn: psycopg.Connection[Any], survey: Survey, km: int, layer: str) -> tuple[list[Step], str | None]:
    design = load_design_of(conn, survey, km, layer)
    ends = survey_ends(conn, survey) or (-np.inf, np.inf)
    steps: list[Step] = []

    def images() -> Iterator[Raster]:
        for offset, along, found in deviation_blocks(conn, survey, km, design):
            steps.extend(block_steps(design.stretches, offset, along, found, ends))
            yield Raster(np.ascontiguousarray(found.distance.T, np.float32), offset.transform)

    replace_image(conn, survey, km, layer, images())
    states = conn.execute(
        "SELECT EXISTS (SELECT FROM tunnel.image WHERE survey_id = %s AND km = %s AND kind = 'state')", [survey.id, km]
    ).fetchone()
    assert states is not None
    note = None if states[0] else "no intensity: what is lining is told by the classes of stage ground, which keep thin cables"
    return steps, note


def block_steps(
    stretches: Sequence[Stretch], offset: Raster, along: Float, found: Deviation, ends: tuple[float, float]
) -> Iterator[Step]:
    """Figures of the steps of a block, cut where the survey, or a profile, begins or ends."""
    pixel, west = offset.transform.a, offset.transform.c
    chainage, _ = offset.places()
    number = np.floor((chainage - west) / STEP)
    for first, stop in pairwise(np.flatnonzero(np.diff(number, prepend=-1.0, append=-1.0)).tolist()):
        here = slice(first, stop)
        begin = west + STEP * float(number[first])
        for stretch in stretches:
            held = (along[here] >= stretch.low) & (along[here] < stretch.high)
            held &= (chainage[here] >= ends[0]) & (chainage[here] <= ends[1])
            if not held.any():
                continue
            k = first + np.flatnonzero(held)
            low, high = float(chainage[k[0]] - pixel / 2.0), float(chainage[k[-1]] + pixel / 2.0)
            low, high = max(low, begin), min(high, begin + STEP)
            part = Deviation(found.distance[k], found.share[k], found.curvature[k])
            outline = stretch.at(float(along[k].mean()))
            yield Step(stretch.name, round(low, 6), round(high, 6), section_deviation(part, outline, pixel))


def lining_by_class(conn: psycopg.Connection[Any], survey: Survey, km: int, surface: Surface) -> Callable[[Raster], Bool]:
    """What of an offset image is lining, by the classes of stage ``ground``: where no state of pixels is stored."""
    scene = load_scene(conn, survey, km, km)

    def lining(offset: Raster) -> Bool:
        chainage, arc = offset.places()
        row, column = np.nonzero(np.isfinite(offset.values))
        points = surface.to_space(chainage[column], arc[row], offset.values[row, column].astype(np.float64))
        held = np.isfinite(points[:, 0])
        shown = np.zeros(offset.values.shape, np.bool_)
        shown[row[held], column[held]] = scene.classes(points[held]) == PointClass.LINING
        return shown

    return lining
