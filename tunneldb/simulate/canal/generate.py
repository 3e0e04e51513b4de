"""Synthetic canal tunnel with all its scans."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float, Int32
from tunneldb.simulate.canal.centreline import Centreline
from tunneldb.simulate.canal.laser import scan_by_laser
from tunneldb.simulate.canal.layout import Layout, TrueLadder, lay_out
from tunneldb.simulate.canal.parameters import CanalParameters
from tunneldb.simulate.canal.section import Section, bed_heights, clearances
from tunneldb.simulate.canal.sonar import SonarScan, scan_by_sonar

AXIS_HEIGHT = 1.0  # of the given axis above the water, m
VERTEX_SPACING = 5.0  # of the given axis, m


@dataclass(frozen=True)
class CanalScene:
    """Canal tunnel with its scans and reference data; points and positions in the tunnel's frame, m.

    Attributes
    ----------
    laser : (n, 3) float array
    laser_station : (n,) int array
        From 1.
    laser_places : (k, 3) float array
    sonar : tuple of SonarScan
    ladders : tuple of TrueLadder
    axis : (m, 3) float array
        Vertices of the given axis.
    """

    parameters: CanalParameters
    line: Centreline
    layout: Layout
    laser: Float
    laser_station: Int32
    laser_places: Float
    sonar: tuple[SonarScan, ...]
    axis: Float

    @property
    def ladders(self) -> tuple[TrueLadder, ...]:
        """Ladders in the water."""
        return self.layout.ladders

    @property
    def section(self) -> Section:
        """Return the cross-section for compiled functions."""
        return self.layout.scene.section

    def distance(self, points: Float) -> Float:
        """Return the distance (n,) of points (n, 3) from the nearest surface (a lower bound), m; negative behind; no ladder."""
        return clearances(self.section, self.layout.scene.solids, self.line.to_local(points))[0]

    def bed_height(self, chainage: Float, across: Float) -> Float:
        """Return the height (n,) of the bed in the tunnel's frame at chainages and distances right of the axis (n,), m."""
        stations = np.asarray(chainage, float) - 0.5 * self.parameters.length
        return self.parameters.water_level + bed_heights(self.section, stations, -np.asarray(across, float))

    def bed_volume(self, start: float, stop: float, height: float, half_width: float) -> float:
        """Return the volume of the bed above a height between two chainages, ``half_width`` m either side, m³ (5 cm cells)."""
        step = 0.05
        x, y = np.meshgrid(np.arange(start + step / 2, stop, step), np.arange(-half_width + step / 2, half_width, step))
        above = self.bed_height(x.ravel(), y.ravel()) - height
        area = step * step * (1.0 + y.ravel() / self.parameters.radius if self.parameters.radius else 1.0)
        return float((np.maximum(above, 0.0) * area).sum())


def simulate(parameters: CanalParameters, progress: Callable[[str], None] = lambda what: None) -> CanalScene:
    """Make a canal tunnel and scan it; ``progress`` receives descriptions of completed steps."""
    line = Centreline.of(parameters)
    layout = lay_out(parameters, line)
    points, number = scan_by_laser(parameters, layout)
    progress("laser")
    scans: list[SonarScan] = []
    for tripod in layout.tripods:
        for tilt in parameters.sonar_tilts:
            turn, origin = line.rotation(), np.array(line.origin)
            scans.append(scan_by_sonar(parameters, layout, tripod, len(scans) + 1, tilt, turn, origin))
            progress(scans[-1].name)
    axis = line.vertices(VERTEX_SPACING) + np.array([0.0, 0.0, AXIS_HEIGHT])
    return CanalScene(
        parameters, line, layout, line.to_tunnel(points), number, line.to_tunnel(layout.lasers), tuple(scans), axis
    )
