"""What a registration of sonar scans takes and gives.

Frames: a sonar's file has axes of its own, m, origin at the transducer; the tunnel's is that of its SRID, z up, m. A point
of a file lies in the tunnel at ``rotation @ (scale * point) + translation``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float

GIVEN = "given"
"""State of a scan whose file is in the tunnel's system already."""

PARAMETERS = ("turn x", "turn y", "turn z", "shift x", "shift y", "shift z", "scale")


@dataclass(frozen=True)
class Ladder:
    """A ladder as it was measured before it was put into the water.

    Attributes
    ----------
    name : str
    number : tuple of int
        Numbers of its rungs, in growing height.
    height : (r,) float64 array
        Heights of the rungs' middles along the ladder from any zero, growing, m.
    stile_gap : float
        Between the middles of its two stiles, m.
    diameter : float
        Of rungs and stiles, m.
    """

    name: str
    number: tuple[int, ...]
    height: Float
    stile_gap: float
    diameter: float


@dataclass(frozen=True)
class Near:
    """Where a sonar stood, roughly: a place (2,) in the tunnel's plan, and within how far of it, m."""

    place: Float
    within: float

    def holds(self, place: Float) -> bool:
        """Whether a place (2,) or (3,) lies there."""
        return bool(np.linalg.norm(place[:2] - self.place) <= self.within)


@dataclass(frozen=True)
class SonarCloud:
    """A sonar scan as its file has it: points (n, 3), m, whether its z axis points up (1) or down (-1), and where it stood."""

    path: Path
    points: Float
    up: int
    near: Near | None = None

    def may_stand(self, place: Float) -> bool:
        """Whether the sonar may have stood at a place (2,) or (3,)."""
        return self.near is None or self.near.holds(place)


@dataclass(frozen=True)
class Residual:
    """What is left between a sonar scan and something that it was fitted to.

    Attributes
    ----------
    kind : str
        ``wall``, ``ladder``, ``waterline`` or ``scan`` (the overlap with another sonar scan).
    name : str
        Which one: the ladder's name, the other scan's file, or the side of the wall.
    count : int
        Points or patches that were used.
    median, p95 : float
        Of the absolute distances, m.
    """

    kind: str
    name: str
    count: int
    median: float
    p95: float


@dataclass(frozen=True)
class SonarPose:
    """Pose of a sonar scan.

    Attributes
    ----------
    path : Path
    rotation, translation, scale
        See the module; (3, 3), (3,) m, and a number near 1.
    covariance : (7, 7) float64 array
        Of PARAMETERS: turns about the tunnel's axes through the scanner, rad, shifts of the scanner, m, and scale.
    state : str
        ``determined``, ``weak`` (some direction is known worse than it should be) or ``undetermined`` (one is not known).
    undetermined : tuple of str
        Directions in words, as ``along the tunnel``, ``height``, ``yaw``; of weak ones too; ``ladders disagree``.
    residuals : tuple of Residual
    """

    path: Path
    rotation: Float
    translation: Float
    scale: float
    covariance: Float
    state: str
    undetermined: tuple[str, ...]
    residuals: tuple[Residual, ...]


@dataclass(frozen=True)
class LadderFit:
    """Where a ladder stands, by the laser.

    Attributes
    ----------
    name : str
    origin : (3,) float64 array
        Middle between the stiles at height zero of the ladder, m.
    up, across, out : (3,) float64 arrays
        Unit vectors along the stiles upwards, along the rungs, and from the wall to the water.
    rms : float
        Of the laser's points from it, m.
    rungs : tuple of int
        Numbers of the rungs that the laser saw.
    scans : tuple of str
        Names of the sonar files that saw it.
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
    """Outcome for all scans at once; water_level is the height of the water, m."""

    scans: tuple[SonarPose, ...]
    ladders: tuple[LadderFit, ...]
    water_level: float
    notes: tuple[str, ...] = ()
