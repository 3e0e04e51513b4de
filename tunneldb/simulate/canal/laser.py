"""Laser scans above the water of a synthetic canal tunnel."""

from __future__ import annotations

from itertools import product

import numpy as np

from tunneldb.arrays import Float, Int32
from tunneldb.simulate.canal.cast import NO_HIT, cast
from tunneldb.simulate.canal.layout import Layout
from tunneldb.simulate.canal.parameters import CanalParameters
from tunneldb.simulate.canal.section import WATER

MAX_RANGE = 40.0  # m
_MAX_DEPRESSION = 60.0  # degrees below the horizon, below which the tripod obstructs the view
_LADDER_SPACING = 0.0025  # m between rays at a ladder, at least
_LADDER_MARGIN = 0.25  # m around a ladder in the dense scan


def scan_by_laser(parameters: CanalParameters, layout: Layout) -> tuple[Float, Int32]:
    """Return points (n, 3) of all stations in the local frame, m, and the station number (n,) of each, from 1."""
    rng = np.random.default_rng([parameters.seed, 2])
    points, numbers = [], []
    for k, place in enumerate(layout.lasers, start=1):
        rays = np.concatenate([_sphere(parameters.laser_step), *_about_ladders(parameters, layout, place)])
        found = _scan(parameters, layout, place, rays, rng)
        points.append(found)
        numbers.append(np.full(len(found), k, np.int32))
    if not points:
        return np.empty((0, 3)), np.empty(0, np.int32)
    return np.concatenate(points), np.concatenate(numbers)


def _sphere(step: float) -> Float:
    azimuth = np.radians(np.arange(0.0, 360.0, step))
    elevation = np.radians(np.arange(-_MAX_DEPRESSION, 90.0, step))
    return directions(*np.meshgrid(azimuth, elevation))


def _about_ladders(parameters: CanalParameters, layout: Layout, place: Float) -> list[Float]:
    """Return rays around each ladder in reach, as in a second, denser partial scan."""
    rays = []
    for frame in layout.scene.frames:
        corners = [
            frame[:3]
            + sum(sign * (frame[12 + a] + _LADDER_MARGIN) * frame[3 + 3 * a : 6 + 3 * a] for a, sign in enumerate(signs))
            for signs in product((-1.0, 1.0), repeat=3)
        ]
        away = np.array(corners) - place
        distance = float(np.linalg.norm(frame[:3] - place))
        if distance > MAX_RANGE:
            continue
        step = max(np.radians(parameters.laser_ladder_step), _LADDER_SPACING / distance)
        azimuth = np.arctan2(away[:, 1], away[:, 0])
        middle = np.arctan2(frame[1] - place[1], frame[0] - place[0])
        turned = (azimuth - middle + np.pi) % (2.0 * np.pi) - np.pi
        elevation = np.arctan2(away[:, 2], np.hypot(away[:, 0], away[:, 1]))
        rays.append(
            directions(
                *np.meshgrid(
                    middle + np.arange(turned.min(), turned.max(), step), np.arange(elevation.min(), elevation.max(), step)
                )
            )
        )
    return rays


def directions(azimuth: Float, elevation: Float) -> Float:
    """Return unit vectors (n, 3) of angles in rad, azimuth from x towards y."""
    flat = np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=-1).reshape(-1, 3)


def _scan(parameters: CanalParameters, layout: Layout, place: Float, rays: Float, rng: np.random.Generator) -> Float:
    hits = cast(layout.scene, place, rays, MAX_RANGE)
    reach = hits.range.copy()
    on_water = hits.kind == WATER
    mirrored = on_water & (rng.random(len(rays)) < parameters.laser_mirror_share)
    seen = (hits.kind != NO_HIT) & ~on_water
    if mirrored.any():  # the water as a mirror: objects above it appear below
        start = place + reach[mirrored, None] * rays[mirrored]
        start[:, 2] = 1e-6
        second = cast(layout.scene, start, rays[mirrored] * [1.0, 1.0, -1.0], MAX_RANGE - reach[mirrored])
        reach[mirrored] += second.range
        seen[mirrored] = second.kind != NO_HIT
    reach = reach[seen] + rng.normal(0.0, parameters.laser_noise, int(seen.sum()))
    return np.asarray(place + reach[:, None] * rays[seen])
