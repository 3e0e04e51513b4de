"""More objects close to the wall: bundles of cables, pipes, signs, junction boxes."""

from __future__ import annotations

import math

import numpy as np

from tunneldb.errors import UserError
from tunneldb.simulate.objects.fixtures import Appendage
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.tunnel.tunnel import Tunnel

TRIES = 400
# Limits, m: diameter of cables; distance of their visible side from the wall; cables of a bundle.
CABLE, VISIBLE_SIDE, BUNDLE = (0.02, 0.08), (0.03, 0.30), (2, 5)
PIPE, PIPE_GAP = (0.10, 0.20), (0.0, 0.08)
# Side of signs, their distance from the wall, their thickness; size and depth of junction boxes, m.
SIGN, SIGN_GAP, SIGN_THICK = (0.3, 0.8), (0.03, 0.06), 0.004
BOX, BOX_DEPTH = (0.15, 0.40), (0.08, 0.20)
SPACING = 10.0  # m between signs and between boxes
MIN_SPACING = 0.1  # m between objects
# Limits of arcs, as shares of the lining's half arc: clear of the crown and of the floor.
ARC_LIMITS = (0.15, 0.93)


def _run(kind: str, arc: float, start: float, end: float, rng: np.random.Generator) -> list[Appendage]:
    """Return a cable, a bundle of cables side by side, or a pipe, from end to end of the tunnel."""
    if kind == "pipe":
        (thick, gap, drop) = rng.uniform((PIPE[0], PIPE_GAP[0], 1.0), (PIPE[1], PIPE_GAP[1], 6.0)).tolist()
        return [Appendage("pipe", start, end, arc, gap + 0.5 * thick, thick, thick, drop)]
    count = int(rng.integers(BUNDLE[0], BUNDLE[1] + 1)) if kind == "bundle" else 1
    seen = float(rng.uniform(*VISIBLE_SIDE))
    cables = []
    for _ in range(count):
        thick, drop = rng.uniform((CABLE[0], 3.0), (CABLE[1], 7.0)).tolist()
        thick = min(thick, seen)
        cables.append(Appendage("cable", start, end, arc + 0.5 * thick, seen - 0.5 * thick, thick, thick, drop))
        arc += thick + 0.002
    return cables


def _plate(kind: str, s: float, arc: float, rng: np.random.Generator) -> list[Appendage]:
    """Return a sign off the wall or a junction box on it."""
    if kind == "sign":
        length, width, gap, drop = rng.uniform(
            (SIGN[0], SIGN[0], SIGN_GAP[0], -3.0), (SIGN[1], SIGN[1], SIGN_GAP[1], 5.0)
        ).tolist()
        return [Appendage(kind, s, s + length, arc, gap + 0.5 * SIGN_THICK, width, SIGN_THICK, drop)]
    length, width, depth, drop = rng.uniform((BOX[0], BOX[0], BOX_DEPTH[0], 0.0), (BOX[1], BOX[1], BOX_DEPTH[1], 5.0)).tolist()
    return [Appendage("box", s, s + length, arc, 0.5 * depth, width, depth, drop)]


def is_free(items: list[Appendage], hung: list[Appendage]) -> bool:
    """Return True if there is space for items beside the existing ones."""
    return all(
        min(a.end, b.end) + MIN_SPACING < max(a.start, b.start) or abs(a.arc - b.arc) > 0.5 * (a.width + b.width) + MIN_SPACING
        for a in items
        for b in hung
    )


def clutter(
    parameters: Parameters, tunnel: Tunnel, furniture: list[Appendage], seed: np.random.SeedSequence
) -> list[Appendage]:
    """Return the requested number of cables, bundles and pipes in turn, with signs and junction boxes along the tunnel.

    Raises
    ------
    UserError
        If there is no space on the walls for all.
    """
    line, lowest = tunnel.line, tunnel.section.floor_arc
    runs, plates = (np.random.default_rng(s) for s in seed.spawn(2))
    hung = [a for a in furniture if abs(a.arc) < lowest]
    own: list[Appendage] = []

    def arc(rng: np.random.Generator) -> float:
        return math.copysign(float(rng.uniform(*ARC_LIMITS)) * lowest, float(rng.uniform(-1.0, 1.0)))

    for i in range(parameters.clutter):
        for _ in range(TRIES):
            made = _run(("cable", "bundle", "pipe")[i % 3], arc(runs), line.start, line.end, runs)
            if is_free(made, hung + own):
                break
        else:
            raise UserError(f"no room on the walls for run {i + 1} of {parameters.clutter}; use less clutter")
        own += made
    for s in np.arange(line.start + 2.0, line.end - 3.0, SPACING).tolist() if parameters.clutter else []:
        for kind in ("sign", "box"):
            for _ in range(TRIES):
                made = _plate(kind, s + float(plates.uniform(0.0, 2.0)), arc(plates), plates)
                if is_free(made, hung + own):
                    own += made
                    break
    return own
