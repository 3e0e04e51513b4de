"""Cross profile of the floor above the flat floor of the section: camber, walkway, kerb, second carriageway."""

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
# Overlap of a slab with the wall, m, at most its width, so that there is no gap where the wall leans outwards.
INTO_WALL = 0.5


def _slabs(parameters: Parameters, section: Section) -> list[tuple[str, float, float, float]]:
    """Return kind, start and end (across, m), and height (m) of slabs on the floor; later ones lie on top."""
    half, slabs = section.half_width, []
    if parameters.carriageway:
        slabs.append(("carriageway", max(CARRIAGEWAY[0], CARRIAGEWAY[1] * half), half, parameters.carriageway))
    if parameters.walkway:
        slabs.append(("walkway", -half, WALKWAY - half, parameters.walkway))
        slabs.append(("kerb", half - KERB, half, parameters.carriageway + parameters.walkway))
    return slabs


def rise(parameters: Parameters, section: Section, across: Float) -> Float:
    """Return the height of the ground above the section's floor (n,) m right of the axis, m; without ballast and sleepers.

    This is the reference for a ground model: the floor of the section is at w = ``section.floor``.
    """
    # Slabs along a wall continue behind the corner where the wall leans outwards.
    u = np.clip(np.asarray(across, float), -section.half_width, section.half_width)
    height = parameters.camber / 100.0 * (section.half_width - np.abs(u))
    for _, low, high, top in _slabs(parameters, section):
        height = np.where((u >= low) & (u <= high), np.maximum(height, top), height)
    return np.asarray(height)


def slabs(parameters: Parameters, tunnel: Tunnel) -> list[Appendage]:
    """Return walkway, kerb and second carriageway as bars along the tunnel."""
    line, section = tunnel.line, tunnel.section
    bars = []
    for kind, low, high, top in _slabs(parameters, section):
        hidden = min(INTO_WALL, high - low)
        low = low - hidden if low <= -section.half_width else low
        high = high + hidden if high >= section.half_width else high
        middle = 0.5 * (low + high)
        # On the floor, arc increases from the corner towards the middle.
        arc = np.copysign(section.half_perimeter - abs(middle), middle)
        bars.append(Appendage(kind, line.start, line.end, float(arc), 0.5 * top, high - low, top, 2.0))
    return bars
