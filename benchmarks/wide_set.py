"""Tunnels by which detection is measured phenomenon by phenomenon, each unlike those that it was made on in one thing.

All are the same horseshoe with the same five leaks, from the same seed, scanned by a profiler: what a row differs by from the
first of its lining is what its phenomenon does. Values are what is met with, or somewhat worse.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from benchmarks.leak_set import Case

BASE: dict[str, Any] = {
    "scanner": "profiler", "profile_spacing": 0.02, "profile_points": 1000, "section": "horseshoe", "length": 40,
    "roughness": 14, "lining": "cast", "leaks": 5, "leak_area": (0.2, 2.0), "niche_leaks": 0, "joint_leaks": 0,
}  # fmt: skip
SEGMENTS: dict[str, Any] = {"lining": "segments", "ring_step": 0.003}


@dataclass(frozen=True)
class Phenomenon(Case):
    """A tunnel that differs from others in one thing; the seed is that of the set."""

    def seed(self, seed: int, number: int) -> int:
        return 100 * seed


def _case(name: str, **options: Any) -> Phenomenon:
    return Phenomenon(name, {**BASE, **options})


WIDE_SET: tuple[Case, ...] = (
    _case("cast"),
    _case("segments", **SEGMENTS),
    _case("lining tiles", lining="tiles"),
    _case("lining brick", lining="brick"),
    _case("lining stone", lining="stone"),
    _case("lining rock", lining="rock"),
    _case("lining rough shotcrete", lining="rough_shotcrete"),
    _case("mesh", mesh=0.1),
    _case("mesh before rock", mesh=0.1, lining="rock"),
    _case("sheets", sheets=3),
    _case("leaks across cables", cable_leaks=4),
    _case("leaks at the foot", foot_leaks=4),
    _case("wet springline", springline_leaks=2),
    _case("weeping pockets, segments", pocket_leaks=5, **SEGMENTS),
    _case("wet ring, segments", ring_leaks=1, **SEGMENTS),
    _case("wet panels, segments", panel_leaks=2, **SEGMENTS),
    _case("soft rims", leak_edge=0.3),
    _case("fringes of salts", salt_fringe=0.1),
    _case("drips far below", drip_gap=(0.12, 0.4), leaks=9, leak_area=(0.4, 2.0)),
    _case("salts on 4 %", salts=4.0),
    _case("chamfers, segments", chamfers=6.0, **SEGMENTS),
    _case("halos of grime", halos=6),
    _case("dark patches", patches=5, patch_level=(-6.0, -3.0)),
    _case("turned patches", patches=5, patch_level=(-4.0, -1.5), patch_turn=6.0),
    _case("stripes", paint=8, stripe_width=(0.03, 0.4)),
    _case("half-ring shades, segments", shade=0.7, **SEGMENTS),
    _case("soot", soot=4.0),
    _case("thin cables", thin_cables=4),
    _case("trunking", trunking=2),
    _case("banding", banding=0.4),
    _case("drift", drift=0.6),
    _case("step of the gain", gain_step=1.5),
    _case("mixed pixels", beam=2.0),
    _case("ghosts", ghosts=0.1),
    _case("saturation", saturation=36.0, range_curve="inverse_square"),
    _case("noise by range", noise_growth=2.0),
)
