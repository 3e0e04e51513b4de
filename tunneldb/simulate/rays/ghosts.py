"""Multipath: rays reflected by the wet floor, so that the wall appears a second time below the ground.

The pulse travels via the floor to the wall and back the same way. Its range is the length of the path to the floor and from
there to the wall, in the direction in which it was sent: the wall's mirror image.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tunneldb.arrays import Float
from tunneldb.simulate.objects.fixtures import FLOOR, OUTLIER
from tunneldb.simulate.rays.trace import Echoes
from tunneldb.simulate.scanner import Rays
from tunneldb.simulate.tunnel.tunnel import Tunnel

# Limits of the loss by two reflections, dB.
LOSS = (3.0, 12.0)
FLOOR_OFFSET = 1e-5  # m: the mirrored ray starts off the floor

# Echoes of rays from places (n, 3) in directions (n, 3), near chainages (n,), without noise and stray points.
Shoot = Callable[[Float, Float, Float], Echoes]


def mirror(
    echoes: Echoes, rays: Rays, share: float, furthest: float, shoot: Shoot, tunnel: Tunnel, rng: np.random.Generator
) -> Echoes:
    """Turn a share of the echoes of the floor into ghosts, if the reflected ray hits something within range."""
    chosen = np.flatnonzero((echoes.klass == FLOOR) & (rng.random(len(echoes.ray)) < share))
    loss = rng.uniform(*LOSS, len(chosen))
    direction = rays.direction[echoes.ray[chosen]]
    up = tunnel.line.frame(echoes.chainage[chosen]).w
    mirrored = direction - 2.0 * np.sum(direction * up, axis=1)[:, None] * up
    spot = rays.origin[echoes.ray[chosen]] + echoes.range[chosen, None] * direction + FLOOR_OFFSET * up
    reflected = shoot(spot, mirrored, echoes.chainage[chosen])
    rows, whole = chosen[reflected.ray], echoes.range[chosen[reflected.ray]] + reflected.range
    within = whole <= furthest
    reflected = reflected.take(np.flatnonzero(within))
    rows, whole, direction = rows[within], whole[within], direction[reflected.ray]
    if not len(rows):
        return echoes
    measured = whole + echoes.measured[rows] - echoes.range[rows]
    xyz = rays.origin[echoes.ray[rows]] + measured[:, None] * direction
    place = tunnel.unroll_near(xyz, echoes.chainage[rows], 1e-6)
    after = Echoes(
        ray=echoes.ray[rows],
        measured=measured,
        xyz=xyz,
        chainage=place.chainage,
        arc=place.arc,
        offset=place.offset,
        klass=np.full(len(rows), OUTLIER),
        leak=np.full(len(rows), -1),
        drop=reflected.drop + loss[reflected.ray],
        cosine=reflected.cosine,
        range=whole,
        thing=np.zeros(len(rows), dtype=np.int64),
    )
    for column, values in zip(echoes, after, strict=True):
        column[rows] = values
    return echoes
