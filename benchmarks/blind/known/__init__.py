"""Eleven scenes of known phenomena, one each, with the usual leaks on plain or usual linings."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from benchmarks.blind.known import scenes_cast, scenes_masonry, scenes_rings
from benchmarks.blind.known.build import Job, produce
from benchmarks.blind.scene import Scene


def _scene(number: int, name: str, lining: str, phenomenon: str, description: str, build: Callable[[], Job]) -> Scene:
    return Scene(name, lining, phenomenon, description, partial(produce, build, 100 + number))


SCENES = (
    _scene(
        1,
        "salts",
        "cast",
        "bright salts",
        "Efflorescence of +4 dB on 4 % of a cut-and-cover box, as blotches, seams about leaks and fringes; "
        "inspection manuals for concrete tunnels note it beside leakage.",
        scenes_cast.salts,
    ),
    _scene(
        2,
        "springline-joints",
        "cast",
        "long wet joints along the tunnel",
        "Construction joints between wall and vault that are wet over 5 to 8 m, 0.1 to 0.2 m wide, in a three-centred tunnel.",
        scenes_cast.springline_joints,
    ),
    _scene(
        3,
        "wet-panel",
        "segments",
        "whole panels wet",
        "Two segments of a metro tunnel wet from joint to joint, 2.6 and 4 dB, beside dry ones of other concrete, 1 dB darker.",
        scenes_rings.wet_panel,
    ),
    _scene(
        4,
        "chamfered-joints",
        "segments",
        "wide dark joints",
        "Ring joints every 1.2 m and staggered longitudinal joints with dirty chamfers, 5 cm and 6 dB; the rings slant.",
        scenes_rings.chamfered_joints,
    ),
    _scene(
        5,
        "cables",
        "cast",
        "bundles of cables",
        "Four bundles of 6 to 10 cables on brackets, a flat dark duct around the tunnel, one along; leaks behind and beside.",
        scenes_cast.cables,
    ),
    _scene(
        6,
        "brick",
        "brick",
        "bricks of differing tone",
        "A vault whose bricks differ by 1.2 dB and whose courses wander; drips, damp at the foot as in masonry handbooks.",
        scenes_masonry.brick,
    ),
    _scene(
        7,
        "stone",
        "stone",
        "stones of differing tone, recessed joints",
        "Coursed stones that differ by 1.5 dB with joints recessed by 1 to 3 cm.",
        scenes_masonry.stone,
    ),
    _scene(
        8,
        "rock",
        "rock",
        "rough rock",
        "Unlined, with facets of 0.2 to 0.8 m within 0.15 m of the mean, each of its own tone and incidence; heavy leaks.",
        scenes_masonry.rock,
    ),
    _scene(
        9,
        "wet-ring",
        "cast",
        "a wet ring joint",
        "A block joint wet all round over 0.5 m, crossed by two cables; patches crossed by cables and pipes of up to 0.15 m.",
        scenes_cast.wet_ring,
    ),
    _scene(
        10,
        "halos-and-repairs",
        "segments",
        "dark things that are dry",
        "Halos of grime about lamps, straight-sided repairs, paint, half rings of other concrete; drips that go on after gaps; "
        "weeping bolt pockets.",
        scenes_rings.halos_and_repairs,
    ),
    _scene(
        11,
        "dry-dirty",
        "segments",
        "no leak at all",
        "The same dirt together with salts, soot and marks of washing, and all of it dry.",
        scenes_rings.dry_dirty,
    ),
)
