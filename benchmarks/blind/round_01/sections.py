"""Cross-sections: circle, box, horseshoe and three-centred arch, each with a level floor."""

from __future__ import annotations

import numpy as np

from .frames import Array, Section

FINE = np.radians(0.25)


def _arc(centre: tuple[float, float], radius: float, start: float, end: float) -> Array:
    """Points of an arc; angles from the upward vertical towards the left."""
    angle = np.linspace(start, end, max(2, int(abs(end - start) / FINE)))
    return np.stack([centre[0] + radius * np.sin(angle), centre[1] + radius * np.cos(angle)], axis=-1)


def circle(radius: float, floor: float) -> Section:
    """A circle about the axis; the floor lies ``floor`` below it."""
    wall = _arc((0.0, 0.0), radius, np.pi - np.arccos(floor / radius), 0.0)
    wall[-1] = (0.0, radius)
    return Section(np.concatenate([[(0.0, -floor)], wall]), 1)


def box(width: float, height: float, floor: float, haunch: float) -> Section:
    """A rectangle with bevelled upper corners; the floor lies ``floor`` below the axis."""
    half, top = width / 2, height - floor
    corners = [(0.0, -floor), (half, -floor), (half, top - haunch), (half - haunch, top), (0.0, top)]
    return Section(np.array(corners), 1)


def horseshoe(radius: float, wall: float, floor: float, batter: float) -> Section:
    """A semicircle on walls that lean in towards the floor by ``batter`` on either side."""
    springing = wall - floor
    arch = _arc((0.0, springing), radius, np.pi / 2, 0.0)
    arch[-1] = (0.0, springing + radius)
    return Section(np.concatenate([[(0.0, -floor), (radius - batter, -floor)], arch]), 1)


def three_centred(crown: float, side: float, turn: float, floor: float) -> Section:
    """A crown arc and tighter side arcs that are tangent to it.

    Parameters
    ----------
    crown, side : float
        Radii; the crown's centre is the axis.
    turn : float
        Angle from the vertical at which the side arcs begin, degrees.
    floor : float
        Depth of the floor below the axis.
    """
    bend = np.radians(turn)
    centre = ((crown - side) * np.sin(bend), (crown - side) * np.cos(bend))
    end = np.pi - np.arccos((floor + centre[1]) / side)
    wall = np.concatenate([_arc(centre, side, end, bend), _arc((0.0, 0.0), crown, bend, 0.0)[1:]])
    wall[-1] = (0.0, crown)
    return Section(np.concatenate([[(0.0, -floor)], wall]), 1)
