"""A long tunnel of which only a little around the end of each kilometre was scanned.

All that is hard about borders is there, and a kilometre takes a second or two to process.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path

import laspy
import numpy as np
import shapely.affinity
from numpy.typing import NDArray
from shapely.geometry import Polygon

from tunneldb.simulate import Parameters, Simulation
from tunneldb.simulate.lining.leaks import Leak
from tunneldb.simulate.rays.scene import scene
from tunneldb.simulate.scanner import BlockPlan

SRID = 25830
NAME = "long"
REACH = 25.0  # m
DENSITY = 100.0  # points per m²
# Stage parameters that suit a thin scan.
THIN = ("image.pixel=0.25", "axis.tolerance=0.005")


@dataclass(frozen=True)
class Scan:
    """Points in the order of their time: coordinates (n, 3), time, amplitude (dB), true chainage and arc (n,)."""

    xyz: NDArray[np.float64]
    time: NDArray[np.float64]
    amplitude: NDArray[np.float32]
    chainage: NDArray[np.float64]
    arc: NDArray[np.float32]

    def part(self, chosen: NDArray[np.bool_]) -> Scan:
        """Some of the points."""
        return replace(self, **{f.name: getattr(self, f.name)[chosen] for f in fields(self)})


@dataclass(frozen=True)
class Scene:
    """A simulated survey: the tunnel, the points and the chainage of its beginning, m."""

    simulation: Simulation
    scan: Scan
    start: float

    def write_poses(self, folder: Path) -> list[object]:
        """Write what `tunneldb tunnel add` and `survey add` want; return the options."""
        line = self.simulation.tunnel.line
        tables = {
            "axis": ("x,y,z", line.vertices(20.0)),
            "trajectory": ("time,x,y,z", self.simulation.scanner.trajectory()),
            "reference": ("range_m,intensity_db", self.simulation.reference),
        }
        for name, (columns, rows) in tables.items():
            np.savetxt(folder / f"{name}.csv", rows, fmt="%.4f", delimiter=",", header=columns, comments="")
        return [o for name in ("trajectory", "reference") for o in (f"--{name}", folder / f"{name}.csv")]


def make(first: int, last: int) -> Scene:
    """Scan the tunnel within REACH of each kilometre plane from ``first`` to ``last``.

    A leak lies near each plane; at every other one it lies across it.
    """
    planes = tuple(1000.0 * km for km in range(first, last + 1))
    start = planes[0] - REACH
    parameters = Parameters(
        name=NAME,
        srid=SRID,
        section_radius=2.0,
        invert=1.4,
        length=planes[-1] + REACH - start,
        radius=4000.0,
        slope=1.7,
        start_chainage=start,
        scanner="profiler",
        speed=20.0,
        density=DENSITY,
        leaks=0,
        appendages=False,
        niches=False,
    )
    simulation = Simulation(parameters)
    simulation.leaks = [leak for n, plane in enumerate(planes) for leak in _leaks(2 * n + 1, plane, across=n % 2 == 1)]
    simulation._scene = scene(simulation.tunnel, [], [], simulation.leaks)
    clouds = [simulation.make(BlockPlan(n, p - REACH, 0, 0, 0, p + REACH)) for n, p in enumerate(planes)]
    scan = Scan(**{f.name: np.concatenate([getattr(cloud, f.name) for cloud in clouds]) for f in fields(Scan)})
    return Scene(simulation, scan, start)


def _leaks(number: int, plane: float, *, across: bool) -> list[Leak]:
    """Two leaks beside a plane, or one of them across it."""
    outlines = [
        shapely.affinity.scale(shapely.Point(plane + (0.0 if across else -8.0), -1.5).buffer(1.0), 2.2, 0.9),
        shapely.affinity.scale(shapely.Point(plane + 10.0, 2.0).buffer(1.0), 0.8, 1.4),
    ]
    return [Leak(number + i, Polygon(o.exterior), o.area, 7.0) for i, o in enumerate(outlines)]


def write_laz(path: Path, scan: Scan) -> Path:
    """Write points as LAS 1.4 with the amplitude in an extra dimension."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 0.001), np.floor(scan.xyz.min(axis=0))
    header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", "float32"))
    las = laspy.LasData(header)
    las.x, las.y, las.z = scan.xyz.T
    las.gps_time = scan.time
    las.point_source_id = np.ones(len(scan.time), np.uint16)
    las.Amplitude = scan.amplitude
    las.write(path)
    return path


def split(scan: Scan, folder: Path, number: Callable[[Scan], NDArray[np.int64]]) -> list[Path]:
    """Write points as several files, by a number of each."""
    numbers = number(scan)
    return [write_laz(folder / f"part-{n:02d}.laz", scan.part(numbers == n)) for n in np.unique(numbers)]


def anyhow(scan: Scan) -> NDArray[np.int64]:
    """Files whose borders have nothing to do with kilometres: some span three, and every third window is shared."""
    window = np.round(scan.chainage / 1000.0).astype(int)
    number = (scan.chainage + 990.0) // 1500.0
    shared = window % 3 == 2
    # Shared by two scans of the same place, as it were: every other point.
    return np.where(shared & (np.arange(len(number)) % 2 == 0), 50 + window, number).astype(np.int64)
