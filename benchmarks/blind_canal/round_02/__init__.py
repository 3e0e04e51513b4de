"""Four canals in masonry and brick, cast by a ray caster of their own.

The walls, the vault, the towpath, the ledges, the piers and the bed form one signed field in chainage, offset and height, with
relief from rasters of fixed seeds; rays march through it. Ladders and ropes are cylinders and boats are ellipsoids, met
analytically. A ray that reaches the water goes on in the mirrored world, so that mirror images lie where they would lie. Each
sonar beam is a bundle of rays spread by its pattern, and its range is the strongest window of its echoes by incidence, material
and range; false echoes come from the surface, from between the walls and at random. Check points are exact hits of beam axes.
"""

from __future__ import annotations

from benchmarks.blind_canal.scene import Scene

from . import canals

SCENES: tuple[Scene, ...] = (
    Scene(
        "masonry-towpath",
        "35 m of ashlar, towpath on the left, recesses, pilasters, three wooden ladders, three multibeam "
        "scans, a moored boat with ropes",
        canals.masonry,
    ),
    Scene(
        "brick-s-bends",
        "2,000 m of brick in S bends, a ladder every 40 m, twelve multibeam scans 8 m apart, paced places",
        canals.long_bends,
    ),
    Scene(
        "profiler-ledge",
        "20 m, ledges below the water, two leaning ladders, two scans of a profiling sonar, z down",
        canals.profiler,
    ),
    Scene(
        "bridge-piers",
        "50 m, one ladder near an end, piers of a footbridge, scour holes, four multibeam scans, measured speed of sound",
        canals.piers,
    ),
)
