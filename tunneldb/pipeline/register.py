"""Registering sonar scans of a survey: laser points from its scan files, sonar scans, ladders; poses into the database."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.counted import counted
from tunneldb.errors import UserError
from tunneldb.geometry.units import Units
from tunneldb.pipeline.ladder_file import read_ladders, read_start
from tunneldb.pointcloud.reader import read_chunks, read_header
from tunneldb.pointcloud.sonar import read_sonar
from tunneldb.pointcloud.voxels import Voxels
from tunneldb.progress import StartProgress
from tunneldb.registration.underwater import Registration, SonarCloud, SonarPose, register
from tunneldb.store.sonar import save_registration
from tunneldb.store.sources import unchanged_file
from tunneldb.store.survey import Survey

SPEEDS = (1300.0, 1700.0)  # of sound in water, m/s
BELOW, ABOVE = 0.3, 3.0  # what of the laser's points is looked at, about the water's level, m
VOXEL = 0.01  # of which one point each is kept, m


@dataclass(frozen=True)
class SonarInput:
    """Options on sonar scans.

    Attributes
    ----------
    paths : tuple of Path
    ladders : Path or None
        See `tunneldb.pipeline.ladder_file.read_ladders`.
    up : int
        1 if the scans' z axis points up, -1 if down.
    water_level : float
        m, in the tunnel's system.
    start : Path or None
        See `tunneldb.pipeline.ladder_file.read_start`.
    sound_speed : (float, float) or None
        Sound speed assumed by the sonar, and measured one, m/s.
    """

    paths: tuple[Path, ...]
    ladders: Path | None
    up: int
    water_level: float
    start: Path | None = None
    sound_speed: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        names = [path.name for path in self.paths]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise UserError(f"two of the files are named {twice}: a scan is known by its name")
        for speed in self.sound_speed or ():
            if not SPEEDS[0] <= speed <= SPEEDS[1]:
                raise UserError(
                    f"--sound-speed {speed:g}: sound in water goes {SPEEDS[0]:g} to {SPEEDS[1]:g} m/s;"
                    " give ASSUMED=MEASURED, as 1500=1447"
                )

    @property
    def factor(self) -> float:
        """Return the factor on ranges, as far as known beforehand."""
        return 1.0 if self.sound_speed is None else self.sound_speed[1] / self.sound_speed[0]


def register_survey(conn: psycopg.Connection[Any], survey: Survey, given: SonarInput, begin: StartProgress) -> Registration:
    """Register sonar scans and store their poses, in the place of those that files of these names had.

    Parameters
    ----------
    conn : Connection
        Idle.
    begin : callable
        See `tunneldb.progress.StartProgress`.

    Raises
    ------
    UserError
    """
    ladders = [] if given.ladders is None else read_ladders(given.ladders)
    places = {} if given.start is None else read_start(given.start)
    unknown = next((name for name in places if name not in {path.name for path in given.paths}), None)
    if unknown is not None:
        raise UserError(f"{given.start}: {unknown} is none of the files")
    clouds, notes = [], []
    for path in given.paths:
        points, invalid = read_sonar(path)
        clouds.append(SonarCloud(path, points * given.factor, given.up, places.get(path.name)))
        if invalid:
            notes.append(f"{path.name}: {counted(invalid, 'point')} without coordinates left out")
    laser = _laser_points(conn, survey, given.water_level, begin)
    begin("registration", len(clouds))
    found = register(laser, clouds, ladders, given.water_level)
    poses = tuple(_of_file(scan, given.factor) for scan in found.scans)
    found = replace(found, scans=poses, notes=(*notes, *found.notes))
    with conn.transaction():
        save_registration(conn, survey, found, given.up)
    return found


def _of_file(scan: SonarPose, factor: float) -> SonarPose:
    """Return the pose of a file's points, from that of these times ``factor``."""
    unit = np.ones(7)
    unit[6] = factor
    return replace(
        scan, scale=scan.scale * factor, covariance=scan.covariance * unit * unit[:, None], walls=scan.walls / factor,
        alternatives=tuple(replace(one, scale=one.scale * factor) for one in scan.alternatives),
    )  # fmt: skip


def _laser_points(conn: psycopg.Connection[Any], survey: Survey, water_level: float, begin: StartProgress) -> Float:
    """Return points (n, 3) of the survey's scan files near the water level, one per small voxel."""
    rows = conn.execute(
        "SELECT path, bytes, checksum, unit, height_unit FROM tunnel.scan_file WHERE survey_id = %s AND bytes > 0"
        " ORDER BY name",
        [survey.id],
    ).fetchall()
    conn.rollback()
    if not rows:
        raise UserError(f"survey {survey.name} has no laser scan: tunneldb load {survey.name} FILE")
    voxels = Voxels(VOXEL)
    lowest, highest = np.inf, -np.inf
    for name, size, checksum, unit, height_unit in rows:
        path = unchanged_file(name, size, checksum)
        step = begin(path.name, read_header(path).points)
        for chunk in read_chunks(path, None, units=Units(unit, height_unit)):
            height = chunk.xyz[:, 2]
            lowest, highest = min(lowest, float(height.min(initial=np.inf))), max(highest, float(height.max(initial=-np.inf)))
            voxels.add(chunk.xyz[(height > water_level - BELOW) & (height < water_level + ABOVE)])
            step(len(chunk))
    if len(voxels) == 0:
        raise UserError(
            f"--water-level {water_level:g}: no laser point is within {ABOVE:g} m above it;"
            f" the survey's points are {lowest:.1f} to {highest:.1f} m high"
        )
    return voxels.centroids()
