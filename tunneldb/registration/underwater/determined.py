"""Classification of the directions of a pose: determined, weak or undetermined."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float

MIN_WEAK_SHIFT, MIN_OPEN_SHIFT = 0.05, 0.1  # standard deviations of a position from which it is weak, and undetermined, m
MIN_WEAK_TURN, MIN_OPEN_TURN = np.radians(0.2), np.radians(3.0)
MIN_WEAK_SCALE = 0.005


def classify_pose(covariance: Float, along: Float) -> tuple[str, tuple[str, ...]]:
    """Return the state of a pose, and the names of its badly determined directions.

    Parameters
    ----------
    covariance : (7, 7) float64 array
        Covariance of `results.PARAMETERS`.
    along : (2,) float64 array
        Direction of the canal in plan.

    Returns
    -------
    state : str
        As in `results.SonarPose`.
    directions : tuple of str
    """
    ahead = np.array([along[0], along[1], 0.0])
    across = np.array([-along[1], along[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    turn, place = covariance[:3, :3], covariance[3:6, 3:6]
    checks = [
        ("along the tunnel", ahead @ place @ ahead, MIN_WEAK_SHIFT, MIN_OPEN_SHIFT),
        ("across the tunnel", across @ place @ across, MIN_WEAK_SHIFT, MIN_OPEN_SHIFT),
        ("height", up @ place @ up, MIN_WEAK_SHIFT, MIN_OPEN_SHIFT),
        ("roll", ahead @ turn @ ahead, MIN_WEAK_TURN, MIN_OPEN_TURN),
        ("pitch", across @ turn @ across, MIN_WEAK_TURN, MIN_OPEN_TURN),
        ("yaw", up @ turn @ up, MIN_WEAK_TURN, MIN_OPEN_TURN),
        ("range scale", covariance[6, 6], MIN_WEAK_SCALE, np.inf),
    ]
    named, state = [], "determined"
    for name, variance, weak, unknown in checks:
        sigma = np.sqrt(max(variance, 0.0))
        if not sigma < weak:
            named.append(name)
            state = "undetermined" if not sigma < unknown else ("weak" if state == "determined" else state)
    return state, tuple(named)
