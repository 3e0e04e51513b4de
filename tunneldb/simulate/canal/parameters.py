"""Parameters of a synthetic canal tunnel, and of its scans above and below the water."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import pyproj

from tunneldb.errors import UserError
from tunneldb.simulate.checks import metric_crs, require_within

# Allowed values: low, high, unit.
LIMITS: dict[str, tuple[float, float, str]] = {
    "length": (6.0, 600.0, "m"),
    "width": (3.0, 20.0, "m"),
    "depth": (1.0, 8.0, "m"),
    "springing": (0.2, 6.0, "m"),
    "vault_radius": (1.5, 20.0, "m"),
    "batter": (0.0, 8.0, "degrees"),
    "batter_below": (0.0, 8.0, "degrees"),
    "roughness": (0.0, 0.05, "m"),
    "roughness_length": (0.05, 3.0, "m"),
    "joint_depth": (0.0, 0.03, "m"),
    "bed_relief": (0.0, 0.3, "m"),
    "bed_length": (0.5, 5.0, "m"),
    "bed_rise": (0.0, 1.0, "m"),
    "towpath_width": (0.0, 3.0, "m"),
    "towpath_height": (0.1, 1.5, "m"),
    "piers": (0, 20, "piers"),
    "niches": (0, 20, "niches"),
    "objects": (0, 40, "objects"),
    "ladders": (0, 8, "ladders"),
    "hidden_rungs": (0, 8, "rungs"),
    "sonar_stations": (0, 120, "stations"),
    "sonar_spacing": (1.0, 30.0, "m"),
    "sonar_tripod_tilt": (0.0, 15.0, "degrees"),
    "sonar_step": (0.09, 3.0, "degrees"),
    "sonar_beams": (8, 512, "beams"),
    "sonar_noise": (0.0, 0.1, "m"),
    "sonar_maximum_range": (2.0, 30.0, "m"),
    "sound_speed_spread": (0.0, 0.05, "of the range"),
    "sound_speed_scan_spread": (0.0, 0.01, "of the range"),
    "sonar_settling": (0.0, 0.5, "m"),
    "false_share": (0.0, 0.5, "of the points"),
    "water_surface_share": (0.0, 1.0, "of the beams that hit it"),
    "laser_stations": (0, 40, "stations"),
    "laser_step": (0.02, 2.0, "degrees"),
    "laser_ladder_step": (0.01, 2.0, "degrees"),
    "laser_noise": (0.0, 0.05, "m"),
    "laser_mirror_share": (0.0, 1.0, "of the rays that hit the water"),
}


@dataclass(frozen=True, kw_only=True)
class CanalParameters:
    """Synthetic canal tunnel and its scans; lengths in m, angles in degrees, heights above the water unless stated otherwise.

    Attributes
    ----------
    seed : int
        Random seed for relief, positions, poses and noise.
    origin : (float, float)
        Easting and northing of the axis at half the canal's length.
    azimuth : float
        Grid azimuth of the axis there, clockwise from north.
    radius : float
        Radius of the axis in plan: positive curves to the left, negative to the right, 0 is straight.
    water_level : float
        Height of the water surface in the tunnel's frame.
    width, depth : float
        Width of the canal at the water; depth of the bed's middle below it, without relief.
    springing, vault_radius : float
        Height of the springing, and radius of the vault, increased if it could not span walls and towpath.
    batter, batter_below : float
        Angle of the walls to the vertical above and below the water; the canal is narrower at its bottom.
    roughness, roughness_length : float
        Standard deviation and correlation length of the relief of stones.
    joint_depth : float
        Depth of the joints, in courses of 0.3 m.
    bed_relief, bed_length, bed_rise : float
        Standard deviation and correlation length of the silt's relief; its rise towards the walls.
    towpath : str
        left, right or none: ledge along one bank, whose retaining wall is the canal's wall.
    piers, niches, objects : int
        Numbers of buttresses in front of the walls, recesses in them, and spheres and boxes on the bed.
    boat : bool
        True for a boat moored at a wall.
    ladders : int
        Number of ladders, alternately on both banks, between the sonar's stations.
    ladder_standoff, ladder_lean, ladder_sideways : (float, float)
        Limits of the distance to the wall, of the lean towards the wall, and of the lean along the wall (either way).
    ladder_submerged : (float, float)
        Limits of the length under water.
    hidden_rungs : int
        Number of rungs of each ladder that no scan shows; they are listed like all others.
    sonar_stations, sonar_spacing : int, float
        Number of stations and their spacing along the axis, centred.
    sonar_tilts : tuple of float
        Elevations of the middle of the fan; each is a separate scan at each station.
    sonar_depth, sonar_offset : (float, float)
        Limits of the depth below the water, and of the distance from the canal's middle (either way).
    sonar_tripod_tilt : float
        Standard deviation of the inclination of the tripod about both horizontal axes.
    sonar_z_down : bool
        True if the files' z axis points down (x is unchanged, y is reversed: both frames are right-handed).
    sonar_step, sonar_beams, sonar_swath, sonar_beam_width : float, int, float, float
        Step of azimuth, beams of a fan, the fan's height and a beam's two-way half-power width. The values of the device are
        0.18, 256, 45 and 1; the default step is four times larger, so that a scan has about 110 000 points.
    sub_rays : int
        Rays per beam: 1, 7, 13 or 19.
    sonar_resolution, sonar_noise, sonar_maximum_range : float
        Length of the pulse in range; standard deviation of a range; greatest range.
    sound_speed_error : float or None
        Relative error of the session: true range is the file's times 1 + error. None: uniform within ± ``sound_speed_spread``.
    sound_speed_scan_spread : float
        Greatest additional error of each scan.
    sonar_settling : float
        Movement of the tripod during the second half of each rotation; 0: none.
    false_share : float
        Share of false echoes in a scan: random, by the water surface, between walls, by side lobes.
    water_surface_share : float
        Share of the beams to the water surface only that return its echo.
    laser_stations, laser_spacing : int, float
        Number of stations and their spacing along the axis, centred.
    laser_step, laser_ladder_step : float
        Steps between rays, in the overview and around ladders (there at least 2.5 mm at the ladder).
    laser_noise : float
        Standard deviation of a range.
    laser_mirror_share : float
        Share of the rays to the water that return a mirror image of objects above it.
    """

    name: str = "canal"
    seed: int = 1
    srid: int = 25832
    origin: tuple[float, float] = (352_000.0, 5_400_000.0)
    azimuth: float = 37.0
    radius: float = 0.0
    length: float = 40.0
    water_level: float = 265.0
    width: float = 6.6
    depth: float = 2.5
    springing: float = 1.5
    vault_radius: float = 4.0
    batter: float = 0.0
    batter_below: float = 0.0
    roughness: float = 0.010
    roughness_length: float = 0.3
    joint_depth: float = 0.008
    bed_relief: float = 0.08
    bed_length: float = 2.0
    bed_rise: float = 0.3
    towpath: str = "none"
    towpath_width: float = 1.5
    towpath_height: float = 0.5
    piers: int = 0
    niches: int = 0
    objects: int = 0
    boat: bool = False
    ladders: int = 2
    ladder_standoff: tuple[float, float] = (0.1, 0.5)
    ladder_lean: tuple[float, float] = (1.0, 8.0)
    ladder_sideways: tuple[float, float] = (0.0, 3.0)
    ladder_submerged: tuple[float, float] = (1.5, 2.0)
    hidden_rungs: int = 0
    sonar_stations: int = 3
    sonar_spacing: float = 5.0
    sonar_tilts: tuple[float, ...] = (0.0,)
    sonar_depth: tuple[float, float] = (1.0, 1.4)
    sonar_offset: tuple[float, float] = (0.2, 0.8)
    sonar_tripod_tilt: float = 1.5
    sonar_z_down: bool = False
    sonar_step: float = 0.72
    sonar_beams: int = 256
    sonar_swath: float = 45.0
    sonar_beam_width: float = 1.0
    sub_rays: int = 13
    sonar_resolution: float = 0.02
    sonar_noise: float = 0.015
    sonar_maximum_range: float = 30.0
    sound_speed_error: float | None = None
    sound_speed_spread: float = 0.01
    sound_speed_scan_spread: float = 0.001
    sonar_settling: float = 0.0
    false_share: float = 0.03
    water_surface_share: float = 0.05
    laser_stations: int = 2
    laser_spacing: float = 8.0
    laser_step: float = 0.3
    laser_ladder_step: float = 0.04
    laser_noise: float = 0.002
    laser_mirror_share: float = 0.01

    def __post_init__(self) -> None:
        require_within(self, LIMITS)
        if self.towpath not in ("none", "left", "right"):
            raise UserError(f"towpath is {self.towpath}: give left, right or none")
        if self.sub_rays not in (1, 7, 13, 19):
            raise UserError(f"sub-rays is {self.sub_rays}: give 1, 7, 13 or 19")
        if self.radius != 0.0 and abs(self.radius) < 30.0:
            raise UserError(f"radius is {self.radius:g}: give 0 or at least 30 m, either way")
        for name in ("ladder_standoff", "ladder_lean", "ladder_sideways", "ladder_submerged", "sonar_depth", "sonar_offset"):
            low, high = getattr(self, name)
            if not 0.0 <= low <= high:
                raise UserError(f"{name.replace('_', '-')} is {low:g} to {high:g}: give two ascending values from 0 on")
        if self.sonar_depth[1] >= self.depth:
            raise UserError(f"sonar-depth is up to {self.sonar_depth[1]:g} m: the canal is {self.depth:g} m deep")

    def towpath_side(self) -> int:
        """Return 1 for the left bank (offsets above 0), -1 for the right, 0 for none."""
        return {"none": 0, "left": 1, "right": -1}[self.towpath]

    def crs(self) -> pyproj.CRS:
        """Return the coordinate system; projected, in metres."""
        return metric_crs(self.srid)

    def as_dict(self) -> dict[str, Any]:
        """Return all parameters, for the record."""
        return asdict(self)
