"""Input and results of a registration of sonar scans.

Frames: a sonar's file has its own axes, m, with the origin at the transducer; the tunnel's frame is that of its SRID, z up,
m. A point of a file is in the tunnel's frame at ``rotation @ (scale * point) + translation``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float

GIVEN = "given"
"""State of a scan whose file is already in the tunnel's system."""

PARAMETERS = ("turn x", "turn y", "turn z", "shift x", "shift y", "shift z", "scale")


@dataclass(frozen=True)
class Ladder:
    """Ladder as measured before it was placed in the water.

    Attributes
    ----------
    name : str
    number : tuple of int
        Numbers of its rungs, by ascending height.
    height : (r,) float64 array
        Heights of the rungs' axes along the ladder from any zero, ascending, m.
    stile_gap : float
        Distance between the axes of its two stiles, m.
    diameter : float
        Diameter of the rungs, m; the stiles may be thicker.
    """

    name: str
    number: tuple[int, ...]
    height: Float
    stile_gap: float
    diameter: float


MAX_HEADING_ERROR = np.radians(60.0)  # of an approximate heading


@dataclass(frozen=True)
class Near:
    """Approximate place of a sonar: (2,) in the tunnel's plan, and its greatest error, m; heading of its x axis, rad, if known.

    The heading is counted anticlockwise from the tunnel's x axis.
    """

    place: Float
    within: float
    heading: float | None = None

    def holds(self, place: Float) -> bool:
        """Return True if a place (2,) or (3,) is within the error."""
        return bool(np.linalg.norm(place[:2] - self.place) <= self.within)


@dataclass(frozen=True)
class SonarCloud:
    """Sonar scan as in its file: points (n, 3), m, z axis up (1) or down (-1), and approximate place."""

    path: Path
    points: Float
    up: int
    near: Near | None = None

    def may_stand(self, place: Float) -> bool:
        """Return True if the sonar may have been at a place (2,) or (3,)."""
        return self.near is None or self.near.holds(place)

    def may_face(self, rotation: Float) -> bool:
        """Return True if the sonar may have had a rotation (3, 3) from its file's axes to the tunnel's."""
        if self.near is None or self.near.heading is None:
            return True
        own = float(np.arctan2(rotation[1, 0], rotation[0, 0]))
        return bool(np.cos(own - self.near.heading) > np.cos(MAX_HEADING_ERROR))


@dataclass(frozen=True)
class Residual:
    """Residuals of a sonar scan relative to something that it was fitted to.

    Attributes
    ----------
    kind : str
        ``wall``, ``ladder``, ``waterline`` or ``scan`` (the overlap with another sonar scan).
    name : str
        Name of the ladder, of the other scan's file, or of the wall's side.
    count : int
        Number of points or patches used.
    median, p95 : float
        Median and 95th percentile of the absolute distances, m.
    """

    kind: str
    name: str
    count: int
    median: float
    p95: float


@dataclass(frozen=True)
class Alternative:
    """Possible pose of a scan that is not determined: as in `SonarPose`, with its probability among the listed ones."""

    rotation: Float
    translation: Float
    scale: float
    probability: float


@dataclass(frozen=True)
class SonarPose:
    """Pose of a sonar scan.

    Attributes
    ----------
    path : Path
    rotation, translation, scale
        As in this module's docstring; (3, 3), (3,) m, and a number near 1.
    covariance : (7, 7) float64 array
        Covariance of PARAMETERS: turns about the tunnel's axes through the scanner, rad, shifts of the scanner, m, and scale.
    state : str
        ``determined``, ``weak`` (a direction is less certain than required) or ``undetermined`` (a direction is unknown).
    undetermined : tuple of str
        Names of undetermined and weak directions, as ``along the tunnel``, ``height``, ``yaw``; ``ladders disagree``.
    residuals : tuple of Residual
    alternatives : tuple of Alternative
        Possible poses of a scan without a pose, the most likely first.
    walls : (k, 3) float64 array
        Places of upright walls that it shows, file's axes.
    """

    path: Path
    rotation: Float
    translation: Float
    scale: float
    covariance: Float
    state: str
    undetermined: tuple[str, ...]
    residuals: tuple[Residual, ...]
    alternatives: tuple[Alternative, ...] = ()
    walls: Float = field(default_factory=lambda: np.zeros((0, 3)))


@dataclass(frozen=True)
class LadderFit:
    """Place of a ladder in the laser scan.

    Attributes
    ----------
    name : str
    origin : (3,) float64 array
        Midpoint between the stiles at height zero of the ladder, m.
    up, across, out : (3,) float64 arrays
        Unit vectors up along the stiles, along the rungs, and from the wall to the water.
    rms : float
        Root mean square distance of the laser's points from it, m.
    rungs : tuple of int
        Numbers of the rungs in the laser scan.
    scans : tuple of str
        Names of the sonar files that show it.
    """

    name: str
    origin: Float
    up: Float
    across: Float
    out: Float
    rms: float
    rungs: tuple[int, ...]
    scans: tuple[str, ...]


@dataclass(frozen=True)
class Registration:
    """Result for all scans.

    Attributes
    ----------
    scans : tuple of SonarPose
    ladders : tuple of LadderFit
    water_level : float
        Height of the water, m.
    notes : tuple of str
    plan : (k, 2) float64 array
        Points of the walls at the waterline, as the laser sees them, m.
    """

    scans: tuple[SonarPose, ...]
    ladders: tuple[LadderFit, ...]
    water_level: float
    notes: tuple[str, ...] = ()
    plan: Float = field(default_factory=lambda: np.zeros((0, 2)))
