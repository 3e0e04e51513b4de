"""The axis of a tunnel, found from its points alone, or along a line drawn in plan.

The plan of what is roofed over gives the way (`tunneldb.alignment.footprint`; Kang et al., 2014); sections across it are then
centred again and again (`tunneldb.alignment.section_centres`), and the line through their centres is smoothed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Polynomial
from scipy.spatial import cKDTree

from tunneldb.alignment.footprint import (
    CLEARANCE,
    Footprint,
    branches,
    half_width,
    largest_group,
    longest_path,
    roofed_parts,
    without_side_rooms,
)  # fmt: skip
from tunneldb.alignment.section_centres import Centres, Frames, place_points, roof_ends, section_centres, vault_gap
from tunneldb.arrays import Bool, Float, Int64
from tunneldb.errors import InputError
from tunneldb.geometry.centreline import SHORT, ends_by_projection
from tunneldb.geometry.smoothing import smooth_line

STEP = 5.0
"""Distance between sections, m; of a short tunnel less."""

_SECTIONS = 12  # of a short tunnel
_PASSES = 6
_FEWEST = 4  # whole sections in a row that make a tunnel
_LEAST = 0.2  # share of the sections that must be whole at any time
_BLOCK = 6.0  # m, in which a scan is about as dense
_HAZE = 0.01  # share of the lining's points in a voxel, below which it is in the air
_LONE = 1.5  # m about a point within which others lie, or it is a stray one
_COMPANY = 5  # others
_OTHER_PART = 0.2  # share of the largest part from which another one may be meant
_GAP = 30.0  # m without a whole section, over which the line is carried
_BEYOND = 15.0  # m by which the line is drawn on to the end of the lining
_BENT = 8  # sections whose bend a line is drawn on with
_OTHER_SIZE = 0.25  # share of the tunnel's width or height by which a section at its end differs from those inside
_HIGHEST = 0.6  # share of the height above the middle up to which there is vault; a portal's face goes on
_WRONG = 0.5  # m from the line, for a section to be pointed out
_COURSE = 3.0  # m about a line in plan, whose points tell how high it runs


@dataclass(frozen=True)
class FoundAxis:
    """An axis found from points, with what tells how good it is.

    Attributes
    ----------
    xyz : (k, 3) float array
        Vertices, m.
    whole : (m,) bool array
        Of each section, whether both walls, vault and floor were seen.
    away : (m,) float array
        Distance of the section's own centre from the line, m; NaN where it isn't whole.
    distance : (m,) float array
        Distance of each section along the line in plan, m.
    width, height : float
        Of the tunnel, medians, m.
    points : (n, 3) float array
        The points it was found from, m.
    aside : float
        Share of what has a roof that lies beside the line or beyond its ends, farther than the tunnel's width.
    aside_at : (2,) float array or None
        Middle of the largest piece of that, m.
    """

    xyz: Float
    whole: Bool
    away: Float
    distance: Float
    width: float
    height: float
    points: Float
    aside: float = 0.0
    aside_at: Float | None = None

    @property
    def length(self) -> float:
        """Length in plan, m."""
        return float(np.hypot(*np.diff(self.xyz[:, :2], axis=0).T).sum())

    @property
    def doubtful(self) -> list[tuple[float, float]]:
        """Stretches (m along the line) of two sections or more that aren't whole or lie half a metre off."""
        bad = np.concatenate([[False], ~self.whole | (self.away > _WRONG), [False]])
        first, stop = np.flatnonzero(bad[1:] & ~bad[:-1]), np.flatnonzero(~bad[1:] & bad[:-1])
        return [(float(self.distance[a]), float(self.distance[b - 1])) for a, b in zip(first, stop, strict=True) if b - a > 1]

    def reversed(self) -> FoundAxis:
        """Return the axis the other way."""
        distance = (self.length - self.distance)[::-1]
        return replace(self, xyz=self.xyz[::-1], whole=self.whole[::-1], away=self.away[::-1], distance=distance)


def without_haze(points: Float, counts: Int64) -> Float:
    """Leave out voxels in the air that hold but a few of a dense scan's points: stray echoes.

    Parameters
    ----------
    points : (n, 3) float array
        Centroids of voxels, m.
    counts : (n,) int array
        Points in each.

    Returns
    -------
    Those that hold 1 % or more of what nine in ten of the voxels within their cube of 6 m hold at most, m.
    """
    block = np.unique(np.floor(points / _BLOCK).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    order = np.lexsort((counts, block))
    first, held = np.unique(block[order], return_index=True, return_counts=True)[1:]
    dense = counts[order][first + np.floor(0.9 * (held - 1)).astype(np.int64)]
    return points[counts >= _HAZE * dense[block]]


def find_axis(points: Float) -> FoundAxis:
    """Find the axis of the one tunnel in a cloud, from its end farther west.

    Parameters
    ----------
    points : (n, 3) float array
        m, spread evenly, such as the centroids of voxels of half a metre.

    Raises
    ------
    InputError
        If nothing in the cloud has a roof, two walls and a floor; if there are two tunnels, or one that forks.
    """
    points = _without_stray(points)
    origin = np.floor(np.median(points, axis=0)) if len(points) else np.zeros(3)
    local = points - origin
    parts = roofed_parts(local)
    if not parts:
        raise InputError(f"no tunnel: nowhere do points have others {CLEARANCE:g} m or more above them, as a floor has a vault")
    if len(parts) > 1 and parts[1].area > _OTHER_PART * parts[0].area:
        raise InputError(
            "the tunnel lies in parts that don't hang together, or there are several: "
            + "; ".join(f"{part.area:.0f} m² about {_place(part.cells.mean(axis=0) + origin[:2])}" for part in parts[:4])
            + "; give the files of one, or draw its line and give that with the files"
        )
    part = without_side_rooms(parts[0])
    path = longest_path(part)
    half = half_width(part, path)
    forks = branches(part, path)
    if len(forks):
        raise InputError(
            f"the tunnel forks: what lies about {_place(forks[0] + origin[:2])} is as wide as the rest; give the files of one "
            "tube, or draw its line and give that with the files"
        )
    near = local[cKDTree(part.cells).query(local[:, :2])[0] <= half + part.edge]
    way = part.cells[path]
    if _length(way) < SHORT:
        way = ends_by_projection(near)
    found = _through_sections(local, way, half, extend=True)
    found = found if found.xyz[0, 0] <= found.xyz[-1, 0] else found.reversed()
    return _moved(_with_the_rest(found, np.vstack([part.cells for part in parts]), part.edge), origin)


def follow_line(points: Float, plan: Float) -> FoundAxis:
    """Find the axis of the tunnel along a line drawn in its plan; it keeps the line's ends and direction.

    Parameters
    ----------
    points : (n, 3) float array
        As of `find_axis`.
    plan : (k, 2) float array
        The line, m; inside the tunnel all along.

    Raises
    ------
    InputError
        If there are no points along it, or no sections of a tunnel.
    """
    points = _without_stray(points)
    origin = np.append(np.floor(plan[0]), np.floor(np.median(points[:, 2])) if len(points) else 0.0)
    local, way = points - origin, plan - origin[:2]
    parts = _crossed(roofed_parts(local), way)
    if not parts:
        raise InputError(
            f"no points of a tunnel along the line from {_place(plan[0])} to {_place(plan[-1])}: is it of the same place?"
        )
    half = max(float(part.depth[cKDTree(part.cells).query(way)[1]].mean()) for part in parts)
    return _moved(_through_sections(local, way, half, extend=False), origin)


def _with_the_rest(found: FoundAxis, cells: Float, edge: float) -> FoundAxis:
    """Say how much of what has a roof, in cells (n, 2) of the plan, is not along the line."""
    along = _at_even_distances(found.xyz[:, :2], edge)
    rest = cells[cKDTree(along).query(cells)[0] > max(found.width, STEP)]
    return replace(found, aside=len(rest) / len(cells), aside_at=largest_group(rest, edge).mean(axis=0) if len(rest) else None)


def _crossed(parts: list[Footprint], way: Float) -> list[Footprint]:
    """Parts of the footprint that a line runs through."""
    even = _at_even_distances(way, 1.0)
    return [part for part in parts if (cKDTree(part.cells).query(even)[0] < part.edge).mean() > _OTHER_PART]


def _through_sections(points: Float, way: Float, half: float, extend: bool) -> FoundAxis:
    """Line through the centres of sections across a way (k, 2) in plan, in a tunnel of a half-width (m).

    It is extended to where the vault ends, or ends where the way does.
    """
    step = min(STEP, _length(way) / _SECTIONS)
    even = _at_even_distances(way, step)
    line = np.column_stack([even, _mid_heights(points, even)])
    line = smooth_line(line, np.ones(len(line), dtype=bool))
    reach = max(3.0 * half, 8.0)
    for turn in range(_PASSES):
        line, centres, raw = _centred(points, line, reach)
        if extend and turn >= _PASSES // 2:
            line = line[_inside(centres, max(round(_GAP / step), 1))]
        line = _at_even_distances(line, step)
    line, centres, raw = _centred(points, line, reach)
    ends, distance = line, _distances(line)
    if extend:
        ends = _to_the_ends(points, line, reach, float(np.nanmedian(centres.height)))
        distance = distance + float((line[0, :2] - ends[0, :2]) @ Frames.along(line).ahead[0, :2])
    away = np.linalg.norm(raw - line, axis=1)
    width, height = (float(np.nanmedian(values)) for values in (centres.width, centres.height))
    near = points[place_points(points, Frames.along(line), reach + _BEYOND).station >= 0]
    return FoundAxis(ends, centres.whole, np.where(centres.whole, away, np.nan), distance, width, height, near)


def _centred(points: Float, line: Float, reach: float) -> tuple[Float, Centres, Float]:
    """The line moved to the centres of its sections, smooth; these, and where their own centres lie."""
    frames = Frames.along(line)
    spacing = float(np.median(np.diff(_distances(line))))
    placed = place_points(points, frames, reach)
    centres = section_centres(placed, len(line), 0.5 * spacing + 0.25)
    _require_tunnel(centres.whole)
    shift = np.nan_to_num(centres.right)[:, None] * frames.right + np.nan_to_num(centres.up)[:, None] * frames.up
    first, *_, last = np.flatnonzero(centres.whole)
    # beyond the tunnel the line keeps its course
    shift[:first], shift[last + 1 :] = shift[first], shift[last]
    seen = centres.whole.copy()
    seen[:first] = seen[last + 1 :] = True
    raw = line + shift
    return smooth_line(raw, seen), centres, raw


def _require_tunnel(whole: Bool) -> None:
    count = int(whole.sum())
    if count < _FEWEST or count < _LEAST * len(whole):
        raise InputError(
            f"no tunnel: of {len(whole)} sections across what has a roof {count} have two walls, a vault and a floor"
        )


def _inside(centres: Centres, gap: int) -> slice:
    """The longest run of whole sections, with gaps of so many sections at most, without ends of another size.

    Before a portal its face and the cut's slopes may make a section, but one larger than the tunnel.
    """
    rows = np.flatnonzero(centres.whole)
    cuts = np.flatnonzero(np.diff(rows) > gap)
    firsts, lasts = rows[np.append(0, cuts + 1)], rows[np.append(cuts, len(rows) - 1)]
    best = int(np.argmax(lasts - firsts))
    rows = rows[(rows >= firsts[best]) & (rows <= lasts[best])]
    if len(rows) < _FEWEST:
        raise InputError("no tunnel: sections with two walls, a vault and a floor lie too far apart")
    usual = np.ones(len(rows), dtype=bool)
    for size in (centres.width[rows], centres.height[rows]):
        usual &= np.abs(size / np.median(size) - 1.0) <= _OTHER_SIZE
    kept = rows[usual]
    return slice(int(kept[0]), int(kept[-1]) + 1) if len(kept) > len(rows) // 2 else slice(int(rows[0]), int(rows[-1]) + 1)


def _to_the_ends(points: Float, line: Float, reach: float, height: float) -> Float:
    """The line, its last sections left out, drawn on to where the lining ends, at most 15 m, bent as before."""
    inner = line[1:-1]
    frames = Frames.along(inner)
    placed = place_points(points, frames, reach + _BEYOND)
    lining = placed.at(placed.up <= _HIGHEST * height)
    gap = vault_gap(lining, _distances(inner))
    first, last = (min(roof_ends(lining, station, way, gap), _BEYOND) for station, way in ((0, -1.0), (len(inner) - 1, 1.0)))
    half = 0.5 * float(np.hypot(*(line[1, :2] - line[0, :2])))
    begin, end = _drawn_on(inner[::-1], first)[::-1], _drawn_on(inner, last)
    return np.vstack([begin, inner[int(first < half) : len(inner) - int(last < half)], end])


def _drawn_on(line: Float, length: float) -> Float:
    """Vertices (k, 3) beyond the end of a line, on the parabola through its last sections."""
    tail = line[-_BENT:]
    distance = _distances(tail)
    at = distance[-1] + np.linspace(0.0, length, 1 + max(round(length / STEP), 1))[1:]
    bend = 2 if len(tail) == _BENT else 1
    fits = [Polynomial.fit(distance, column, degree) for column, degree in zip(tail.T, (bend, bend, 1), strict=True)]
    return np.column_stack([tail[-1, k] + fit(at) - fit(distance[-1]) for k, fit in enumerate(fits)])


def _mid_heights(points: Float, plan: Float) -> Float:
    """Height halfway between the lowest and the highest points about places (k, 2) of the plan, m; smooth where none are."""
    near = cKDTree(points[:, :2]).query_ball_point(plan, _COURSE)
    height = np.array([np.quantile(points[rows, 2], (0.05, 0.95)).mean() if len(rows) else np.nan for rows in near])
    known = np.isfinite(height)
    if not known.any():
        raise InputError("no points lie along the line: are line and scan of one place?")
    at = np.arange(len(plan))
    return np.interp(at, at[known], height[known])


def _at_even_distances(line: Float, step: float) -> Float:
    """A line (k, 2 or 3) with vertices at even distances in plan, about a step apart, m."""
    distance = _distances(line)
    parts = max(round(float(distance[-1]) / step), 1)
    at = np.linspace(0.0, distance[-1], parts + 1)
    return np.column_stack([np.interp(at, distance, column) for column in line.T])


def _distances(line: Float) -> Float:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line[:, :2], axis=0).T))])


def _length(line: Float) -> float:
    return float(_distances(line)[-1])


def _without_stray(points: Float) -> Float:
    """Leave out points that are not finite or that have hardly any others about them."""
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return points
    company: Int64 = cKDTree(points).query_ball_point(points, _LONE, return_length=True)
    return points[company > _COMPANY]


def _moved(found: FoundAxis, by: Float) -> FoundAxis:
    aside = None if found.aside_at is None else found.aside_at + by[:2]
    return replace(found, xyz=found.xyz + by, points=found.points + by, aside_at=aside)


def _place(plan: Float) -> str:
    return f"{plan[0]:.0f},{plan[1]:.0f}"
