"""Classes of points against the truth of simulated tunnels: with the sections of a survey, and from the bare cloud.

    python -m benchmarks.classes [--seeds 3] [--length 40]

Scenes hold people, trolleys, cases, tripods, bollards, lamps, free cables, a contact line, target spheres, ballast and
sleepers. Ground and clusters are found from points of survey density; classes are counted over all points. Points that the
truth calls outliers (mixed pixels, too) are left out. The centres of the spheres are given: benchmarks.spheres measures how
they are found.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.common import print_table, progress, save
from tunneldb.classification.classes import PointClass
from tunneldb.classification.classify import find_bare_scene, find_scene
from tunneldb.classification.ground.extraction import GroundSettings, find_ground
from tunneldb.classification.scene import Scene
from tunneldb.geometry.centreline import centreline_through
from tunneldb.pointcloud.thinning import thin, voxel_edge
from tunneldb.pointcloud.voxels import Voxels
from tunneldb.simulate.parameters import Parameters

sys.path.append(str(Path(__file__).parent.parent / "tests"))
from support.simulated_scenes import exact, scan

Classes = NDArray[np.uint8]

SECTIONS = ("horseshoe", "circular", "box")
SCANNERS: dict[str, dict[str, Any]] = {
    "profiler": {"scanner": "profiler", "profile_spacing": 0.02, "profile_points": 1500},
    "static": {"scanner": "static", "angular_step": 0.2},
}
THINGS = {
    "people": 4, "equipment": 6, "bollards": 2, "globes": 4, "spheres": 6, "free_cables": 2, "catenary": True,
    "sleepers": True, "leaks": 2,
}  # fmt: skip
COUNTED = (
    PointClass.GROUND,
    PointClass.LINING,
    PointClass.NICHE,
    PointClass.APPENDAGE,
    PointClass.RAIL,
    PointClass.OBJECT,
    PointClass.SPHERE,
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--length", type=float, default=40.0, help="of each tunnel, m")
    options = parser.parse_args()
    rows = []
    for section in SECTIONS:
        for scanner, points in SCANNERS.items():
            for seed in range(1, options.seeds + 1):
                parameters = Parameters(
                    length=options.length, section=section, seed=seed, slope=float(seed % 5), ballast=0.01 * (seed % 4),
                    **points, **THINGS,
                )  # fmt: skip
                rows += measured(parameters)
                progress(
                    f"{section} {scanner} {seed}: " + ", ".join(f"{row['way']} {row['agreement']:.4f}" for row in rows[-2:])
                )
    for way in ("survey", "bare"):
        report(way, [row for row in rows if row["way"] == way])
    print("\n" + str(save("classes", {"scenes": rows})))


def measured(parameters: Parameters) -> list[dict[str, Any]]:
    """Figures of one scene, as a survey and as a bare cloud."""
    simulation, cloud, truth = scan(parameters)
    spheres = np.array([[*sphere.centre, sphere.radius] for sphere in simulation.spheres])
    out = []
    for way in ("survey", "bare"):
        began = time.perf_counter()
        scene = of_survey(simulation, cloud.xyz) if way == "survey" else of_bare(cloud.xyz)
        found = time.perf_counter() - began
        scene = Scene(scene.line, scene.ground, scene.clusters, scene.surface, scene.relief, spheres)
        scene.classes(cloud.xyz[:1000])
        began = time.perf_counter()
        classes = scene.classes(cloud.xyz)
        seconds = time.perf_counter() - began
        name = {"way": way, "section": parameters.section, "scanner": parameters.scanner, "seed": parameters.seed}
        speed = {"points": len(truth), "found_s": found, "points_per_s": len(truth) / seconds}
        out.append({**name, **speed, **figures(truth, classes)})
    return out


def of_survey(simulation: Any, xyz: NDArray[np.float64]) -> Scene:
    surface, line = exact(simulation)
    points = xyz[thin(xyz, voxel_edge(100.0))]
    return find_scene(points, line, surface, find_ground(points, line, GroundSettings()))


def of_bare(xyz: NDArray[np.float64]) -> Scene:
    settings = GroundSettings()
    voxels = Voxels(settings.voxel)
    voxels.add(xyz)
    points = voxels.centroids()
    line = centreline_through(points)
    return find_bare_scene(points, line, find_ground(points, line, settings, spread=voxels.spread()))


def figures(truth: Classes, classes: Classes) -> dict[str, Any]:
    """Agreement, and of each class how many of its points are found and how many of those found are its own."""
    seen = truth != PointClass.NOISE
    truth, classes = truth[seen], classes[seen]
    out: dict[str, Any] = {"agreement": float((truth == classes).mean())}
    for klass in COUNTED:
        both = int(((truth == klass) & (classes == klass)).sum())
        out[klass.name.lower()] = [
            both / max(int((truth == klass).sum()), 1), both / max(int((classes == klass).sum()), 1)
        ]  # fmt: skip
    return out


def report(way: str, rows: list[dict[str, Any]]) -> None:
    """Print the median and the worst scene of each class."""
    table = []
    for klass in COUNTED:
        values = 100.0 * np.array([row[klass.name.lower()] for row in rows])
        table.append([klass.name.lower(), *np.median(values, axis=0).tolist(), *values.min(axis=0).tolist()])
    agreement = 100.0 * np.array([row["agreement"] for row in rows])
    speed = np.median([row["points_per_s"] for row in rows]) / 1e6
    typical = f"agreement {np.median(agreement):.2f} % (worst {agreement.min():.2f} %), {speed:.1f} million points/s"
    print_table(f"{way}: {len(rows)} scenes, {typical}", ["class", "found, %", "own, %", "found, worst", "own, worst"], table)


if __name__ == "__main__":
    main()
