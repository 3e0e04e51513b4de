"""The axis of a tunnel in the grid of the survey."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.blind.known.section import Array


@dataclass(frozen=True)
class Axis:
    """An arc (or a straight line, if curvature is 0) of constant slope.

    Attributes
    ----------
    east, north, height : float
        Where chainage is 0, on the floor.
    heading : float
        Direction there, radians anticlockwise from east.
    curvature : float
        1/m, positive to the left.
    slope : float
        Rise per metre.
    """

    east: float
    north: float
    height: float
    heading: float
    curvature: float = 0.0
    slope: float = 0.0

    def world(self, u: Array, y: Array, z: Array) -> Array:
        """Coordinates of points at chainage u, y to the left and z above the floor."""
        heading = self.heading + self.curvature * u
        if self.curvature == 0.0:
            along_e, along_n = u * np.cos(self.heading), u * np.sin(self.heading)
        else:
            along_e = (np.sin(heading) - np.sin(self.heading)) / self.curvature
            along_n = (np.cos(self.heading) - np.cos(heading)) / self.curvature
        east = self.east + along_e - y * np.sin(heading)
        north = self.north + along_n + y * np.cos(heading)
        return np.column_stack([east, north, self.height + self.slope * u + z])
