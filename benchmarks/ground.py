"""Ground of simulated tunnels against their truth, beside CSF and Open3D on the same points, and what each step gives.

``python -m benchmarks.ground`` makes tunnels of three sections and slopes, straight and curved, with smooth floor
and ballast, seen by a profiler and by static scanners, with people, equipment, lamps, spheres, cables and rails. Ground
is what the truth calls floor: ballast, sleepers, walkways. Points of rails are left out of the figures, for all methods
alike: they are no ground, but stand in the ballast, and classes tell them apart later (benchmarks.classes); with rails
counted as other points the figures are given as well. ``--quick`` pairs slopes and ballast instead of crossing them.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import CSF
import numpy as np
import open3d as o3d  # needs the system's libusb-1.0-0
from numpy.typing import NDArray

from tunneldb.classification.ground.accuracy import Agreement
from tunneldb.classification.ground.extraction import GroundSettings, find_ground
from tunneldb.classification.ground.ransac import ransac_planes
from tunneldb.geometry.centreline import centreline_through
from tunneldb.pointcloud.voxels import Voxels
from tunneldb.simulate import Parameters, simulate

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]
FLOOR, RAIL = 1, 5
SETTINGS = GroundSettings()
STEP = 4.0  # of the segments, m

# Li et al. 2023, table 3, scenes 1 and 2: type I, type II, total, kappa, %.
PAPER = {
    "CSF": ((1.00, 1.65, 1.56, 93.67), (4.43, 5.59, 5.33, 85.42)),
    "RANSAC": ((40.17, 0.01, 5.56, 71.92), (18.56, 0.07, 4.20, 87.05)),
    "RANSAC, normals": ((26.73, 0.02, 3.71, 82.45), (13.04, 0.12, 3.01, 90.93)),
    "RANSAC, normals, pass-through": ((4.81, 0.05, 0.71, 96.96), (0.12, 2.09, 1.65, 95.36)),
    "the paper's, all steps": ((0.73, 0.50, 0.54, 97.75), (0.20, 1.44, 1.16, 96.71)),
}


@dataclass
class Tally:
    """Errors and times of a method over all scenes."""

    errors: list[Agreement] = field(default_factory=list)
    with_rails: list[Agreement] = field(default_factory=list)
    seconds: float = 0.0
    points: int = 0

    def add(self, klass: NDArray[np.uint8], ground: Bool, seconds: float) -> None:
        kept = klass != RAIL
        self.errors.append(Agreement.of(klass[kept] == FLOOR, ground[kept]))
        self.with_rails.append(Agreement.of(klass == FLOOR, ground))
        self.seconds += seconds
        self.points += len(klass)

    def row(self, name: str) -> str:
        e, r = self.errors, self.with_rails
        mean = [100 * float(np.nanmean([getattr(a, k) for a in e])) for k in ("type_one", "type_two", "total", "kappa")]
        return (
            f"{name:34s} {mean[0]:7.3f} {mean[1]:7.3f} {mean[2]:7.3f} {mean[3]:7.2f}   worst total"
            f" {100 * max(a.total for a in e):7.3f} kappa {100 * min(a.kappa for a in e):6.2f}   with rails total"
            f" {100 * float(np.mean([a.total for a in r])):6.3f} kappa {100 * float(np.mean([a.kappa for a in r])):6.2f}"
            f"   {self.points / self.seconds / 1e6:6.2f} M points/s"
        )


def scenes(seeds: int, quick: bool, length: float) -> Iterator[tuple[str, Parameters]]:
    grounds = list(zip((0, 2, 4), (0.0, 0.015, 0.03), strict=True)) if quick else list(product((0, 2, 4), (0.0, 0.015, 0.03)))
    shots: dict[str, dict[str, Any]] = {
        "profiler": {"profile_spacing": 0.03, "profile_points": 1200},
        "static": {"angular_step": 0.25},
    }
    for section, radius, scanner, (slope, ballast), seed in product(
        ("horseshoe", "circular", "box"), (0, 300), ("profiler", "static"), grounds, range(1, seeds + 1)
    ):
        name = (
            f"{section}, {scanner}, {slope} %, {'curve' if radius else 'straight'}, ballast {100 * ballast:g} cm, seed {seed}"
        )
        yield name, Parameters(
            section=section, radius=radius, scanner=scanner, slope=slope, ballast=ballast, sleepers=ballast > 0, seed=seed,
            length=length, straight=5.0, leaks=2, people=3, equipment=3, bollards=1, globes=2, spheres=4, free_cables=2,
            catenary=True, **shots[scanner],
        )  # type: ignore[arg-type]  # fmt: skip


def ours(xyz: Float) -> Bool:
    voxels = Voxels(SETTINGS.voxel)
    voxels.add(xyz)
    thin = voxels.centroids()
    line = centreline_through(thin)
    ground = find_ground(thin, line, SETTINGS, 0, voxels.spread())
    assert ground is not None
    return ground.is_ground(*line.place(xyz), xyz[:, 2])


def by_segments(xyz: Float, thin: bool, normals: bool, through: bool) -> Bool:
    """Steps of the paper on the segments, without levels and walls: inliers, or all points up to γ above the plane."""
    voxels = Voxels(SETTINGS.voxel)
    voxels.add(xyz)
    line = centreline_through(voxels.centroids())
    seeds = voxels.centroids() if thin else xyz
    along, across = line.place(seeds)
    number = np.floor(along / STEP).astype(np.int64)
    first = int(number.min())
    order = np.argsort(number, kind="stable")
    edges = np.searchsorted(number[order], np.arange(first, int(number.max()) + 2))
    local = np.column_stack([along - (number + 0.5) * STEP, across, seeds[:, 2]])[order]
    bounds = np.column_stack([edges[:-1], edges[1:]])
    s = SETTINGS
    found = ransac_planes(local, bounds, s.distance, s.angle, s.radius, np.arange(len(bounds)), normals).coefficients
    along, across = line.place(xyz)
    k = np.clip(np.floor(along / STEP).astype(np.int64) - first, 0, len(found) - 1)
    c = found[k]
    away = xyz[:, 2] - c[:, 0] - c[:, 1] * (along - (k + first + 0.5) * STEP) - c[:, 2] * across
    away /= np.sqrt(1.0 + c[:, 1] ** 2 + c[:, 2] ** 2)
    return np.asarray(away <= s.gamma if through else np.abs(away) < s.distance)


@contextmanager
def silence() -> Iterator[None]:
    """Keep what a compiled library prints off the output."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def csf(xyz: Float, resolution: float, rigidness: int, threshold: float) -> Bool:
    cloth = CSF.CSF()
    cloth.params.bSloopSmooth = False
    cloth.params.cloth_resolution = resolution
    cloth.params.rigidness = rigidness
    cloth.params.class_threshold = threshold
    with silence():
        cloth.setPointCloud(xyz - xyz[0])
    ground, other = CSF.VecInt(), CSF.VecInt()
    with silence():
        cloth.do_filtering(ground, other, False)
    out = np.zeros(len(xyz), np.bool_)
    out[np.array(ground, dtype=np.int64)] = True
    return out


def open3d(xyz: Float) -> Bool:
    o3d.utility.random.seed(0)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(xyz - xyz[0]))
    _, inliers = cloud.segment_plane(SETTINGS.distance, 3, 1000)
    out = np.zeros(len(xyz), np.bool_)
    out[np.asarray(inliers, dtype=np.int64)] = True
    return out


def tuned_csf(length: float) -> tuple[float, int, float]:
    """The cloth's resolution, rigidness and class threshold that err the least over one scene of each section, on ballast."""
    clouds = [simulate(p) for n, p in scenes(1, True, length) if "curve" in n and "profiler" in n and "2 %" in n]
    best, least = (0.5, 3, 0.1), np.inf
    for resolution, rigidness, threshold in product((0.1, 0.2, 0.5, 1.0), (1, 3), (0.03, 0.06, 0.1, 0.2)):
        total = []
        for cloud in clouds:
            kept = cloud.klass != RAIL
            ground = csf(cloud.xyz, resolution, rigidness, threshold)
            total.append(Agreement.of(cloud.klass[kept] == FLOOR, ground[kept]).total)
        if np.mean(total) < least:
            best, least = (resolution, rigidness, threshold), float(np.mean(total))
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--length", type=float, default=30.0)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--ours", action="store_true", help="without the peers and the single steps")
    options = parser.parse_args()
    cloth = (1.0, 3, 0.1) if options.ours else tuned_csf(options.length)
    methods: dict[str, Callable[[Float], Bool]] = {
        "RANSAC": lambda p: by_segments(p, thin=False, normals=False, through=False),
        "RANSAC, normals": lambda p: by_segments(p, thin=False, normals=True, through=False),
        "RANSAC, normals, pass-through": lambda p: by_segments(p, thin=False, normals=True, through=True),
        "the paper's, by segments": lambda p: by_segments(p, thin=True, normals=True, through=True),
        "ours: and levels, walls": ours,
        f"CSF ({cloth[0]:g} m, {cloth[1]}, {cloth[2]:g} m)": lambda p: csf(p, *cloth),
        "Open3D segment_plane": open3d,
    }
    if options.ours:
        methods = {"ours: and levels, walls": ours}
    tallies = {name: Tally() for name in methods}
    warm = simulate(Parameters(length=10, scanner="profiler", profile_spacing=0.1, profile_points=500))
    for method in tuple(methods.values())[:5]:
        method(warm.xyz)
    print("type I, II, total and kappa in %, means over scenes")
    for scene, parameters in scenes(options.seeds, options.quick, options.length):
        cloud = simulate(parameters)
        for name, method in methods.items():
            start = time.perf_counter()
            ground = method(cloud.xyz)
            tallies[name].add(cloud.klass, ground, time.perf_counter() - start)
        a = tallies["ours: and levels, walls"].errors[-1]
        print(
            f"{scene:62s} {len(cloud):8d} points: {100 * a.type_one:6.3f} {100 * a.type_two:6.3f} {100 * a.total:6.3f}"
            f" {100 * a.kappa:6.2f}",
            flush=True,
        )
    for name, tally in tallies.items():
        print(tally.row(name))
    for name, figures in PAPER.items():
        print(f"Li et al. 2023, {name}: " + "; ".join(", ".join(f"{f:.2f}" for f in row) for row in figures))


if __name__ == "__main__":
    main()
