"""The method of Ono et al. word for word, with the parameters of their Table 1; for the benchmark only.

Clusters by region growing of the Point Cloud Library (libpcl-dev), grouped over occlusion, cut into sub-clusters by the cosine
of incidence, a normal distribution fitted to each histogram of the intensity, three sigma. A station's cloud is taken by
itself, as in the paper. Where the paper says nothing, what is simplest was taken:

- neighbours 30 and clusters of 50 points and more, as in the tutorial of PCL that it cites;
- edge lines of a cluster: the four sides of the smallest rectangle around it in its plane; common: within the thresholds of
  angle and distance of its Table 1, which it states for clusters;
- 0.05 between projected clusters is taken as m;
- occluded: a measured point lies before at least half of the interpolated ones;
- bins of 30 of FARO's counts are 0.25 dB of an amplitude;
- the fit: by least squares on the histogram ("fit"), or mean and standard deviation ("moments").
"""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from scipy.optimize import OptimizeWarning, curve_fit
from scipy.spatial import cKDTree

from benchmarks.structures import compiled
from benchmarks.structures.scenes import Scene
from tunneldb.arrays import Bool, Float, Int64

RADIUS, CURVATURE, ANGLE = 0.1, 1.0, 3.0
GROUP_ANGLE, GROUP_DISTANCE, PROJECTED = 10.0, 0.005, 0.05
DIVISION, BIN, SIGMAS = 0.05, 0.25, 3.0
NEIGHBOURS, LEAST = 30, 50
PARALLEL = np.cos(np.radians(GROUP_ANGLE))


@cache
def program() -> Path | None:
    """The compiled region growing; None where there is no PCL."""
    roots = list(Path("/usr/include").glob("pcl-*"))
    if not roots:
        return None
    libraries = ["-lpcl_common", "-lpcl_kdtree", "-lpcl_search", "-lpcl_features", "-lpcl_segmentation"]
    return compiled.build("region_growing", [f"-I{roots[0]}", "-I/usr/include/eigen3"], libraries)


@dataclass(frozen=True)
class Literal:
    """Cluster (0: none) and group of each point (numbers of a station are its own), what is abnormal, and seconds."""

    cluster: Int64
    group: Int64
    fit: Bool
    moments: Bool
    seconds_pcl: float
    seconds: float


def literal(scene: Scene, folder: Path) -> Literal:
    """Run the method on each station of a scene."""
    many = len(scene.xyz)
    cluster, group = np.zeros(many, dtype=np.int64), np.zeros(many, dtype=np.int64)
    fit, moments = np.zeros(many, dtype=bool), np.zeros(many, dtype=bool)
    pcl = seconds = 0.0
    last = 0
    for scan in np.unique(scene.scan).tolist():
        rows = np.flatnonzero(scene.scan == scan)
        start = time.perf_counter()
        xyz = scene.xyz[rows] - scene.stations[scan - 1]
        label, normal, took = grow(xyz, folder)
        joined = _group(xyz, normal, label)
        one, other = _decide(xyz, normal, joined, scene.level[rows])
        seconds += time.perf_counter() - start
        pcl += took
        cluster[rows], group[rows] = np.where(label > 0, label + last, 0), np.where(joined > 0, joined + last, 0)
        fit[rows], moments[rows] = one, other
        last += int(label.max(initial=0))
    return Literal(cluster, group, fit, moments, pcl, seconds)


def grow(xyz: Float, folder: Path) -> tuple[Int64, Float, float]:
    """Section 3.1: cluster of each point, its normal, seconds."""
    found = program()
    assert found is not None
    arguments = [RADIUS, CURVATURE, ANGLE, NEIGHBOURS, LEAST]
    rows, seconds = compiled.run(found, xyz, arguments, [("label", np.int32), ("normal", np.float32, 3)], folder)
    return rows["label"].astype(np.int64), rows["normal"].astype(np.float64), seconds


@dataclass(frozen=True)
class _Cluster:
    number: int
    middle: Float
    normal: Float
    sides: list[tuple[Float, Float]]  # a point and a direction of each edge line
    xyz: Float


def _cluster(number: int, xyz: Float) -> _Cluster | None:
    middle = xyz.mean(axis=0)
    axes = np.linalg.eigh(np.cov((xyz - middle).T))[1]
    u, v, normal = axes[:, 2], axes[:, 1], axes[:, 0]
    box = shapely.minimum_rotated_rectangle(shapely.multipoints((xyz - middle) @ np.column_stack([u, v])))
    if box.geom_type != "Polygon":
        return None
    corners = middle + np.asarray(box.exterior.coords) @ np.array([u, v])
    sides = []
    for one, other in pairwise(corners):
        way = other - one
        sides.append((one, way / max(np.linalg.norm(way), 1e-9)))
    return _Cluster(number, middle, normal, sides, xyz)


def _common(one: _Cluster, other: _Cluster) -> list[Float]:
    """Directions of edge lines that two clusters have in common."""
    out = []
    for point, way in one.sides:
        for place, direction in other.sides:
            if abs(way @ direction) > PARALLEL:
                gap = place - point
                if np.linalg.norm(gap - (gap @ way) * way) < GROUP_DISTANCE:
                    out.append(way)
    return out


def _group(xyz: Float, normal: Float, label: Int64) -> Int64:
    """Section 3.2: clusters of one plane that an object before them parts are one."""
    clusters = []
    order = np.argsort(label, kind="stable")
    begin = np.searchsorted(label[order], np.arange(label.max(initial=0) + 2))
    for number in range(1, int(label.max(initial=0)) + 1):
        made = _cluster(number, xyz[order[begin[number] : begin[number + 1]]])
        if made is not None:
            clusters.append(made)
    out = np.arange(label.max(initial=0) + 1)
    direction = xyz / np.linalg.norm(xyz, axis=1)[:, None]
    tree, far = cKDTree(direction), np.linalg.norm(xyz, axis=1)
    for i, one in enumerate(clusters):
        for other in clusters[i + 1 :]:
            if abs(one.normal @ other.normal) < PARALLEL:
                continue
            gap = other.middle - one.middle
            if max(abs(gap @ one.normal), abs(gap @ other.normal)) > GROUP_DISTANCE:
                continue
            ways = _common(one, other)
            if not ways or (len(ways) == 1 and not _near(one, other, ways[0])):
                continue
            if _occluded(one, other, ways[0], tree, far):
                out[out == out[other.number]] = out[one.number]
    return np.where(label > 0, out[label], 0)


def _near(one: _Cluster, other: _Cluster, way: Float) -> bool:
    """Section 3.2.3: clusters projected along the common line lie near each other."""
    flat = [c.xyz - (c.xyz @ way)[:, None] * way for c in (one, other)]
    return float(cKDTree(flat[0]).query(flat[1])[0].mean()) < PROJECTED


def _occluded(one: _Cluster, other: _Cluster, way: Float, tree: cKDTree, far: Float) -> bool:
    """Section 3.2.4: points are measured between the sensor and what is interpolated along the common line."""
    along = [np.sort(c.xyz @ way) for c in (one, other)]
    first, second = (0, 1) if along[0][0] < along[1][0] else (1, 0)
    low, high = along[first][-1], along[second][0]
    if high <= low:
        return False
    middle = one.middle + ((low + high) / 2 - one.middle @ way) * way
    places = middle + np.linspace(-0.5, 0.5, 20)[:, None] * (high - low) * way
    reach = np.linalg.norm(places, axis=1)
    near = tree.query_ball_point(places / reach[:, None], 0.003)
    hidden = [bool(len(rows)) and far[rows].min() < r - 0.02 for rows, r in zip(near, reach, strict=True)]
    return float(np.mean(hidden)) >= 0.5


def _bell(x: Float, height: float, mean: float, sigma: float) -> Float:
    return height * np.exp(-0.5 * ((x - mean) / sigma) ** 2)


def _decide(xyz: Float, normal: Float, group: Int64, level: Float) -> tuple[Bool, Bool]:
    """Sections 3.3 and 3.4: what is more than three sigma from the distribution of its sub-cluster, by both fits."""
    cosine = np.abs(np.einsum("ij,ij->i", xyz, normal)) / np.linalg.norm(xyz, axis=1)
    part = np.floor(np.nan_to_num(cosine) / DIVISION).astype(np.int64)
    fit, moments = np.zeros(len(group), dtype=bool), np.zeros(len(group), dtype=bool)
    key = group * 64 + part
    order = np.argsort(key, kind="stable")
    cuts = np.flatnonzero(np.diff(key[order])) + 1
    for rows in np.split(order, cuts):
        if group[rows[0]] == 0:
            continue
        values = level[rows]
        mean, sigma = float(values.mean()), float(values.std())
        moments[rows] = np.abs(values - mean) > SIGMAS * sigma
        edges = np.arange(np.floor(values.min() / BIN), np.ceil(values.max() / BIN) + 2) * BIN
        count, _ = np.histogram(values, edges)
        middle = 0.5 * (edges[:-1] + edges[1:])
        if len(middle) > 3 and sigma > 0.0:
            try:
                start = (float(count.max()), float(middle[count.argmax()]), sigma)
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", OptimizeWarning)  # few bins: the covariance is not asked for
                    (_, mean, sigma), _ = curve_fit(_bell, middle, count, start)
            except RuntimeError:
                pass  # no fit: mean and standard deviation stand
        fit[rows] = np.abs(values - mean) > SIGMAS * abs(sigma)
    return fit, moments
