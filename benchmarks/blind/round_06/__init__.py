"""Road and water tunnels of Northern Europe: sprayed concrete, frost insulation, portals, galleries, culverts, panels."""

from __future__ import annotations

from ..scene import Scene
from .cast import gallery, portal
from .confined import culvert, water
from .sprayed import rock, sheets
from .traffic import dirty, panels

SCENES = (
    Scene(
        "sprayed-rock",
        "shotcrete",
        "drips and fissures on rough sprayed concrete",
        "Drill-and-blast road tunnel, sprayed concrete straight on rock with bolts: water at bolt plates, along fissures and "
        "in patches, as in the Nordic inspection handbooks; tripod, pulse scanner at 1550 nm, no reference curve.",
        rock,
    ),
    Scene(
        "frost-sheets",
        "shotcrete",
        "leaks through frost insulation",
        "Foam sheets under sprayed concrete (water and frost protection of Norwegian road tunnels): laps, sawn joints and "
        "shrinkage cracks leak, splash dirt behind guard rails; van, profiler at 1550 nm, in a curve.",
        sheets,
    ),
    Scene(
        "cast-portal",
        "cast",
        "wet block joints with salt fringes",
        "Cast portal in a sharp curve: leaking block joints, salt fringes and rising damp after RI-ZFP-ING and FHWA TOMIE, "
        "algae in the daylight; tripod, pulse scanner at 1550 nm with logarithmic detector.",
        portal,
    ),
    Scene(
        "avalanche-gallery",
        "cast",
        "leaking roof joints of a gallery",
        "Box-shaped avalanche gallery with openings: joints of the roof slab, water down columns, cold joint, curtain on the "
        "mountain side; tripod, pulse scanner at 1550 nm with a wide beam.",
        gallery,
    ),
    Scene(
        "cable-culvert",
        "cast",
        "leaks behind trays and pipes",
        "Cable culvert of cast concrete: four tiers of trays and two pipes before wet walls and joints; tripod, pulse scanner "
        "at 1550 nm, no reference curve.",
        culvert,
    ),
    Scene(
        "water-tunnel",
        "shotcrete",
        "inflows above and through a slime band",
        "Bored water tunnel, emptied for inspection: manganese slime below the waterline, inflows and runs across it, slime "
        "flaked off; tripod, phase scanner at 785 nm, where water darkens less.",
        water,
    ),
    Scene(
        "jetfan-panels",
        "panels",
        "water over panels and behind jet fans",
        "Undersea road tunnel with painted wall elements below a sprayed vault: water over the elements' upper edge, in their "
        "joints and behind jet fans; van, profiler at 1550 nm, steep and curved.",
        panels,
    ),
    Scene(
        "dirty-dry",
        "cast",
        "dirt without water",
        "Old cast road tunnel in a dry stretch: soot, traffic film, plumes of lamps, dry streaks, scuffs, paint, repairs and "
        "lime, the spots that periodic inspection first takes for water; van with slanting profiler. No leaks.",
        dirty,
    ),
)
