"""Registering sonar scans of a survey: laser points from its scan files, sonar scans, ladders; poses into the database."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psycopg

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.pipeline.ladder_file import read_ladders
from tunneldb.pipeline.read import Begin
from tunneldb.pointcloud.reader import read_chunks, read_header
from tunneldb.pointcloud.sonar import read_sonar
from tunneldb.pointcloud.voxels import Voxels
from tunneldb.registration.underwater import Registration, SonarCloud, register
from tunneldb.store.sonar import save_registration
from tunneldb.store.sources import unchanged_file
from tunneldb.store.survey import Survey

BELOW, ABOVE = 0.3, 3.0  # what of the laser's points is looked at, about the water's level, m
VOXEL = 0.01  # of which one point each is kept, m


def register_survey(
    conn: psycopg.Connection[Any],
    survey: Survey,
    paths: Sequence[Path],
    ladder_file: Path,
    up: int,
    water_level: float,
    begin: Begin,
) -> Registration:
    """Register sonar scans and store their poses, in the place of those that files of these names had.

    Parameters
    ----------
    conn : Connection
        Idle.
    paths : sequence of Path
        Sonar scans.
    ladder_file : Path
        See `tunneldb.pipeline.ladder_file.read_ladders`.
    up : int
        1 if the scans' z axis points up, -1 if down.
    water_level : float
        m, in the tunnel's system.
    begin : callable
        See `tunneldb.pipeline.read.Begin`.

    Raises
    ------
    UserError
    """
    names = [path.name for path in paths]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UserError(f"two of the files are named {twice}: a scan is known by its name")
    ladders = read_ladders(ladder_file)
    clouds, notes = [], []
    for path in paths:
        points, invalid = read_sonar(path)
        clouds.append(SonarCloud(path, points, up))
        if invalid:
            notes.append(f"{path.name}: {invalid} points without coordinates are left out")
    laser = _laser_points(conn, survey, water_level, begin)
    begin("registration", len(clouds))
    found = register(laser, clouds, ladders, water_level)
    with conn.transaction():
        save_registration(conn, survey, found, up)
    return Registration(found.scans, found.ladders, found.water_level, (*notes, *found.notes))


def _laser_points(conn: psycopg.Connection[Any], survey: Survey, water_level: float, begin: Begin) -> Float:
    """Points (n, 3) of the survey's scan files about the water's level, one in each small voxel."""
    rows = conn.execute(
        "SELECT path, bytes, checksum FROM tunnel.scan_file WHERE survey_id = %s AND bytes > 0 ORDER BY name", [survey.id]
    ).fetchall()
    conn.rollback()
    if not rows:
        raise UserError(f"survey {survey.name} has no scan of the laser: tunneldb load {survey.name} FILE")
    voxels = Voxels(VOXEL)
    lowest, highest = np.inf, -np.inf
    for name, size, checksum in rows:
        path = unchanged_file(name, size, checksum)
        step = begin(path.name, read_header(path).points)
        for chunk in read_chunks(path, None):
            height = chunk.xyz[:, 2]
            lowest, highest = min(lowest, float(height.min(initial=np.inf))), max(highest, float(height.max(initial=-np.inf)))
            voxels.add(chunk.xyz[(height > water_level - BELOW) & (height < water_level + ABOVE)])
            step(len(chunk))
    if len(voxels) == 0:
        raise UserError(
            f"--water-level {water_level:g}: no laser point lies within {ABOVE:g} m above it;"
            f" the survey's points are {lowest:.1f} to {highest:.1f} m high"
        )
    return voxels.centroids()
