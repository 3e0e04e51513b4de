"""Round 04: vaults of brick and stone, cast concrete, rings and frames of the Alps, as a railway's inspector knows them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from benchmarks.blind.scene import Scene

from .build import Maker, Spec
from .concrete import cast_with_sheet, drained_shotcrete, salt_underpass
from .masonry import ashlar_curve, brick_rings, dry_brick, ice_portal
from .rings import ring_gallery


def _scene(name: str, lining: str, phenomenon: str, spec: Callable[[], Spec], source: str) -> Scene:
    def make(folder: Path) -> None:
        Maker(spec()).make(folder)

    return Scene(name, lining, phenomenon, f"{spec.__doc__} {source}", make)


SCENES: tuple[Scene, ...] = (
    _scene(
        "brick-rings-thaw",
        "brick",
        "thaw water through a sooted brick vault: runs, ring joint, salt fringe",
        brick_rings,
        "After handbooks on the examination of masonry tunnels: wetness by area, ring separation, open joints, spalling.",
    ),
    _scene(
        "ashlar-curve",
        "stone",
        "wet patches among stones whose own colours differ as much",
        ashlar_curve,
        "After the railways' inspection rules for stone vaults: lost mortar, sinter, stones of several quarries, repairs.",
    ),
    _scene(
        "dry-brick",
        "brick",
        "no leak at all: soot, bitumen, dark bricks, dry tide marks",
        dry_brick,
        "After inspection manuals that warn of taking soot, patches and old marks for water.",
    ),
    _scene(
        "ice-portal",
        "stone",
        "ice sheets, icicles and thaw zones near a portal, drip tins before them",
        ice_portal,
        "After winter inspections of alpine railway tunnels: ice on walls and at the crown is entered as inflow of water.",
    ),
    _scene(
        "cast-with-sheet",
        "cast",
        "block joints, springing joint and the foot of a waterproof sheet",
        cast_with_sheet,
        "After guidelines for cast linings: water that a sheet leads down comes out at joints, cracks and at its foot.",
    ),
    _scene(
        "drained-shotcrete",
        "shotcrete",
        "damp along drains under sprayed concrete, weak at 785 nm",
        drained_shotcrete,
        "After repair guidelines for masonry tunnels: half pipes under spray, which clog with sinter.",
    ),
    _scene(
        "salt-underpass",
        "cast",
        "salt damp at the foot of walls, slab joints that drip, graffiti and rust",
        salt_underpass,
        "After the inspection of structures along roads: chloride zone at the foot, joints of frames, corroding bars.",
    ),
    _scene(
        "ring-joints-sparse",
        "segments",
        "leaks at gaskets and bolt pockets, thinly scanned by pulses",
        ring_gallery,
        "After papers on leakage of segmental linings by laser scanning: ring joints, corners, pockets, grout holes.",
    ),
)
