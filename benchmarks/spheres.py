"""Target spheres: found, invented, and how well centred, on simulated scenes; the paper's way on the same points beside.

    python -m benchmarks.spheres                 # 20 scenes, about 10 minutes
    python -m benchmarks.spheres --scenes 4

Sections, both scanners, slopes, roughness of the floor and seeds change from scene to scene; people, equipment, bollards,
round lamps of other radii, cables and sleepers stand in all of them. A sphere counts if a scan has 60 points or more on it
that cover 20 % or more of its surface. The paper's way (Li et al., 2023): DBSCAN, clusters as wide as a sphere (eq. 5 to 7), a
least-squares sphere of any radius (eq. 8); it is given only the points that are neither lining nor ground by the truth.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import pdist

from benchmarks.common import print_table, progress, save
from tunneldb.classification.objects.dbscan import dbscan
from tunneldb.classification.targets.curvature import CurvedCells
from tunneldb.classification.targets.detection import MIN_POINTS, Sphere, confirmed, find_spheres, join
from tunneldb.classification.targets.fit import coverage, distance_error, fit_ratio
from tunneldb.simulate import Parameters, Simulation

RADIUS, TOLERANCE = 0.0725, 0.005
POINTS, COVERAGE = 60, 0.2
NEAR = 0.03  # m; a sphere found nearer to a true one than this is that one
SECTIONS: tuple[Literal["circular", "horseshoe", "box"], ...] = ("circular", "horseshoe", "box")
LINING, FLOOR, NICHE, SPHERE = 0, 1, 3, 7
PAPER = "99.86, 99.53, 92.93"  # R_fit, %, Table 4 of the paper; E_distance 1.36, 0.29, 3.87 mm

Float = NDArray[np.float64]


@dataclass
class Tally:
    """What a way of finding spheres has come to."""

    seen: int = 0
    found: int = 0
    invented: int = 0
    errors: list[float] = field(default_factory=list)
    free: list[float] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)
    scaled: list[float] = field(default_factory=list)
    extra: int = 0
    seconds: float = 0.0

    def add(self, truth: Float, counted: NDArray[np.bool_], found: list[tuple[Float, float, float]]) -> None:
        """Take a scan into account: true centres (k, 3), whether each counts, and centre, radius and sigma of those found."""
        taken = set()
        for centre, radius, sigma in found:
            gaps = [distance_error(centre, true) for true in truth]
            k = int(np.argmin(gaps)) if gaps else -1
            if k < 0 or gaps[k] > NEAR or k in taken:
                self.invented += 1
                continue
            taken.add(k)
            if not counted[k]:
                self.extra += 1
                continue
            self.found += 1
            self.errors.append(gaps[k])
            self.ratios.append(fit_ratio(gaps[k], radius, RADIUS))
            self.scaled.append(gaps[k] / sigma if sigma else np.nan)
        self.seen += int(counted.sum())

    def figures(self) -> dict[str, Any]:
        """Figures to print and to keep."""
        errors = 1e3 * np.array(self.errors or [np.nan])
        ratios = 100 * np.array(self.ratios or [np.nan])
        return {
            "seen": self.seen,
            "found": self.found,
            "invented": self.invented,
            "found beyond": self.extra,
            "E_distance median mm": round(float(np.median(errors)), 2),
            "p95 mm": round(float(np.quantile(errors, 0.95)), 2),
            "max mm": round(float(errors.max()), 2),
            "error / sigma": round(float(np.sqrt(np.mean(np.square(self.scaled or [np.nan])))), 2),
            "R_fit median %": round(float(np.median(ratios)), 2),
            "R_fit least %": round(float(ratios.min()), 2),
            "s": round(self.seconds, 1),
        }


def scene(number: int) -> Parameters:
    """Parameters of a scene."""
    return Parameters(
        length=24.0,
        seed=100 + number,
        section=SECTIONS[number % 3],
        scanner=("static", "profiler")[number % 2],
        slope=(0.0, 2.0, 4.0, -3.0)[number % 4],
        radius=(300.0, 0.0)[number // 2 % 2],
        station_spacing=10.0,
        angular_step=0.12,
        profile_spacing=0.012,
        profile_points=2200,
        leaks=1,
        people=3,
        equipment=4,
        bollards=2,
        globes=3,
        spheres=6,
        sphere_radius=RADIUS,
        free_cables=1,
        sleepers=number % 2 == 0,
        catenary=number % 3 == 0,
        ballast=(0.0, 0.01, 0.02, 0.03)[number // 2 % 4],
    )


def eyes_of(simulation: Simulation, time_: Float, scan: NDArray[Any]) -> Float:
    """Return the scanner position of each point (n, 3), m."""
    scanner = simulation.scanner
    if simulation.parameters.scanner == "static":
        return np.asarray(scanner.stations()[scan.astype(int) - 1])
    track = scanner.trajectory()
    return np.column_stack([np.interp(time_, track[:, 0], track[:, k]) for k in (1, 2, 3)])


def on_sphere(points: Float, sphere: Sphere) -> NDArray[np.bool_]:
    """Points within three times the rms of a sphere that was found."""
    far = np.linalg.norm(points - sphere.centre, axis=1)
    return np.abs(far - RADIUS) <= 3.0 * sphere.rms


def any_radius(points: Float) -> tuple[Float, float]:
    """Centre and radius of the least-squares sphere of any radius (eq. 8)."""
    middle = points.mean(axis=0)
    near = points - middle
    best = least_squares(lambda x: np.linalg.norm(near - x[:3], axis=1) - x[3], [0.0, 0.0, 0.0, RADIUS])
    return middle + best.x[:3], float(best.x[3])


def paper_way(points: Float) -> list[tuple[Float, float, float]]:
    """Clusters as wide as a sphere, and the sphere of any radius that fits each best: centre, radius, 0."""
    labels = dbscan(points, 0.03, 5)
    found = []
    for label in range(labels.max(initial=-1) + 1):
        cluster = points[labels == label]
        if len(cluster) < MIN_POINTS or np.ptp(cluster, axis=0).max() > 2 * RADIUS + TOLERANCE:
            continue
        try:
            width = pdist(cluster[ConvexHull(cluster - cluster[0]).vertices]).max()
        except QhullError:
            continue
        if not 2 * RADIUS - TOLERANCE <= width <= 2 * RADIUS + TOLERANCE:
            continue
        found.append((*any_radius(cluster), 0.0))
    return found


def run(number: int, ours: Tally, free: Tally, paper: Tally) -> int:
    """Measure a scene; returns its points."""
    simulation = Simulation(scene(number))
    clouds = [cloud for _, cloud in simulation.blocks()]
    xyz = np.concatenate([cloud.xyz for cloud in clouds])
    scan = np.concatenate([cloud.scan_id for cloud in clouds])
    klass = np.concatenate([cloud.klass for cloud in clouds])
    thing = np.concatenate([cloud.thing for cloud in clouds])
    eyes = eyes_of(simulation, np.concatenate([cloud.time for cloud in clouds]), scan)
    truth = np.array([sphere.centre for sphere in simulation.spheres])
    begun = time.perf_counter()
    curved = CurvedCells(RADIUS, MIN_POINTS)
    curved.add(xyz)
    curved.close()
    kept = curved.holds(xyz)
    ours.seconds += time.perf_counter() - begun
    seen = []
    for one in np.unique(scan):
        chosen = np.flatnonzero(kept & (scan == one))
        begun = time.perf_counter()
        found, _ = find_spheres(xyz[chosen], eyes[chosen], RADIUS, TOLERANCE)
        ours.seconds += time.perf_counter() - begun
        seen += [(int(one), sphere) for sphere in found]
    group = join(np.array([sphere.centre for _, sphere in seen]), np.array([one for one, _ in seen]), RADIUS)
    good = confirmed(group, np.array([sphere.firm for _, sphere in seen]))
    for one in np.unique(scan):
        spheres = [sphere for (of, sphere), sure in zip(seen, good, strict=True) if of == one and sure]
        counted = np.zeros(len(truth), bool)
        for k, target in enumerate(simulation.spheres):
            on = np.flatnonzero((scan == one) & (klass == SPHERE) & (thing == target.id))
            towards = (eyes[on] - truth[k]).mean(axis=0) if len(on) else np.ones(3)
            counted[k] = len(on) >= POINTS and coverage(xyz[on], truth[k], towards) >= COVERAGE
        here = np.flatnonzero(kept & (scan == one))
        for sphere in spheres:
            gaps = [distance_error(sphere.centre, true) for true in truth]
            if min(gaps) > NEAR:
                there = here[np.linalg.norm(xyz[here] - sphere.centre, axis=1) < 1.3 * RADIUS]
                kinds = {item.kind for item in simulation.things if item.number in set(thing[there].tolist())}
                progress(f"  invented: {sphere}, on classes {np.unique(klass[there])} {kinds}")
        for k in np.flatnonzero(counted).tolist():
            if not spheres or min(distance_error(sphere.centre, truth[k]) for sphere in spheres) > NEAR:
                progress(f"  missed: sphere {k + 1} ({simulation.spheres[k].kind}) by scan {one}")
        near = [xyz[here][on_sphere(xyz[here], sphere)] for sphere in spheres]
        ours.add(truth, counted, [(sphere.centre, RADIUS, sphere.sigma) for sphere in spheres])
        free.add(truth, counted, [(*any_radius(points), 0.0) for points in near])
        begun = time.perf_counter()
        off = (scan == one) & ~np.isin(klass, (LINING, FLOOR, NICHE))
        paper.add(truth, counted, paper_way(xyz[off]))
        paper.seconds += time.perf_counter() - begun
    return len(xyz)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene, which its seed follows from")
    arguments = parser.parse_args()
    tallies = {"fixed radius": Tally(), "free radius": Tally(), "paper's way": Tally()}
    points = 0
    for number in range(arguments.first, arguments.first + arguments.scenes):
        progress(f"scene {number}")
        points += run(number, *tallies.values())
    figures = {name: tally.figures() for name, tally in tallies.items()}
    names = list(figures["fixed radius"])
    print_table("Target spheres", ["", *names], [[name, *(str(values[n]) for n in names)] for name, values in figures.items()])
    print(f"{points:,} points, {points / tallies['fixed radius'].seconds:,.0f} points/s (decoding not counted)")
    print(f"The paper, three spheres: R_fit {PAPER} %, E_distance 1.36, 0.29, 3.87 mm")
    print(save("spheres", {"first": arguments.first, "scenes": arguments.scenes, "points": points, **figures}))


if __name__ == "__main__":
    main()
