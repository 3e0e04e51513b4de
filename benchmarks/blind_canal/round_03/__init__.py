"""Four canals whose ties between laser and sonar differ, cast ray by ray against implicit surfaces.

A rock-cut canal has only its own shape at the waterline and the surface seen from below; a narrow brick canal has two
damaged ladders with their feet in the mud and ropes; a canal with bends, a passing place and towpaths has ladders on
both banks, a level that falls and a wrong speed of sound; a lock-like chamber has gate recesses, hollow quoins and a
ladder in a niche. The solid is the negative side of a function of place, with relief from seeded noise, and rays are
marched to its zero; ladders, beams and ropes are cylinders that are met exactly. The laser has noise, mixed points at
edges, mirror images by Fresnel's share, and a few echoes of what floats. Each sonar beam is 7 rays, or 31 near a bar,
with weights and backscatter; the strongest range cell is its echo, so that bars widen and corners are rounded. The
water is an echo where it is met steeply and a mirror elsewhere. Truth is the pose and scale used in casting, and check
points are noiseless middles of beams on the solid.
"""

from benchmarks.blind_canal.round_03.scenes import bends, brick, chamber, rock_cut
from benchmarks.blind_canal.scene import Scene

SCENES: tuple[Scene, ...] = (
    Scene(
        "rock-cut",
        "45 m in rough rock, no ladder; ties are the waterline's shape and the surface seen from below",
        rock_cut,
    ),
    Scene(
        "brick-damaged-ladders",
        "30 m, 4.2 m narrow, one wall battered, two damaged ladders in mud, ropes, two tilts",
        brick,
    ),
    Scene(
        "bends-towpaths",
        "100 m, two bends, passing place, ladders on both banks, six stations, falling level, speed 1.8 % off",
        bends,
    ),
    Scene(
        "lock-chamber",
        "25 m chamber 3.8 m deep with gate recesses and quoins, one ladder in a niche, two deep stations",
        chamber,
    ),
)
