"""Control points from a file, and their differences from the target spheres of a survey."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.csvfile import read_csv, read_texts
from tunneldb.errors import UserError
from tunneldb.pipeline.targets import TargetObservation
from tunneldb.registration.control import Match, Motion, best_motion, match

SAME_PLACE = 0.001  # m


@dataclass(frozen=True)
class Control:
    """Control points.

    Attributes
    ----------
    names : list of str
        Their ids, each once.
    xyz : (n, 3) float64 array
        m.
    """

    names: list[str]
    xyz: Float


@dataclass(frozen=True)
class Comparison:
    """Spheres against control points.

    Attributes
    ----------
    control : Control
    numbers : (n,) int array
        Numbers of the spheres.
    centres : (n, 3) float64 array
        Their centres, of several scans the weighted mean, m.
    match : Match
        Pairs of places in `numbers` and in `control`.
    motion : Motion or None
        Motion of all spheres with a control point; None if none has one.
    scans : dict of int to (int, Motion)
        For each scan: number of its spheres with a control point, and their motion.
    """

    control: Control
    numbers: Int64
    centres: Float
    match: Match
    motion: Motion | None
    scans: dict[int, tuple[int, Motion]]


def read_control(path: Path) -> Control:
    """Read control points from a CSV file with the columns id,x,y,z.

    Raises
    ------
    UserError
        If it cannot be read, has no point, an id is missing or occurs twice, or two points are at one place; with file, line
        and value.
    """
    table = read_csv(path, ("x", "y", "z"))
    if len(table) == 0:
        raise UserError(f"{path} has no control point; it needs rows id,x,y,z")
    names = read_texts(path, "id")
    for row, name in enumerate(names):
        if not name:
            raise table.error(row, "id is empty")
        if name in names[:row]:
            raise table.error(row, f"id {name} is a duplicate (line {table.lines[names.index(name)]}); write each point once")
        near = np.flatnonzero(np.linalg.norm(table.values[:row] - table.values[row], axis=1) < SAME_PLACE)
        if len(near):
            raise table.error(row, f"point {name} is at the place of point {names[near[0]]} (line {table.lines[near[0]]})")
    return Control(names, table.columns(("x", "y", "z")))


def mean_centres(rows: list[TargetObservation]) -> tuple[Int64, Float]:
    """Return numbers (n,) of the spheres, and their centres (n, 3), averaged over scans with the fits' variance, m."""
    numbers = np.unique(np.array([row.number for row in rows], np.int64))
    centres = np.zeros((len(numbers), 3))
    for k, number in enumerate(numbers):
        chosen = [row.sphere for row in rows if row.number == number]
        first = chosen[0].centre
        weights = [1.0 / sphere.sigma**2 for sphere in chosen]
        centres[k] = first + np.average([sphere.centre - first for sphere in chosen], axis=0, weights=weights)
    return numbers, centres


def compare(rows: list[TargetObservation], control: Control, within: float) -> Comparison:
    """Compare spheres with control points, all together and by scan; ``within`` as in `tunneldb.registration.control.match`."""
    numbers, centres = mean_centres(rows)
    matched = match(centres, control.xyz, within)
    if len(matched.pairs) == 0:
        return Comparison(control, numbers, centres, matched, None, {})
    ours, theirs = matched.pairs.T
    point_of = dict(zip(numbers[ours].tolist(), theirs.tolist(), strict=True))
    scans = {}
    for scan in sorted({row.scan for row in rows}):
        seen = [row for row in rows if row.scan == scan and row.number in point_of]
        if seen:
            onto = control.xyz[[point_of[row.number] for row in seen]]
            scans[scan] = (len(seen), best_motion(np.array([row.sphere.centre for row in seen]), onto))
    return Comparison(control, numbers, centres, matched, best_motion(centres[ours], control.xyz[theirs]), scans)
