"""Old railway tunnels: masonry of brick and stone with its repairs, rock, and the concrete put over them later."""

from __future__ import annotations

from ..scene import Scene
from .scenes_cold import covered_way, ice_guards
from .scenes_concrete import cast_relining, sprayed_over_brick
from .scenes_soot import dry_steam_bore, sooted_double_track
from .scenes_stone import ashlar_weepholes, rock_behind_portal

SCENES = (
    Scene(
        "sooted-double-track",
        "brick",
        "soot of steam traction",
        "Wide horseshoe in English bond. Two bands of soot over the tracks, with flaked crusts; lengths and half rings of "
        "other brick; recasing in engineering brick and in new brick; weepholes, refuges, wet haunches, a wet ring joint, "
        "runs behind a pipe and cables. As in handbooks of masonry tunnel examination.",
        sooted_double_track,
    ),
    Scene(
        "ashlar-weepholes",
        "stone",
        "runs below weepholes",
        "Single-track vault of coursed sandstone on a curve, profiles of a phase scanner. Weepholes at breast height, of "
        "which some run and some have only lime below them; damp springing, wet ring and bed joints, brick repairs of the "
        "crown.",
        ashlar_weepholes,
    ),
    Scene(
        "rock-behind-portal",
        "rock",
        "wet fractures in unlined rock",
        "Gneiss as blasted, behind a portal ring of masonry, with spots of sprayed concrete, dark minerals, a vein of "
        "quartz. Water on fractures, on the joint between ring and rock, beside a repair. Terrestrial scans without the "
        "curve of the scanner.",
        rock_behind_portal,
    ),
    Scene(
        "sprayed-over-brick",
        "shotcrete",
        "calcite curtains",
        "Sprayed concrete over the brick of a double-track tunnel on a curve, which ends at a stretch of old brick. Lime "
        "curtains with water in their middle, half pipes and drainage channels with leaks beside them, spots of other "
        "spraying, catenary.",
        sprayed_over_brick,
    ),
    Scene(
        "cast-relining",
        "cast",
        "wet construction joints",
        "Single-track relining cast in blocks of eight metres against planks, oblique profiles at 785 nm, at which water "
        "darkens less. Wet block joints and lift joints, gravel nests, cracks; conductor rail, rust, arcing soot, mortar "
        "repairs.",
        cast_relining,
    ),
    Scene(
        "ice-guards",
        "brick",
        "ice guards and drainage channels",
        "Electrified double track under a three-centred brick vault on a curve, thin scans of four stations. Corrugated "
        "sheets hide the crown above the wires and leaks show beside them; channels cut into the lining and closed with "
        "mortar leak along their sides.",
        ice_guards,
    ),
    Scene(
        "dry-steam-bore",
        "brick",
        "no leaks, black and repaired",
        "Circular brick bore without any water: thick soot with flaked crusts, recasing in dark engineering brick, "
        "sprayed and repointed patches, streaks of washed soot, bitumen, old lime, limewash, graffiti. What a profiler "
        "sees after a dry summer.",
        dry_steam_bore,
    ),
    Scene(
        "covered-way",
        "brick",
        "wet joint between deck and walls",
        "Cut-and-cover box: brick walls, a deck of jack arches between iron girders. Water comes down at the joint of "
        "deck and wall and in the arches; rust below girders, limewash, many cables. Terrestrial scans without the curve "
        "of the scanner.",
        covered_way,
    ),
)
