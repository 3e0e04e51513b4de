"""Five structures of steel, concrete and stone, cast ray by ray: a truss railway bridge, a group of silos, the head wall of
a tunnel portal, a machine room and a bridge pier with inclined legs. All surfaces are rectangles and cylinders (some
corrugated, perforated, or with a relief of stones and rivets). Each beam is seven rays over its footprint; their energies
follow the material's law of incidence, the reflectance with its texture and the marks on the surface, and the range. The
receiver takes the strongest group of returns that it cannot separate, so that edges, wires and leaves give mixed pixels
(`surface` 0, as are bolts, of which nothing lies on the smooth face). Range and amplitude get noise that grows for weak
returns, a slow drift, a near-field loss and a threshold; dust and echoes give a few false returns. The truth comes from
the same rays: number of surface, angle, area and mark.
"""

from __future__ import annotations

from benchmarks.blind_structures.scene import Scene

from . import machine, pier, portal, silos, truss

SCENES = (
    Scene(
        "truss-bridge",
        "Truss railway bridge of box and U sections: old paint, repairs, rust at nodes; fence and plants.",
        truss.make,
    ),
    Scene(
        "silo-group",
        "Three silos: painted steel, corrugated sheet, concrete; dark runs under outlets, ladders with cages.",
        silos.make,
    ),
    Scene(
        "portal-wall",
        "Head wall of a tunnel portal in stone: joints, damp at the foot, efflorescence, steel door, pipe.",
        portal.make,
    ),
    Scene(
        "machine-room",
        "Motor with ribs, pump casing, base frame, pipes with flanges; oil stains and rust, three stations.",
        machine.make,
    ),
    Scene(
        "inclined-pier",
        "Steel pier with inclined legs, bearings, drain pipe; rust streaks along legs, strong incidence.",
        pier.make,
    ),
)
