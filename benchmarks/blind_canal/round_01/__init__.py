"""Four canals, cast for a blind round.

A short brick tunnel, a masonry canal with a towpath on arches in a bend, a vaulted basin, and a uniform concrete canal.
All surfaces are signed distances (walls, vault, bed, towpath, boats) or round bars (ladders, ropes, the legs of the
sonar's tripod). Rays are marched through them. The laser has single rays with noise, mixed pixels and the mirror of the
water. A beam of the sonar has eight rays in its footprint, and the strongest sum of echoes within the length of the pulse
gives the range; surface, mirror, multipath and stray echoes are added. Truth is that of the model. Seeds are fixed.
"""

from __future__ import annotations

from ..scene import Scene
from .scenes import basin, brick, concrete, towpath

SCENES: tuple[Scene, ...] = (
    Scene("brick-tunnel", "Brick tunnel of 25 m, battered walls, one wooden ladder, speed of sound off by 1.3 %.", brick),
    Scene("towpath-bend", "Masonry canal of 60 m in a bend, towpath on arches, mud, two steel ladders, one damaged.", towpath),
    Scene("basin-boat", "Basin without ladders, stones and a sunken boat; the water fell by 3 cm before two scans.", basin),
    Scene("concrete-uniform", "Uniform concrete canal of 40 m without any mark: not determined by the files.", concrete),
)
