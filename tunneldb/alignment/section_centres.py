"""Centre of a tunnel in sections across a line: midway between the walls, and between vault and floor.

The stage ``axis`` places its vertices by the same definition (``sql/geometry/axis.sql``), here on a thinned cloud.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tunneldb.arrays import Bool, Float, Int64

_CLASS = 5  # ° of an angular class
_CLASSES = 360 // _CLASS
_LINING_QUANTILE = 0.9  # share of a class's points that are nearer, from fixtures and objects in the tunnel
_FREE_QUANTILE = 0.8  # share of sections with a reduced wall distance: a train may stand along most of a tunnel
_MIN_WIDTH_SHARE = 0.8  # share of the greatest width that a pair of classes must have to be on the walls of a low, wide tunnel
_MAX_WIDTH_DEVIATION = 0.1  # greatest relative deviation of the wall distance of a pair of classes from the usual
_MIN_PROFILE_GAP = 0.3  # m; greater than gaps between points of one profile
_MIN_GAP = 1.0  # m
_MIN_CLASSES = 3  # least number of classes, or pairs, for the median of a wall, a vault or a floor
_WALL = 25.0  # ° above and below the horizontal in which points are on a wall
_VAULT = 1.0 / 3.0  # least share of the classes overhead for a roof


@dataclass(frozen=True)
class Frames:
    """Frames of stations along a line: position, forward, right and up, each (k, 3)."""

    position: Float
    ahead: Float
    right: Float
    up: Float

    @classmethod
    def along(cls, line: Float) -> Frames:
        """Return the frames at the vertices of a line (k, 3), k ≥ 2."""
        ahead = np.gradient(line, axis=0)
        ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
        right = np.column_stack([ahead[:, 1], -ahead[:, 0], np.zeros(len(ahead))])
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        return cls(line, ahead, right, np.cross(right, ahead))


@dataclass(frozen=True)
class Placed:
    """Points in the frames of their nearest stations.

    Attributes
    ----------
    station : (n,) int array
        Index of the station; -1 for points out of reach.
    along, right, up : (n,) float arrays
        Coordinates in its frame, m.
    """

    station: Int64
    along: Float
    right: Float
    up: Float

    def at(self, chosen: Bool) -> Placed:
        """Return some of the points."""
        return Placed(self.station[chosen], self.along[chosen], self.right[chosen], self.up[chosen])


@dataclass(frozen=True)
class Centres:
    """Shift of each station to the tunnel's centre.

    Attributes
    ----------
    right, up : (k,) float arrays
        Shift, m; NaN if a wall, the vault or the floor is not visible.
    width, height : (k,) float arrays
        Distance between the walls, and from floor to vault, m; NaN likewise.
    open_side : (k,) bool array
        True where only one of the walls is visible, with vault and floor.
    """

    right: Float
    up: Float
    width: Float
    height: Float
    open_side: Bool

    @property
    def whole(self) -> Bool:
        """True for stations with both walls, vault and floor."""
        return np.isfinite(self.right) & np.isfinite(self.up)


def place_points(points: Float, frames: Frames, reach: float) -> Placed:
    """Transform points (n, 3) into the frames of the nearest stations, up to a distance from these (m)."""
    distance, station = cKDTree(frames.position).query(points, distance_upper_bound=reach)
    station = np.where(np.isfinite(distance), station, -1)
    away = points - frames.position[station]
    along, right, up = (np.einsum("ij,ij->i", away, axis[station]) for axis in (frames.ahead, frames.right, frames.up))
    return Placed(station, along, right, up)


def section_centres(placed: Placed, count: int, half_width: float) -> Centres:
    """Return the shift of each of ``count`` stations to the centre, from the points within half a width (m) of its plane.

    The distance of the lining in a class of 5° around the station is the 90th percentile of its points. If pairs of opposite
    classes have the same wall distance as in the other stations, the other pairs are ignored: there a train stands in front
    of a wall, or a passage begins.
    """
    radius = _radii(placed.at((placed.station >= 0) & (np.abs(placed.along) <= half_width)), count)
    angle = (np.arange(_CLASSES) + 0.5) * _CLASS - 180.0
    cosine = np.cos(np.radians(angle))
    side = (angle > 45) & (angle < 135)
    a, b = radius[:, side], radius[:, ::-1][:, side]
    shift, widths = (a - b) / 2.0, (a + b) * np.sin(np.radians(angle[side]))
    usual = _usual(widths)
    upright = usual >= _MIN_WIDTH_SHARE * np.nanmax(usual, initial=0.0)  # not vault and floor of a low, wide tunnel
    free = (np.abs(widths / usual - 1.0) <= _MAX_WIDTH_DEVIATION) & upright
    right, width = (_median(np.where(free, values, np.nan), fewest=1) for values in (shift, widths))
    right, width = np.where(np.isfinite(right), (right, width), (_median(shift[:, upright]), _median(widths[:, upright])))
    # a roof on posts has no walls at mid-height
    walls = np.isfinite(widths[:, np.abs(angle[side] - 90.0) < _WALL]).sum(axis=1) >= _MIN_CLASSES
    right, width = np.where(walls, (right, width), np.nan)
    floor, vault = np.abs(angle) > 135, np.abs(angle) < 45
    depth = _median(-radius[:, floor] * cosine[floor])
    roofed = np.isfinite(radius[:, vault]).mean(axis=1) >= _VAULT
    up = np.where(roofed, _median((radius[:, vault] - depth[:, None] / cosine[vault]) / 2.0), np.nan)
    height = np.where(roofed, depth + _median(radius[:, vault] * cosine[vault]), np.nan)
    left_wall, right_wall = (
        np.isfinite(radius[:, np.abs(angle - middle) < _WALL]).sum(axis=1) >= _MIN_CLASSES for middle in (-90.0, 90.0)
    )
    return Centres(right, up, width, height, np.isfinite(up) & (left_wall != right_wall))


def vault_gap(placed: Placed, distance: Float) -> float:
    """Return the gap along the line above which there is no vault, m: 1.5 times that between most profiles.

    Parameters
    ----------
    placed : Placed
        Points of the lining.
    distance : (k,) float array
        Distance of each station along the line, m.
    """
    overhead = placed.at((placed.station >= 0) & _overhead(placed))
    gaps = np.diff(np.sort(distance[overhead.station] + overhead.along))
    profile_gaps = gaps[gaps > _MIN_PROFILE_GAP]
    return 1.5 * max(float(np.quantile(profile_gaps, 0.9)) if len(profile_gaps) else 0.0, _MIN_GAP)


def roof_ends(placed: Placed, station: int, way: float, gap: float) -> float:
    """Return the distance to which the vault extends ahead of a station (``way`` 1) or behind it (-1), across gaps (m)."""
    along = np.sort(way * placed.along[(placed.station == station) & _overhead(placed)])
    along = along[along >= 0.0]
    if not len(along) or along[0] > gap:
        return 0.0
    gaps = np.flatnonzero(np.diff(along) > gap)
    return float(along[gaps[0]] if len(gaps) else along[-1])


def _overhead(placed: Placed) -> Bool:
    """Return True for points of the vault's middle part; a portal's wing walls are beside it."""
    return np.asarray(placed.up > 2.0 * np.abs(placed.right))


def _radii(placed: Placed, count: int) -> Float:
    """Return the distance of the lining in each angular class of each station (count, classes), m; NaN without points."""
    angle = np.degrees(np.arctan2(placed.right, placed.up))
    number = np.clip(np.floor((angle + 180.0) / _CLASS).astype(np.int64), 0, _CLASSES - 1)
    key = placed.station * _CLASSES + number
    away = np.hypot(placed.right, placed.up)
    order = np.lexsort((away, key))
    key, away = key[order], away[order]
    occupied, first, points = np.unique(key, return_index=True, return_counts=True)
    out = np.full(count * _CLASSES, np.nan)
    out[occupied] = away[first + np.floor(_LINING_QUANTILE * (points - 1)).astype(np.int64)]
    return out.reshape(count, _CLASSES)


def _usual(widths: Float) -> Float:
    """Return the distance between the walls at each height, (classes,), m, where nothing stands in front of them.

    A train may stand along most of a tunnel, but hides no wall up to the vault; with niches the distance is greater.
    """
    known = np.isfinite(widths).any(axis=0)
    out = np.full(widths.shape[1], np.nan)
    if known.any():
        half, upper = np.nanquantile(widths[:, known], (0.5, _FREE_QUANTILE), axis=0)
        out[known] = np.minimum(upper, (1.0 + _MAX_WIDTH_DEVIATION) * half.max())
    return out


def _median(values: Float, fewest: int = _MIN_CLASSES) -> Float:
    """Return the median of each row; NaN if too few values are known."""
    known = np.isfinite(values).sum(axis=1) >= fewest
    out = np.full(len(values), np.nan)
    if known.any():
        out[known] = np.nanmedian(values[known], axis=1)
    return out
