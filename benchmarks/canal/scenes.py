"""Scenes of the benchmark, each by a seed that also chooses its shape, and what is compared on them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float
from tunneldb.registration.underwater import Ladder, Near, SonarCloud
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


def block(seed: int) -> CanalParameters:
    """Twenty stations 5 m apart, four ladders among them."""
    return replace(
        usual(seed), length=110.0, ladders=4, sonar_stations=20, sonar_spacing=5.0, laser_stations=6, laser_spacing=20.0
    )


def dense(seed: int) -> CanalParameters:
    """Return a scan with the instrument's finest step."""
    return replace(usual(seed), sonar_step=0.09)


def long(seed: int) -> CanalParameters:
    """The tunnel of Moisan et al. (2015), 475 m, with stations 5 m apart and a ladder each 60 m; straight, as that one is."""
    return replace(
        usual(seed),
        length=490.0,
        radius=0.0,
        ladders=8,
        sonar_stations=95,
        sonar_spacing=5.0,
        laser_stations=30,
        laser_spacing=16.0,
    )


def one_ladder(seed: int) -> CanalParameters:
    """One ladder: whatever it is taken for, nothing else along the tunnel contradicts."""
    return replace(usual(seed), ladders=1, sonar_spacing=5.0)


def no_ladder(seed: int) -> CanalParameters:
    """Two walls and nothing else: they say nothing of the place along, of the height, or which way round."""
    return replace(usual(seed), ladders=0, piers=0, niches=0, boat=False)


SCENES: Mapping[str, Callable[[int], CanalParameters]] = {
    "usual": usual,
    "block": block,
    "paced-block": block,
    "dense": dense,
    "long": long,
    "one-ladder": one_ladder,
    "no-ladder": no_ladder,
}
"""Kinds of scenes by name."""

PACED: Mapping[str, float] = {"paced-block": 3.0, "long": 3.0}
"""Kinds in which it is known where each sonar stood, within so many metres, as by a tape along the wall."""


def case_of(kind: str, seed: int) -> Case:
    """Simulate a scene."""
    parameters = SCENES[kind](seed)
    scene = simulate(parameters)
    up = -1 if parameters.sonar_z_down else 1
    within, rng = PACED.get(kind), np.random.default_rng([seed, 98])
    clouds = tuple(
        SonarCloud(Path(f"{scan.name}.xyz"), scan.points, up, None if within is None else _near(scan, within, rng))
        for scan in scene.sonar
    )
    ladders = tuple(
        Ladder(one.name, tuple(range(1, len(one.heights) + 1)), one.heights, one.stile_gap, one.diameter)
        for one in scene.ladders
    )
    return Case(scene, clouds, ladders)


def _near(scan: SonarScan, within: float, rng: np.random.Generator) -> Near:
    off = rng.normal(0.0, within / 3.0, 2)
    return Near(scan.translation[:2] + off, within)


def check_points(scan: SonarScan) -> Float:
    """Points (n, 3) of a scan's file about which it is asked where they lie."""
    near = scan.points[(np.linalg.norm(scan.points, axis=1) * scan.scale < CHECK_REACH) & (scan.kind >= 0)]
    return near[:: max(1, len(near) // CHECKS)]


def true_places(scan: SonarScan, points: Float) -> Float:
    """Return the true places of points (n, 3) of a scan's file."""
    return np.asarray(scan.scale * points @ scan.rotation.T + scan.translation)
