"""Reference data of the rings of a lining: position, shape, greatest step and lip of each.

Centre, radius and ovality are those of the least-squares ellipse through the ring as built, above the floor.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tunneldb.arrays import Float
from tunneldb.compiled import kernel
from tunneldb.simulate.lining.relief import wider_from
from tunneldb.simulate.lining.ring_shape import RingShape, departure
from tunneldb.simulate.lining.rings import Rings

if TYPE_CHECKING:
    from tunneldb.simulate.generate import Simulation

COLUMNS = (
    "number", "chainage_from", "chainage_to", "centre_right", "centre_up", "radius", "ovality", "largest_clock",
    "step_greatest", "step_greatest_arc", "lip", "lip_arc",
)  # fmt: skip
"""Columns of the file; the first three are those that ``tunneldb rings --rings`` reads."""

ARC_STEP = 0.05
"""Distance between the arcs at which steps are searched, m."""


@kernel
def _heights(rings: Rings, shape: RingShape, arc: Float, out: Float) -> None:
    for i in range(out.shape[0]):
        for k in range(arc.shape[0]):
            out[i, k] += departure(rings, shape, i, arc[k])


def ring_heights(simulation: Simulation, arc: Float) -> Float:
    """Return the height of each ring above the nominal section at arcs (k,), m, positive into the tunnel, (n, k)."""
    rings, wider = simulation.rings, wider_from(simulation.tunnel)
    begin = rings.first + rings.length * np.arange(rings.level.size)
    out = np.repeat(simulation.ring_steps[:, None], len(arc), axis=1)
    out -= np.where(begin + 0.5 * rings.length > wider, simulation.parameters.radius_step, 0.0)[:, None]
    _heights(rings, simulation.ring_shape, np.asarray(arc, dtype=np.float64), out)
    return out


def lips(simulation: Simulation, ring: int) -> tuple[Float, Float]:
    """Return arcs of the joints between the segments of a ring above the floor, and the inward step at each, m."""
    rings, stand = simulation.rings, simulation.ring_shape.stand[ring]
    edge = simulation.tunnel.section.floor_arc
    turn = np.arange(-len(stand), len(stand) + 1)
    arc = rings.shift[ring] + turn * rings.period
    inside = np.abs(arc) < edge
    after, before = np.take(stand, turn[inside], mode="wrap"), np.take(stand, turn[inside] - 1, mode="wrap")
    return arc[inside], after - before


def write_ring_truth(simulation: Simulation, path: Path) -> Path | None:
    """Write the rings in the tunnel, whole or in part; return None for a lining without rings."""
    rings, line = simulation.rings, simulation.tunnel.line
    if rings.length == 0.0:
        return None
    edge = simulation.tunnel.section.floor_arc
    arc = np.arange(-edge, edge, ARC_STEP)
    heights = ring_heights(simulation, arc)
    lines = [",".join(COLUMNS)]
    for i in range(rings.level.size):
        low = rings.first + i * rings.length
        if low >= line.end or low + rings.length <= line.start:
            continue
        step = _greatest(arc, heights[i] - heights[i - 1]) if i else ("", "")
        lip = _greatest(*lips(simulation, i)) if rings.segment_level.shape[1] else ("", "")
        place = [f"{i + 1}", f"{low:.4f}", f"{low + rings.length:.4f}"]
        lines.append(",".join([*place, *_ellipse(simulation, i), *step, *lip]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _of_segments(rings: Rings, shape: RingShape, ring: int, edge: float) -> Float:
    """Return the effect of displaced segments on the least-squares ellipse: centre (2), radius, p, q, m.

    The third harmonic is fitted, too, as for rings with many points; above the floor, with equal weights.
    """
    arc = np.arange(-edge, edge, 0.2 * ARC_STEP)
    out = np.zeros((1, len(arc)))
    only = RingShape(shape.radius, np.zeros((1, 4)), shape.stand[ring : ring + 1])
    _heights(rings._replace(shift=rings.shift[ring : ring + 1]), only, arc, out)
    s = np.pi / 2.0 - arc / shape.radius
    waves = [np.cos(s), np.sin(s), np.ones(len(s))] + [wave(order * s) for order in (2, 3) for wave in (np.cos, np.sin)]
    return np.asarray(np.linalg.lstsq(np.column_stack(waves), -out[0], rcond=None)[0][:5], dtype=np.float64)


def _greatest(arc: Float, values: Float) -> tuple[str, str]:
    k = int(np.argmax(np.abs(values)))
    return f"{values[k]:.6f}", f"{arc[k]:.3f}"


def _ellipse(simulation: Simulation, ring: int) -> list[str]:
    """Return centre, radius, ovality, and direction of the largest diameter if there is one; empty for non-round sections."""
    parameters, rings = simulation.parameters, simulation.rings
    if parameters.section != "circular":
        return [""] * 5
    shape = simulation.ring_shape
    right, up, p, q = shape.ellipse[ring]
    wide = rings.first + (ring + 0.5) * rings.length > wider_from(simulation.tunnel)
    radius = parameters.section_radius - simulation.ring_steps[ring] + (parameters.radius_step if wide else 0.0)
    if shape.stand[ring].any():
        off = _of_segments(rings, shape, ring, simulation.tunnel.section.floor_arc)
        right, up, radius, p, q = np.array([right, up, radius, p, q]) + off
    size = float(np.hypot(p, q))
    clock = f"{(90.0 - np.degrees(np.arctan2(q, p)) / 2.0) % 180.0:.2f}" if size else ""
    return [f"{right:.6f}", f"{up:.6f}", f"{radius:.6f}", f"{2.0 * size / radius:.6f}", clock]
