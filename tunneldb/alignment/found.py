"""Axis of a tunnel, found from its points only, or along a line drawn in plan.

The plan of the roofed area gives a path (`tunneldb.alignment.footprint`; Kang et al., 2014). Sections across it are
centred iteratively (`tunneldb.alignment.section_centres`), and the line through their centres is smoothed.
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
from tunneldb.geometry.centreline import MAX_SHORT_LENGTH, ends_by_projection
from tunneldb.geometry.smoothing import smooth_line

STEP = 5.0
"""Distance between sections, m; less for a short tunnel."""

_SECTIONS = 12  # sections of a short tunnel
_PASSES = 6
_MIN_CONSECUTIVE_SECTIONS = 4  # least number of consecutive complete sections of a tunnel
_MIN_COMPLETE_SHARE = 0.2  # least share of complete sections in each pass
_BLOCK = 6.0  # m; cube in which a scan has about the same density
_MIN_POINT_SHARE = 0.01  # share of the lining's points in a voxel, below which it is stray
_NEIGHBOUR_RADIUS = 1.5  # m; radius for neighbours of a point that is not stray
_MIN_NEIGHBOURS = 5  # number of these neighbours
_AMBIGUOUS_AREA_SHARE = 0.2  # share of the largest part's area from which another part is ambiguous
_MAX_GAP = 30.0  # m without a complete section, over which the line continues
_MAX_EXTENSION = 15.0  # m; greatest extension of the line to the end of the lining
_EXTENSION_SECTIONS = 8  # number of sections whose curvature is used for the extension
_MAX_SIZE_DIFFERENCE = 0.25  # relative difference in width or height of a section at an end from those inside
_VAULT_HEIGHT_SHARE = 0.6  # share of the height above the middle up to which there is vault; a portal's face continues above
_DOUBTFUL_DISTANCE = 0.5  # m from the line from which a section is reported
_COURSE_WIDTH = 3.0  # m around a line in plan, within which points give its height


@dataclass(frozen=True)
class FoundAxis:
    """Axis found from points, with measures of its quality.

    Attributes
    ----------
    xyz : (k, 3) float array
        Vertices, m.
    whole : (m,) bool array
        True for sections with both walls, vault and floor.
    away : (m,) float array
        Distance of the section's own centre from the line, m; NaN if it isn't complete.
    distance : (m,) float array
        Distance of each section along the line in plan, m.
    width, height : float
        Median size of the tunnel, m.
    points : (n, 3) float array
        Points from which it was found, m.
    off_line_share : float
        Share of the roofed area that is farther from the line or its ends than the tunnel's width.
    off_line_centre : (2,) float array or None
        Centre of the largest piece of that area, m.
    """

    xyz: Float
    whole: Bool
    away: Float
    distance: Float
    width: float
    height: float
    points: Float
    off_line_share: float = 0.0
    off_line_centre: Float | None = None

    @property
    def length(self) -> float:
        """Length in plan, m."""
        return float(np.hypot(*np.diff(self.xyz[:, :2], axis=0).T).sum())

    @property
    def doubtful(self) -> list[tuple[float, float]]:
        """Stretches (m along the line) of at least two sections that are incomplete or half a metre off the line."""
        bad = np.concatenate([[False], ~self.whole | (self.away > _DOUBTFUL_DISTANCE), [False]])
        first, stop = np.flatnonzero(bad[1:] & ~bad[:-1]), np.flatnonzero(~bad[1:] & bad[:-1])
        return [(float(self.distance[a]), float(self.distance[b - 1])) for a, b in zip(first, stop, strict=True) if b - a > 1]

    def reversed(self) -> FoundAxis:
        """Return the axis in the opposite direction."""
        distance = (self.length - self.distance)[::-1]
        return replace(self, xyz=self.xyz[::-1], whole=self.whole[::-1], away=self.away[::-1], distance=distance)


def without_haze(points: Float, counts: Int64) -> Float:
    """Remove voxels in the air with few of a dense scan's points: stray echoes.

    Parameters
    ----------
    points : (n, 3) float array
        Centroids of voxels, m.
    counts : (n,) int array
        Number of points in each voxel.

    Returns
    -------
    Centroids of voxels with at least 1 % of the 90th percentile of the counts within their cube of 6 m, m.
    """
    block = np.unique(np.floor(points / _BLOCK).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    order = np.lexsort((counts, block))
    first, sizes = np.unique(block[order], return_index=True, return_counts=True)[1:]
    dense = counts[order][first + np.floor(0.9 * (sizes - 1)).astype(np.int64)]
    return points[counts >= _MIN_POINT_SHARE * dense[block]]


def find_axis(points: Float) -> FoundAxis:
    """Find the axis of the only tunnel in a cloud, from its western end.

    Parameters
    ----------
    points : (n, 3) float array
        Evenly spread points, m, such as the centroids of voxels of half a metre.

    Raises
    ------
    InputError
        If nothing in the cloud has a roof, two walls and a floor, or if there are two tunnels or one that forks.
    """
    points = _without_stray(points)
    origin = np.floor(np.median(points, axis=0)) if len(points) else np.zeros(3)
    local = points - origin
    parts = roofed_parts(local)
    if not parts:
        raise InputError(f"no tunnel: no place has a vault at least {CLEARANCE:g} m above a floor")
    if len(parts) > 1 and parts[1].area > _AMBIGUOUS_AREA_SHARE * parts[0].area:
        raise InputError(
            "the tunnel has separate parts, or there are several tunnels: "
            + "; ".join(f"{part.area:.0f} m² near {_place(part.cells.mean(axis=0) + origin[:2])}" for part in parts[:4])
            + "; pass the files of one tunnel, or draw its line and pass it with the files"
        )
    part = without_side_rooms(parts[0])
    path = longest_path(part)
    half = half_width(part, path)
    forks = branches(part, path)
    if len(forks):
        raise InputError(
            f"the tunnel forks: the branch near {_place(forks[0] + origin[:2])} is as wide as the rest; pass the files of one "
            "tube, or draw its line and pass it with the files"
        )
    near = local[cKDTree(part.cells).query(local[:, :2])[0] <= half + part.edge]
    way = part.cells[path]
    if _length(way) < MAX_SHORT_LENGTH:
        way = ends_by_projection(near)
    found = _through_sections(local, way, half, extend=True)
    found = found if found.xyz[0, 0] <= found.xyz[-1, 0] else found.reversed()
    return _moved(_with_the_rest(found, np.vstack([part.cells for part in parts]), part.edge), origin)


def follow_line(points: Float, plan: Float) -> FoundAxis:
    """Find the axis of the tunnel along a line drawn in plan; it has the line's ends and direction.

    Parameters
    ----------
    points : (n, 3) float array
        As in `find_axis`.
    plan : (k, 2) float array
        Line, m, inside the tunnel over its whole length.

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
            f"no points of a tunnel along the line from {_place(plan[0])} to {_place(plan[-1])}; do both show the same place?"
        )
    half = max(float(part.depth[cKDTree(part.cells).query(way)[1]].mean()) for part in parts)
    return _moved(_through_sections(local, way, half, extend=False), origin)


def _with_the_rest(found: FoundAxis, cells: Float, edge: float) -> FoundAxis:
    """Return the axis with the share of the roofed area, in cells (n, 2) of the plan, that is away from the line."""
    along = _at_even_distances(found.xyz[:, :2], edge)
    rest = cells[cKDTree(along).query(cells)[0] > max(found.width, STEP)]
    return replace(
        found,
        off_line_share=len(rest) / len(cells),
        off_line_centre=largest_group(rest, edge).mean(axis=0) if len(rest) else None,
    )


def _crossed(parts: list[Footprint], way: Float) -> list[Footprint]:
    """Return the parts of the footprint that a line crosses."""
    even = _at_even_distances(way, 1.0)
    return [part for part in parts if (cKDTree(part.cells).query(even)[0] < part.edge).mean() > _AMBIGUOUS_AREA_SHARE]


def _through_sections(points: Float, way: Float, half: float, extend: bool) -> FoundAxis:
    """Return a line through the centres of sections across a path (k, 2) in plan, in a tunnel of a half-width (m).

    It is extended to the end of the vault, or ends with the path.
    """
    step = min(STEP, _length(way) / _SECTIONS)
    even = _at_even_distances(way, step)
    line = np.column_stack([even, _mid_heights(points, even)])
    line = smooth_line(line, np.ones(len(line), dtype=bool))
    reach = max(3.0 * half, 8.0)
    for turn in range(_PASSES):
        line, centres, raw = _centred(points, line, reach)
        if extend and turn >= _PASSES // 2:
            line = line[_inside(centres, max(round(_MAX_GAP / step), 1))]
        line = _at_even_distances(line, step)
    line, centres, raw = _centred(points, line, reach)
    ends, distance = line, _distances(line)
    if extend:
        ends = _to_the_ends(points, line, reach, float(np.nanmedian(centres.height)))
        distance = distance + float((line[0, :2] - ends[0, :2]) @ Frames.along(line).ahead[0, :2])
    away = np.linalg.norm(raw - line, axis=1)
    width, height = (float(np.nanmedian(values)) for values in (centres.width, centres.height))
    near = points[place_points(points, Frames.along(line), reach + _MAX_EXTENSION).station >= 0]
    return FoundAxis(ends, centres.whole, np.where(centres.whole, away, np.nan), distance, width, height, near)


def _centred(points: Float, line: Float, reach: float) -> tuple[Float, Centres, Float]:
    """Return the line through the smoothed centres of its sections, the sections, and their own centres."""
    frames = Frames.along(line)
    spacing = float(np.median(np.diff(_distances(line))))
    placed = place_points(points, frames, reach)
    centres = section_centres(placed, len(line), 0.5 * spacing + 0.25)
    _require_tunnel(centres)
    shift = np.nan_to_num(centres.right)[:, None] * frames.right + np.nan_to_num(centres.up)[:, None] * frames.up
    first, *_, last = np.flatnonzero(centres.whole)
    # beyond the tunnel the line keeps its direction
    shift[:first], shift[last + 1 :] = shift[first], shift[last]
    seen = centres.whole.copy()
    seen[:first] = seen[last + 1 :] = True
    raw = line + shift
    return smooth_line(raw, seen), centres, raw


def _require_tunnel(centres: Centres) -> None:
    sections, count, open_side = len(centres.whole), int(centres.whole.sum()), int(centres.open_side.sum())
    if count >= max(_MIN_CONSECUTIVE_SECTIONS, _MIN_COMPLETE_SHARE * sections):
        return
    advice = (
        f"; {open_side} are open on one side, so that they have no centre: write its axis, or a line along it inside, as a"
        " table of x, y, z, and pass it: --axis axis.csv"
    )
    raise InputError(
        f"no tunnel: of {sections} sections of the roofed area, {count} have two walls, a vault and a floor"
        + (advice if open_side > sections // 2 else "")
    )


def _inside(centres: Centres, gap: int) -> slice:
    """Return the longest run of complete sections, with gaps of at most ``gap`` sections, without ends of another size.

    In front of a portal, its face and the slopes of the cut may form a section, but one larger than the tunnel.
    """
    rows = np.flatnonzero(centres.whole)
    cuts = np.flatnonzero(np.diff(rows) > gap)
    firsts, lasts = rows[np.append(0, cuts + 1)], rows[np.append(cuts, len(rows) - 1)]
    best = int(np.argmax(lasts - firsts))
    rows = rows[(rows >= firsts[best]) & (rows <= lasts[best])]
    if len(rows) < _MIN_CONSECUTIVE_SECTIONS:
        raise InputError("no tunnel: sections with two walls, a vault and a floor are too far apart")
    usual = np.ones(len(rows), dtype=bool)
    for size in (centres.width[rows], centres.height[rows]):
        usual &= np.abs(size / np.median(size) - 1.0) <= _MAX_SIZE_DIFFERENCE
    kept = rows[usual]
    return slice(int(kept[0]), int(kept[-1]) + 1) if len(kept) > len(rows) // 2 else slice(int(rows[0]), int(rows[-1]) + 1)


def _to_the_ends(points: Float, line: Float, reach: float, height: float) -> Float:
    """Extend the line without its last sections to the end of the lining, by at most 15 m with the same curvature."""
    inner = line[1:-1]
    frames = Frames.along(inner)
    placed = place_points(points, frames, reach + _MAX_EXTENSION)
    lining = placed.at(placed.up <= _VAULT_HEIGHT_SHARE * height)
    gap = vault_gap(lining, _distances(inner))
    first, last = (
        min(roof_ends(lining, station, way, gap), _MAX_EXTENSION) for station, way in ((0, -1.0), (len(inner) - 1, 1.0))
    )
    half = 0.5 * float(np.hypot(*(line[1, :2] - line[0, :2])))
    begin, end = _drawn_on(inner[::-1], first)[::-1], _drawn_on(inner, last)
    return np.vstack([begin, inner[int(first < half) : len(inner) - int(last < half)], end])


def _drawn_on(line: Float, length: float) -> Float:
    """Return vertices (k, 3) beyond the end of a line, on the parabola through its last sections."""
    tail = line[-_EXTENSION_SECTIONS:]
    distance = _distances(tail)
    at = distance[-1] + np.linspace(0.0, length, 1 + max(round(length / STEP), 1))[1:]
    bend = 2 if len(tail) == _EXTENSION_SECTIONS else 1
    fits = [Polynomial.fit(distance, column, degree) for column, degree in zip(tail.T, (bend, bend, 1), strict=True)]
    return np.column_stack([tail[-1, k] + fit(at) - fit(distance[-1]) for k, fit in enumerate(fits)])


def _mid_heights(points: Float, plan: Float) -> Float:
    """Return the height midway between lowest and highest points near places (k, 2) in plan, m; interpolated where missing."""
    near = cKDTree(points[:, :2]).query_ball_point(plan, _COURSE_WIDTH)
    height = np.array([np.quantile(points[rows, 2], (0.05, 0.95)).mean() if len(rows) else np.nan for rows in near])
    known = np.isfinite(height)
    if not known.any():
        raise InputError("no points along the line; do line and scan show the same place?")
    at = np.arange(len(plan))
    return np.interp(at, at[known], height[known])


def _at_even_distances(line: Float, step: float) -> Float:
    """Return a line (k, 2 or 3) with vertices at even distances in plan, about ``step`` apart, m."""
    distance = _distances(line)
    parts = max(round(float(distance[-1]) / step), 1)
    at = np.linspace(0.0, distance[-1], parts + 1)
    return np.column_stack([np.interp(at, distance, column) for column in line.T])


def _distances(line: Float) -> Float:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line[:, :2], axis=0).T))])


def _length(line: Float) -> float:
    return float(_distances(line)[-1])


def _without_stray(points: Float) -> Float:
    """Remove points that are not finite or have too few neighbours."""
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return points
    company: Int64 = cKDTree(points).query_ball_point(points, _NEIGHBOUR_RADIUS, return_length=True)
    return points[company > _MIN_NEIGHBOURS]


def _moved(found: FoundAxis, by: Float) -> FoundAxis:
    centre = None if found.off_line_centre is None else found.off_line_centre + by[:2]
    return replace(found, xyz=found.xyz + by, points=found.points + by, off_line_centre=centre)


def _place(plan: Float) -> str:
    return f"{plan[0]:.0f},{plan[1]:.0f}"
