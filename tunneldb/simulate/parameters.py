"""Parameters of a synthetic survey."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any, Literal

import numpy as np
import pyproj

from tunneldb.errors import UserError
from tunneldb.simulate.checks import metric_crs, require_within
from tunneldb.simulate.radiometry import Radiometry
from tunneldb.simulate.tunnel import section
from tunneldb.simulate.tunnel.centreline import CentreLine
from tunneldb.simulate.tunnel.tunnel import Tunnel

# Allowed values: low, high, unit.
LIMITS: dict[str, tuple[float, float, str]] = {
    "length": (10.0, 100_000.0, "m"),
    "transition": (0.0, 1000.0, "m"),
    "slope": (-20.0, 20.0, "%"),
    "slope_end": (-20.0, 20.0, "%"),
    "start_chainage": (0.0, 10_000_000.0, "m"),
    "azimuth": (0.0, 400.0, "degrees"),
    "station_spacing": (2.0, 100.0, "m"),
    "angular_step": (0.01, 5.0, "degrees"),
    "profile_spacing": (0.002, 5.0, "m"),
    "profile_points": (36, 100_000, "points"),
    "speed": (0.05, 30.0, "m/s"),
    "scanner_height": (0.5, 10.0, "m"),
    "scanner_offset": (-10.0, 10.0, "m"),
    "max_range": (2.0, 40.0, "m"),
    "range_noise": (0.0, 0.05, "m"),
    "outliers": (0.0, 0.2, "(share)"),
    "relief": (0.0, 0.02, "m"),
    "beam": (0.0, 10.0, "mrad"),
    "ring": (0.5, 50.0, "m"),
    "ring_step": (0.0, 0.02, "m"),
    "ring_shift": (0.0, 0.02, "m"),
    "segment_step": (0.0, 0.01, "m"),
    "radius_step": (0.0, 0.2, "m"),
    "soot": (0.0, 10.0, "dB"),
    "grime": (0.0, 10.0, "dB"),
    "patches": (0, 100_000, "patches"),
    "paint": (0, 100_000, "paintings"),
    "roughness": (0.0, 60.0, "degrees"),
    "intensity_noise": (0.0, 5.0, "dB"),
    "leaks": (0, 100_000, "leaks"),
    "leak_edge": (0.002, 0.5, "m"),
    "clutter": (0, 30, "runs"),
    "joint_leaks": (0, 100_000, "leaks"),
    "niche_leaks": (0, 100_000, "leaks"),
    "cable_leaks": (0, 100_000, "leaks"),
    "foot_leaks": (0, 100_000, "leaks"),
    "springline_leaks": (0, 100_000, "leaks"),
    "pocket_leaks": (0, 100_000, "leaks"),
    "ring_leaks": (0, 100_000, "leaks"),
    "panel_leaks": (0, 100_000, "leaks"),
    "salts": (0.0, 50.0, "%"),
    "salt_level": (0.5, 15.0, "dB"),
    "salt_fringe": (0.0, 0.5, "m"),
    "chamfers": (0.0, 15.0, "dB"),
    "halos": (0, 100_000, "spots"),
    "patch_turn": (0.0, 45.0, "degrees"),
    "shade": (0.0, 5.0, "dB"),
    "thin_cables": (0, 30, "runs"),
    "trunking": (0, 10, "runs"),
    "sheets": (0, 10_000, "sheets"),
    "mesh": (0.0, 1.0, "m"),
    "banding": (0.0, 5.0, "dB"),
    "drift": (0.0, 5.0, "dB"),
    "gain_step": (-10.0, 10.0, "dB"),
    "saturation": (0.0, 60.0, "dB"),
    "noise_growth": (0.0, 10.0, "(share)"),
    "ghosts": (0.0, 0.5, "(share)"),
    "people": (0, 5000, "people"),
    "equipment": (0, 5000, "things"),
    "bollards": (0, 5000, "bollards"),
    "globes": (0, 5000, "lamps"),
    "spheres": (0, 5000, "spheres"),
    "sphere_radius": (0.02, 0.5, "m"),
    "free_cables": (0, 50, "cables"),
    "ballast": (0.0, 0.05, "m"),
    "camber": (0.0, 10.0, "%"),
    "walkway": (0.0, 0.6, "m"),
    "carriageway": (0.0, 0.6, "m"),
    "epoch": (0, 1000, "(number)"),
    "grown_leaks": (0, 100_000, "leaks"),
    "dried_leaks": (0, 100_000, "leaks"),
    "new_leaks": (0, 100_000, "leaks"),
    "moved_wall": (-0.1, 0.1, "m"),
    "squeezed_ring": (-0.1, 0.1, "m"),
    "bulges": (0, 100_000, "bulges"),
    "bulge": (-0.1, 0.1, "m"),
    "pose_error": (0.0, 0.5, "m"),
    "pose_turn": (0.0, 1.0, "degrees"),
}


CHOICES: dict[str, tuple[str, ...]] = {
    "section": ("circular", "horseshoe", "box"),
    "scanner": ("static", "profiler"),
    "range_curve": ("near_loss", "inverse_square"),
    "lining": ("plain", "cast", "segments", "shotcrete", "tiles", "brick", "stone", "rock", "rough_shotcrete"),
}
# Usual lengths of the blocks of cast lining and of rings of segments, m.
RINGS = {"cast": 10.0, "segments": 1.5}
MAX_OVALITY = 5.0  # %
# Pairs of ascending numbers, with their lower limit.
PAIRS = {"ovality": 0.0, "leak_area": 1e-3, "leak_drop": 0.1, "drip_gap": 0.01, "patch_level": -15.0, "stripe_width": 0.01}


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """Synthetic tunnel, its contents and its survey; lengths in m, angles in degrees, levels in dB.

    Raises
    ------
    UserError
        If a value is out of range, or values contradict each other.
    """

    name: str = "tunnel"
    seed: int = 1
    srid: int = 25830

    section: Literal["circular", "horseshoe", "box"] = "circular"
    section_radius: float = 4.0
    invert: float = 2.8
    wall_height: float = 3.0
    wall_lean: float = 0.0
    width: float = 8.0
    height: float = 6.0

    length: float = 200.0
    radius: float = 300.0
    straight: float | None = None
    transition: float = 0.0
    s_curve: bool = False
    slope: float = 0.0
    slope_end: float | None = None
    start_chainage: float = 0.0
    azimuth: float = 60.0
    origin: tuple[float, float, float] = (272_000.0, 4_765_000.0, 640.0)

    scanner: Literal["static", "profiler"] = "static"
    station_spacing: float = 15.0
    angular_step: float = 0.15
    profile_spacing: float = 0.015
    profile_points: int = 1500
    speed: float = 1.0
    density: float | None = None
    scanner_height: float = 1.7
    scanner_offset: float = 0.3
    max_range: float = 25.0
    range_noise: float = 0.003
    outliers: float = 0.0005
    relief: float = 0.0
    beam: float = 0.0
    range_curve: Literal["near_loss", "inverse_square"] = "near_loss"

    roughness: float = 12.0
    intensity_noise: float = 0.35
    leaks: int | None = None
    leak_area: tuple[float, float] = (0.05, 3.0)
    leak_drop: tuple[float, float] = (4.0, 8.0)
    leak_edge: float = 0.008
    joint_leaks: int = 0
    niche_leaks: int = 0
    cable_leaks: int = 0
    foot_leaks: int = 0
    springline_leaks: int = 0
    pocket_leaks: int = 0
    ring_leaks: int = 0
    panel_leaks: int = 0
    drips: bool = False
    drip_gap: tuple[float, float] = (0.03, 0.12)
    appendages: bool = True
    niches: bool = True

    lining: Literal["plain", "cast", "segments", "shotcrete", "tiles", "brick", "stone", "rock", "rough_shotcrete"] = "plain"
    ring: float | None = None
    ring_step: float = 0.0
    ring_shift: float = 0.0
    segment_step: float = 0.0
    ovality: tuple[float, float] = (0.0, 0.0)
    radius_step: float = 0.0
    soot: float = 0.0
    grime: float = 0.0
    patches: int = 0
    patch_level: tuple[float, float] = (-2.0, 2.0)
    patch_turn: float = 0.0
    paint: int = 0
    stripe_width: tuple[float, float] = (0.1, 0.1)
    salts: float = 0.0
    salt_level: float = 4.0
    salt_fringe: float = 0.0
    halos: int = 0
    chamfers: float = 0.0
    shade: float = 0.0
    clutter: int = 0
    thin_cables: int = 0
    trunking: int = 0
    sheets: int = 0
    mesh: float = 0.0

    banding: float = 0.0
    drift: float = 0.0
    gain_step: float = 0.0
    saturation: float | None = None
    noise_growth: float = 0.0
    ghosts: float = 0.0

    people: int = 0
    equipment: int = 0
    bollards: int = 0
    globes: int = 0
    spheres: int = 0
    sphere_radius: float = 0.0725
    free_cables: int = 0
    catenary: bool = False
    ballast: float = 0.0
    sleepers: bool = False
    camber: float = 0.0
    walkway: float = 0.0
    carriageway: float = 0.0

    epoch: int = 0
    grown_leaks: int = 0
    dried_leaks: int = 0
    new_leaks: int = 0
    moved_wall: float = 0.0
    squeezed_ring: float = 0.0
    bulges: int = 0
    bulge: float = 0.003
    pose_error: float = 0.0
    pose_turn: float = 0.0

    def __post_init__(self) -> None:
        require_within(self, LIMITS, " ")
        if not self.name or any(c in self.name for c in "/\\\0") or self.name.startswith("."):
            raise UserError(f"name {self.name!r} is not valid in a file name: use letters, digits, - and _")
        for name, names in CHOICES.items():
            if getattr(self, name) not in names:
                *others, last = names
                raise UserError(
                    f"{name.replace('_', ' ')} {getattr(self, name)!r} is unknown: use {', '.join(others)} or {last}"
                )
        if self.radius and not abs(self.radius) >= 50.0:
            raise UserError(f"radius of the curve is {self.radius:g} m: give 50 m or more, or 0 for a straight tunnel")
        if self.straight is not None and not 0.0 <= self.straight < self.length:
            raise UserError(f"straight is {self.straight:g} m: give 0 to less than the length, {self.length:g} m")
        if self.density is not None and not 0.1 <= self.density <= 1e6:
            raise UserError(f"density is {self.density:g} points/m²: give 0.1 to 1000000")
        if self.seed < 0:
            raise UserError(f"seed is {self.seed}: give 0 or more")
        for name, floor in PAIRS.items():
            low, high = getattr(self, name)
            if not floor <= low <= high:
                raise UserError(f"{name.replace('_', ' ')} is {low:g} to {high:g}: give two ascending numbers from {floor:g}")
        needs = {
            "joint_leaks": "need joints", "ring_step": "needs rings", "ring_shift": "needs rings", "ovality": "needs rings",
            "chamfers": "need joints",
        }  # fmt: skip
        for name, what in needs.items():
            if getattr(self, name) not in (0, (0.0, 0.0)) and not self.ring_length():
                text = f"{name.replace('_', ' ')} {what}, but lining {self.lining} has none"
                raise UserError(f"{text}: use lining cast or segments")
        if self.pocket_leaks and self.lining != "segments":
            raise UserError(f"pocket leaks need bolt pockets, but lining {self.lining} has none: use lining segments")
        if self.segment_step and self.lining != "segments":
            raise UserError(f"segment step needs segments, but lining {self.lining} has none: use lining segments")
        if self.ovality[1] > MAX_OVALITY:
            raise UserError(f"ovality is {self.ovality[0]:g} to {self.ovality[1]:g}: give 0 to {MAX_OVALITY:g} %")
        if (self.ovality[1] or self.ring_shift) and self.section != "circular":
            raise UserError(f"ovality and ring shift need round rings, but the section is {self.section}: use circular")
        later = ("grown_leaks", "dried_leaks", "new_leaks", "moved_wall", "squeezed_ring", "bulges", "pose_error", "pose_turn")
        if not self.epoch and (asked := next((name for name in later if getattr(self, name)), None)):
            raise UserError(f"--{asked.replace('_', '-')} applies to a later scan of the same tunnel: add --epoch 1")
        if 0.0 < self.mesh < 0.02:
            raise UserError(f"mesh is {self.mesh:g} m: give 0 for none, or 0.02 m and more between wires")
        if self.banding and self.density is not None:
            raise UserError("banding needs scan lines, but --density gives evenly spread points: omit --density")
        if self.niche_leaks and not self.niches:
            raise UserError("niche leaks need niches: omit --no-niches")
        self.crs()
        tunnel = self.tunnel()
        height = tunnel.section.floor + self.scanner_height
        _, offset, _ = tunnel.section.project(np.array([self.scanner_offset]), np.array([height]))
        if offset[0] < 0.5:
            raise UserError(
                f"the scanner, {self.scanner_height:g} m above the floor and {self.scanner_offset:g} m off the"
                " middle, is less than 0.5 m from the lining: change its height or offset"
            )

    def crs(self) -> pyproj.CRS:
        """Return the coordinate system; projected, in metres."""
        return metric_crs(self.srid)

    def tunnel(self) -> Tunnel:
        """Return the geometry of the tunnel."""
        if self.section == "circular":
            shape = section.circular(self.section_radius, self.invert)
        elif self.section == "horseshoe":
            shape = section.horseshoe(self.section_radius, self.wall_height, self.wall_lean)
        else:
            shape = section.box(self.width, self.height)
        line = CentreLine.curve(
            self.length,
            self.radius,
            straight=self.straight,
            transition=self.transition,
            s_curve=self.s_curve,
            slope=self.slope / 100.0,
            slope_end=None if self.slope_end is None else self.slope_end / 100.0,
            start_chainage=self.start_chainage,
            azimuth=self.azimuth,
            origin=self.origin,
        )
        return Tunnel(line, shape)

    def radiometry(self) -> Radiometry:
        """Return the material of the surfaces."""
        return Radiometry(roughness=self.roughness, near_loss=self.range_curve == "near_loss")

    def ring_length(self) -> float:
        """Return the distance between the joints of the lining, m; 0: none."""
        usual = RINGS.get(self.lining, 0.0)
        return self.ring if usual and self.ring is not None else usual

    def leak_count(self) -> int:
        """Return the number of leaks: as requested, else one every 12 m."""
        return max(1, round(self.length / 12.0)) if self.leaks is None else self.leaks

    def as_dict(self) -> dict[str, Any]:
        """Return all parameters, for the record."""
        return asdict(self)


# Named presets; every value can be overridden.
PRESETS: dict[str, dict[str, Any]] = {
    # about 12 million points
    "demo": {
        "name": "demo",
        "length": 150.0,
        "straight": 40.0,
        "slope": 2.0,
        "start_chainage": 12_300.0,
        "scanner": "profiler",
        "profile_spacing": 0.016,
        "profile_points": 1250,
        "leaks": 14,
    },
    # about 200 000 points, for tests
    "small": {
        "name": "small",
        "length": 40.0,
        "straight": 5.0,
        "scanner": "profiler",
        "profile_spacing": 0.1,
        "profile_points": 500,
        "leaks": 3,
    },
}

FIELDS = tuple(f.name for f in fields(Parameters))
