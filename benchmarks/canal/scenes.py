"""Scenes of the benchmark, each by a seed that also chooses its shape, and what is compared on them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float
from tunneldb.registration.underwater import Ladder, SonarCloud
from tunneldb.simulate.canal import CanalParameters, CanalScene, SonarScan, simulate

CHECK_REACH = 10.0  # m of the check points from the sonar
CHECKS = 2000  # of them


@dataclass(frozen=True)
class Case:
    """A scene as a registration takes it."""

    scene: CanalScene
    clouds: tuple[SonarCloud, ...]
    ladders: tuple[Ladder, ...]

    @property
    def water_level(self) -> float:
        """Height of the water, m."""
        return self.scene.parameters.water_level


def usual(seed: int) -> CanalParameters:
    """Two ladders, three stations 5 or 10 m apart, all else by chance: batter, towpath, piers, objects, a boat, a curve."""
    rng = np.random.default_rng([seed, 99])
    return CanalParameters(
        seed=seed,
        azimuth=float(rng.uniform(0.0, 360.0)),
        radius=float(rng.choice([0.0, 0.0, 300.0, -300.0])),
        batter=float(rng.uniform(0.0, 4.0)),
        batter_below=float(rng.uniform(0.0, 4.0)),
        towpath=str(rng.choice(["none", "left", "right"])),
        piers=int(rng.integers(0, 5)),
        niches=int(rng.integers(0, 5)),
        objects=int(rng.integers(0, 8)),
        boat=bool(rng.random() < 0.2),
        hidden_rungs=int(rng.integers(0, 3)),
        sonar_spacing=float(rng.choice([5.0, 5.0, 10.0])),
        sonar_z_down=bool(rng.random() < 0.5),
        roughness=float(rng.uniform(0.004, 0.015)),
        bed_relief=float(rng.uniform(0.03, 0.12)),
    )


def case_of(parameters: CanalParameters) -> Case:
    """Simulate a scene."""
    scene = simulate(parameters)
    up = -1 if parameters.sonar_z_down else 1
    clouds = tuple(SonarCloud(Path(f"{scan.name}.xyz"), scan.points, up) for scan in scene.sonar)
    ladders = tuple(
        Ladder(one.name, tuple(range(1, len(one.heights) + 1)), one.heights, one.stile_gap, one.diameter)
        for one in scene.ladders
    )
    return Case(scene, clouds, ladders)


def check_points(scan: SonarScan) -> Float:
    """Points (n, 3) of a scan's file about which it is asked where they lie."""
    near = scan.points[(np.linalg.norm(scan.points, axis=1) * scan.scale < CHECK_REACH) & (scan.kind >= 0)]
    return near[:: max(1, len(near) // CHECKS)]


def true_places(scan: SonarScan, points: Float) -> Float:
    """Where points (n, 3) of a scan's file lie, by the truth."""
    return np.asarray(scan.scale * points @ scan.rotation.T + scan.translation)
