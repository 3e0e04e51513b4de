"""Round 1: metro tunnels of segments, of cast and of sprayed concrete, and a brick access tunnel."""

from __future__ import annotations

from ..scene import Scene
from .adit_scenes import brick_adit, sprayed_adit
from .cast_scenes import behind_cables, injected_box, tide_marks
from .segment_scenes import brake_dust_only, gasket_joints, lime_and_salt

SCENES = (
    Scene(
        "gasket-joints",
        "segments",
        "wet joints",
        "Single-track metro tunnel of 5.5 m, straight. Water comes through gaskets of ring and longitudinal joints, "
        "at a cross joint, a bolt pocket and a grouting plug, and runs down past cables and a pipe, as catalogues of "
        "damage to segmental linings show it; joints that were caulked or injected are dark and dry. Tripod, pulses "
        "at 1550 nm.",
        gasket_joints,
    ),
    Scene(
        "lime-and-salt",
        "segments",
        "salt fringe",
        "Double-track metro tunnel of 8.6 m in a curve. Most damp areas lie inside a crust of lime or salt that is "
        "brighter than the lining; other crusts are what closed leaks have left (inspection manuals tell active from "
        "dry efflorescence). Tripod, phase scanner at 1550 nm, no reference target.",
        lime_and_salt,
    ),
    Scene(
        "behind-cables",
        "cast",
        "behind equipment",
        "Cut-and-cover running tunnel, rectangular, in a curve. Water from joints runs down behind seven tiers of "
        "cables, behind a cable tray, a fire main and a conduit, and beside a cabinet, where periodic inspection "
        "finds it last. Profiler with an oblique plane at 1064 nm on a trolley.",
        behind_cables,
    ),
    Scene(
        "injected-box",
        "cast",
        "injected joints",
        "Box of a station, 8.6 m by 5.8 m, straight. Panel joints, ceiling cracks and kicker joints were injected: "
        "resin and packers are dark and dry, and water has found its way beside some of them; rust, lime, slurry and "
        "formwork panels differ in brightness as well. Tripod, phase scanner at 785 nm, at which water takes little.",
        injected_box,
    ),
    Scene(
        "tide-marks",
        "cast",
        "tide mark",
        "Three-centred tunnel of a turnout, cast in bays of 10 m, on a gradient. Damp swells and dries with the "
        "seasons: soft rims, lines left at former extents, one bay darker than the next, a wet block joint, drips at "
        "the crown. Profiler at 1550 nm on a trolley.",
        tide_marks,
    ),
    Scene(
        "brick-adit",
        "brick",
        "seepage through masonry",
        "Horseshoe access tunnel of brick in stretcher bond, steep and curved, sooty at the crown. Seepage through "
        "courses, rising damp, a wet ring crack and a weep hole, salts about them and elsewhere; repointed, tarred "
        "and rebuilt patches, as handbooks on the examination of masonry tunnels list them. Tripod, pulses at 1550 "
        "nm.",
        brick_adit,
    ),
    Scene(
        "brake-dust",
        "segments",
        "dry but dirty",
        "Single-track metro tunnel of 5.2 m in a curve without any leak: brake dust, soot over lamps and cabinets, "
        "grease of a rail lubricator, caulked and injected joints, epoxy and bitumen, dried streaks and lime, "
        "segments of several mixes. Profiler at 1550 nm on a trolley.",
        brake_dust_only,
    ),
    Scene(
        "sprayed-adit",
        "shotcrete",
        "rough lining",
        "Horseshoe access tunnel of sprayed concrete in a tight curve at 6 %. Water between the lobes of the "
        "spraying, along a lattice girder, at a drain hole, a bolt and covered drains; other mixes, fresh mortar, "
        "bolt plates and mud are dry. A ventilation duct hides part of the crown. Tripod, pulses at 1550 nm, no "
        "reference target.",
        sprayed_adit,
    ),
)
