"""Cross profile of the floor over the flat floor of the section: camber, walkway, kerb, second carriageway."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float
from tunneldb.simulate.objects.fixtures import Appendage
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.section import Section
from tunneldb.simulate.tunnel.tunnel import Tunnel

WALKWAY = 0.9  # width along the left wall, m
KERB = 0.4  # width along the right wall, m
# The raised carriageway begins right of the rails, or at this share of half the width.
CARRIAGEWAY = (1.0, 0.3)
# How far a slab reaches into the wall, m, at most its width, so that no gap is left where the wall leans outward.
INTO_WALL = 0.5


def _slabs(parameters: Parameters, section: Section) -> list[tuple[str, float, float, float]]:
    """Kind, from and to (across, m), height (m) of what lies along the floor; later ones lie on top."""
    half, slabs = section.half_width, []
    if parameters.carriageway:
        slabs.append(("carriageway", max(CARRIAGEWAY[0], CARRIAGEWAY[1] * half), half, parameters.carriageway))
    if parameters.walkway:
        slabs.append(("walkway", -half, WALKWAY - half, parameters.walkway))
        slabs.append(("kerb", half - KERB, half, parameters.carriageway + parameters.walkway))
    return slabs


def rise(parameters: Parameters, section: Section, across: Float) -> Float:
    """Height of the ground over the section's floor at (n,) m right of the axis, m; without ballast and sleepers.

    This is the truth of a ground model: the floor of the section lies at w = ``section.floor``.
    """
    # What lies along a wall goes on behind the corner where the wall leans outward.
    u = np.clip(np.asarray(across, float), -section.half_width, section.half_width)
    height = parameters.camber / 100.0 * (section.half_width - np.abs(u))
    for _, low, high, top in _slabs(parameters, section):
        height = np.where((u >= low) & (u <= high), np.maximum(height, top), height)
    return np.asarray(height)


def slabs(parameters: Parameters, tunnel: Tunnel) -> list[Appendage]:
    """Walkway, kerb and second carriageway as bars along the tunnel."""
    line, section = tunnel.line, tunnel.section
    bars = []
    for kind, low, high, top in _slabs(parameters, section):
        hidden = min(INTO_WALL, high - low)
        low = low - hidden if low <= -section.half_width else low
        high = high + hidden if high >= section.half_width else high
        middle = 0.5 * (low + high)
        # On the floor, arc runs from the corner towards the middle.
        arc = np.copysign(section.half_perimeter - abs(middle), middle)
        bars.append(Appendage(kind, line.start, line.end, float(arc), 0.5 * top, high - low, top, 2.0))
    return bars
