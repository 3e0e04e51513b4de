"""Tunnels of an East Asian metro: segments with wet joints, cable racks, grouting repairs, and what lies beside them."""

from __future__ import annotations

from benchmarks.blind.scene import Scene

from .metro import brake_dust, cable_side, regrouted, wet_joints
from .others import cut_and_cover, great_shield, mined_salt, wet_adit

SCENES = (
    Scene(
        "straight-joints",
        "segments",
        "ring and longitudinal joints leak",
        "Shield tunnel of 5.5 m with straight-jointed rings of 1 m in a curve, profiler on a trolley: wet ring joints, "
        "curtains below longitudinal joints, grout holes and bolt pockets, as in the papers on intensity of mobile "
        "scans in metro tunnels.",
        wet_joints,
    ),
    Scene(
        "cable-side",
        "segments",
        "leaks beside and behind racks, pipes and cabinets",
        "Shield tunnel of 5.9 m with staggered rings, full cable racks on both walls, a fire main and cabinets; tripods "
        "between the rails see round some of them; no reference curve. Inspection manuals ask to look behind cables, "
        "where seepage begins.",
        cable_side,
    ),
    Scene(
        "great-shield",
        "segments",
        "long runs in a section of 13 m",
        "Road tunnel of 13 m with rings of 2 m above the deck, pulse scanner on tripods at the kerbs: wet ring joints, "
        "curtains and patches high up, painted walls below, jet fans and lamps.",
        great_shield,
    ),
    Scene(
        "regrouted",
        "segments",
        "leaks return beside injections and caulking",
        "Shield tunnel of 5.5 m after several campaigns of grouting: resin that ran out, packers, caulked joints, "
        "bonded sheet and drain channels, with leaks that moved on beside them; profiler at 785 nm, where water darkens "
        "less.",
        regrouted,
    ),
    Scene(
        "brake-dust",
        "segments",
        "no leak, but dirt",
        "Old line of 5.5 m without any leak: brake dust up the walls, soot above the conductor, rust below brackets, "
        "oil, bitumen, squeezed gaskets, tide marks long dry and segments of several batches.",
        brake_dust,
    ),
    Scene(
        "cut-and-cover",
        "cast",
        "cracks and construction joints of a frame",
        "Box for two tracks at a station's end: leaking construction joints, cracks in the roof with lime, curtains "
        "below the haunch, a gutter under the expansion joint; tripods, no reference curve.",
        cut_and_cover,
    ),
    Scene(
        "mined-salt",
        "cast",
        "wet within bright fringes of lime",
        "Mined single-track section of three centres, cast in bays of 9 m: water at bay joints and cold joints is edged "
        "by efflorescence, as manuals show for failed waterproofing; profiler on a trolley pushed unevenly.",
        mined_salt,
    ),
    Scene(
        "wet-adit",
        "shotcrete",
        "seepage through rough sprayed concrete",
        "Horseshoe adit of bare shotcrete with anchor plates, air duct and hoses, sparsely scanned from tripods: "
        "patches, curtains and drips on a surface whose roughness itself shades the echo.",
        wet_adit,
    ),
)
