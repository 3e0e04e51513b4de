"""Comparison of detected leaks with reference leaks as polygons of the unrolled plane, without input or output."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely.geometry.base import BaseGeometry

from tunneldb.arrays import Bool, Float, Int64

MIN_OVERLAP = 0.5
"""Share of its area from which a true leak counts as found, or a found leak as right. This is the overlap of PASCAL VOC
(Everingham et al., 2010) and COCO (Lin et al., 2014), applied in each direction separately, since detection may divide a leak
or join two."""

STEP = 0.01
"""Distance between points on outlines at which the distance of edges is measured, m."""


@dataclass(frozen=True)
class Comparison:
    """Required true leaks (n) and found leaks that count (m), each with its overlap with the others.

    Attributes
    ----------
    true, found : (n,) and (m,) int arrays
        Their indices in the input.
    true_shape, found_shape : (n,) and (m,) arrays of polygons
        Shapes within the stretch; found ones without the parts on true leaks that are too small to be required.
    true_area, found_area : (n,) and (m,) float arrays
        Areas, m².
    covered, right : (n,) and (m,) float arrays
        Share of a true leak that is found, and share of a found leak that is true, 0 to 1.
    true_group, found_group : (n,) and (m,) int arrays
        Group of connected leaks that touch each other; -1 for leaks that touch none.
    iou : (n,) float array
        Intersection over union of the leak's group; 0 for a leak that touches none.
    area_error : (n,) float array
        |found - true| / true area of the leak's group; NaN for a leak that touches none.
    edges : list of float arrays
        Distances between the outlines of found and true leaks of each group, in both directions, m.
    """

    true: Int64
    found: Int64
    true_shape: NDArray[np.object_]
    found_shape: NDArray[np.object_]
    true_area: Float
    found_area: Float
    covered: Float
    right: Float
    true_group: Int64
    found_group: Int64
    iou: Float
    area_error: Float
    edges: list[Float]


@dataclass(frozen=True)
class Figures:
    """Figures of merit of a detection; NaN if undefined.

    Attributes
    ----------
    true, touched, found : int
        Numbers of true leaks; of those that touch a found leak; of those found by at least half.
    called, right, false : int
        Numbers of found leaks; of those that are true by at least half; of those that touch no true leak.
    recall, precision, f1 : float
        found / true, right / called, and their harmonic mean.
    iou : float
        Mean over the true leaks of the intersection over union of their groups; 0 for a leak that touches none.
    true_area, found_area : float
        Area of the union of all true and of all found leaks, m².
    area_recall, area_precision, area_f1, area_iou : float
        Share of the true area that is found, share of the found area that is true, and F1 and IoU derived from these.
    area_error, area_error_p95 : float
        Median and 95 % quantile of |found - true| / true area, over the touched leaks.
    edge, edge_p95 : float
        Median and 95 % quantile of the distance between found and true outlines, in both directions, m.
    false_per_1000 : float
        Number of false leaks per 1000 m² of inspected lining; NaN for groups of leaks, whose lining is unknown.
    """

    true: int
    touched: int
    found: int
    called: int
    right: int
    false: int
    recall: float
    precision: float
    f1: float
    iou: float
    true_area: float
    found_area: float
    area_recall: float
    area_precision: float
    area_f1: float
    area_iou: float
    area_error: float
    area_error_p95: float
    edge: float
    edge_p95: float
    false_per_1000: float


def compare(
    true: Sequence[BaseGeometry],
    found: Sequence[BaseGeometry],
    min_area: float,
    stretch: BaseGeometry | None = None,
    progress: Callable[[float], None] = lambda count: None,
    asked: Bool | None = None,
) -> Comparison:
    """Compare found leaks (or other found objects) with true ones.

    True leaks smaller than ``min_area`` are not required: the found area on them is ignored, and so is a found leak that
    touches only such leaks. A found leak smaller than ``min_area`` counts only if it touches a required leak. Leaks that touch
    are one group, for example a leak found in several pieces, or two leaks found as one. Area and edges are compared group by
    group.

    Parameters
    ----------
    true, found : sequences of Polygon or MultiPolygon
        Valid polygons in the unrolled plane, m. A leak of several parts is one polygon.
    min_area : float
        Least area of a required leak, m².
    stretch : Polygon or MultiPolygon, optional
        Area to which leaks are cut. Its own edges are not edges of leaks.
    progress : callable
        Function of the number of leaks compared since the last call; the total is the number of all leaks.
    asked : (n,) bool array, optional
        True for true leaks that may be required, subject to ``min_area``; others are treated as too small.
    """
    whole, called = _cut(true, stretch), _cut(found, stretch)
    areas, called_areas = shapely.area(whole), shapely.area(called)
    large = (areas >= min_area) & (True if asked is None else asked)
    demanded = np.flatnonzero(large & (areas > 0.0))
    small = whole[~large & (areas > 0.0)]
    t, f = _touching(whole[demanded], called)
    _, unharmed = _touching(small, called)
    hits = np.isin(np.arange(len(called)), f)
    counted = np.flatnonzero(hits | (~np.isin(np.arange(len(called)), unharmed) & (called_areas >= max(min_area, 1e-12))))
    f = np.searchsorted(counted, f)
    shown, outlines = whole[demanded], called[counted]
    clear = outlines.copy()
    for k in np.flatnonzero(np.isin(counted, unharmed)):
        clear[k] = shapely.difference(outlines[k], shapely.union_all(small[shapely.intersects(small, outlines[k])]))
    groups, true_group, found_group = _groups(len(demanded), len(counted), t, f)
    iou, error = np.zeros(len(demanded)), np.full(len(demanded), np.nan)
    edges = []
    for number in range(groups):
        members, parts = np.flatnonzero(true_group == number), np.flatnonzero(found_group == number)
        one, other = shapely.union_all(shown[members]), shapely.union_all(clear[parts])
        shared = shapely.area(shapely.intersection(one, other))
        iou[members] = shared / (one.area + other.area - shared)
        error[members] = abs(other.area - one.area) / one.area
        edges.append(_edges(one, shapely.union_all(outlines[parts]), small, stretch))
        progress(len(members) + len(parts))
    touching = int(np.count_nonzero(true_group >= 0) + np.count_nonzero(found_group >= 0))
    progress(len(true) + len(found) - touching)
    return Comparison(
        demanded, counted, shown, clear, areas[demanded], shapely.area(clear),
        _shares(shown, clear, t, f), _shares(clear, shown, f, t), true_group, found_group, iou, error, edges,
    )  # fmt: skip


def figures(comparison: Comparison, seen: float = np.nan, true: Bool | None = None, found: Bool | None = None) -> Figures:
    """Return the figures of a comparison.

    Parameters
    ----------
    comparison : Comparison
        Comparison of n true and m found leaks.
    seen : float
        Inspected lining, m².
    true, found : (n,) and (m,) bool arrays, optional
        Leaks to include; each is still compared with all of the others.
    """
    c = comparison
    own = np.ones(len(c.true), np.bool_) if true is None else true
    theirs = np.ones(len(c.found), np.bool_) if found is None else found
    hit, right = own & (c.covered >= MIN_OVERLAP), theirs & (c.right >= MIN_OVERLAP)
    false = theirs & (c.found_group < 0)
    all_true, all_found = shapely.union_all(c.true_shape), shapely.union_all(c.found_shape)
    demanded, called = shapely.union_all(c.true_shape[own]), shapely.union_all(c.found_shape[theirs])
    recall, precision = _ratio(hit.sum(), own.sum()), _ratio(right.sum(), theirs.sum())
    area_recall = _ratio(shapely.area(shapely.intersection(demanded, all_found)), demanded.area)
    area_precision = _ratio(shapely.area(shapely.intersection(called, all_true)), called.area)
    area_f1 = _harmonic(area_recall, area_precision)
    errors = c.area_error[own & (c.true_group >= 0)]
    distances = [c.edges[k] for k in np.unique(c.true_group[own]) if k >= 0]
    edge = np.concatenate(distances) if distances else np.empty(0)
    return Figures(
        true=int(own.sum()),
        touched=int((own & (c.true_group >= 0)).sum()),
        found=int(hit.sum()),
        called=int(theirs.sum()),
        right=int(right.sum()),
        false=int(false.sum()),
        recall=recall,
        precision=precision,
        f1=_harmonic(recall, precision),
        iou=float(c.iou[own].mean()) if own.any() else np.nan,
        true_area=float(demanded.area),
        found_area=float(called.area),
        area_recall=area_recall,
        area_precision=area_precision,
        area_f1=area_f1,
        area_iou=area_f1 / (2.0 - area_f1),
        area_error=_quantile(errors, 0.5),
        area_error_p95=_quantile(errors, 0.95),
        edge=_quantile(edge, 0.5),
        edge_p95=_quantile(edge, 0.95),
        false_per_1000=1000.0 * _ratio(false.sum(), seen),
    )


def _cut(shapes: Sequence[BaseGeometry], stretch: BaseGeometry | None) -> NDArray[np.object_]:
    """Return polygons cut to a stretch; empty ones outside it."""
    out = np.empty(len(shapes), dtype=object)
    out[:] = list(shapes)
    if stretch is None:
        return out
    shapely.prepare(stretch)
    for k in np.flatnonzero(~shapely.covers(stretch, out)):
        parts = shapely.get_parts(shapely.intersection(out[k], stretch))
        out[k] = shapely.multipolygons(parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON])
    return out


def _touching(one: NDArray[np.object_], other: NDArray[np.object_]) -> tuple[Int64, Int64]:
    """Return pairs with a common area: indices in the first and in the second."""
    b, a = shapely.STRtree(one).query(other, predicate="intersects") if len(one) else np.empty((2, 0), np.int64)
    shared = shapely.area(shapely.intersection(one[a], other[b])) > 0.0
    return a[shared], b[shared]


def _shares(shapes: NDArray[np.object_], others: NDArray[np.object_], a: Int64, b: Int64) -> Float:
    """Return the share of each polygon's area that the others of its pairs cover."""
    share = np.zeros(len(shapes))
    for k in np.unique(a):
        shared = shapely.intersection(shapes[k], shapely.union_all(others[b[a == k]]))
        share[k] = _ratio(shapely.area(shared), shapes[k].area)
    return share


def _groups(true: int, found: int, t: Int64, f: Int64) -> tuple[int, Int64, Int64]:
    """Return the number of groups of leaks that touch, and the group of each leak, -1 for one that touches none."""
    _, label = connected_components(coo_array((np.ones(len(t)), (t, true + f)), shape=(true + found,) * 2), directed=False)
    kept = np.unique(label[t])
    number = np.where(np.isin(label, kept), np.searchsorted(kept, label), -1).astype(np.int64)
    return len(kept), number[:true], number[true:]


def _edges(true: BaseGeometry, found: BaseGeometry, small: NDArray[np.object_], stretch: BaseGeometry | None) -> Float:
    """Return the distances of points of the found outline from the true one, and vice versa, m.

    Where the found leak extends over one that is too small to be required, that one's outline is used, too.
    """
    near = shapely.union_all([true, *small[shapely.intersects(small, found)]])
    found_points, true_points = _points(found.boundary), _points(true.boundary)
    if stretch is not None:
        found_points, true_points = (
            points[shapely.distance(points, stretch.boundary) > 1e-6] for points in (found_points, true_points)
        )
    return np.concatenate([shapely.distance(found_points, near.boundary), shapely.distance(true_points, found.boundary)])


def _points(outline: BaseGeometry) -> NDArray[np.object_]:
    """Return evenly spaced points along the rings of an outline."""
    parts = []
    for ring in shapely.get_parts(outline):
        count = max(round(ring.length / STEP), 1)
        parts.append(shapely.line_interpolate_point(ring, (np.arange(count) + 0.5) * ring.length / count))
    return np.concatenate(parts)


def _ratio(part: float, whole: float) -> float:
    return float(part / whole) if whole > 0.0 else np.nan


def _harmonic(a: float, b: float) -> float:
    """Return F1 of recall and precision: 0 if either is 0 or undefined, NaN if both are undefined."""
    if np.isnan(a) and np.isnan(b):
        return np.nan
    return 2.0 * a * b / (a + b) if a > 0.0 and b > 0.0 else 0.0


def _quantile(values: Float, share: float) -> float:
    return float(np.quantile(values, share)) if len(values) else np.nan
