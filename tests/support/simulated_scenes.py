"""Scenes of the simulator with what is needed to class them: exact surface, line, classes of truth."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from tunneldb.classification.classes import PointClass
from tunneldb.geometry.frame import segment_rows, tangents
from tunneldb.geometry.plan_line import PlanLine
from tunneldb.geometry.surface import Surface
from tunneldb.simulate.generate import Cloud, Simulation
from tunneldb.simulate.parameters import Parameters

TRUTH = np.array(
    [
        PointClass.LINING,
        PointClass.GROUND,
        PointClass.APPENDAGE,
        PointClass.NICHE,
        PointClass.NOISE,
        PointClass.RAIL,
        PointClass.OBJECT,
        PointClass.SPHERE,
    ],
    np.uint8,
)
"""Class of each code of the simulator's truth."""


def scan(parameters: Parameters) -> tuple[Simulation, Cloud, NDArray[np.uint8]]:
    """A simulated survey, its points, and their true classes."""
    simulation = Simulation(parameters)
    clouds = [cloud for _, cloud in simulation.blocks()]
    cloud = Cloud(**{f.name: np.concatenate([getattr(c, f.name) for c in clouds]) for f in fields(Cloud)})
    return simulation, cloud, TRUTH[cloud.klass]


def exact(simulation: Simulation) -> tuple[Surface, PlanLine]:
    """The surface of its tunnel, with two sections each 10 m, and its axis."""
    axis, section = simulation.tunnel.line, simulation.tunnel.section
    number = np.arange(int(np.floor(axis.start / 10)), int(np.ceil(axis.end / 10)))
    stations = np.append(number, number[-1] + 1) * 10.0
    vertices = axis.position(stations)
    if np.abs(vertices - axis.origin).max() > 1e5:  # they are given from the origin on
        vertices = vertices + axis.origin
    arc = np.linspace(-section.half_perimeter, section.half_perimeter, 20001)
    u, w = section.point(arc)[0].T
    degree = np.degrees(np.arctan2(u, w))
    degree[0], degree[-1] = -180.0, 180.0
    nodes = np.arange(-180.0, 181.0)
    at = np.sort(np.concatenate([number * 10 + 2.5, number * 10 + 7.5]))
    radius, length = np.interp(nodes, degree, np.hypot(u, w)), np.interp(nodes, degree, arc)
    surface = Surface(
        number, segment_rows(vertices, tangents(vertices)), np.column_stack([stations[:-1], stations[1:]]), at,
        np.tile(radius, (len(at), 1)), np.tile(length, (len(at), 1)), 10.0,
    )  # fmt: skip
    return surface, PlanLine.of(vertices, stations)


def share(truth: NDArray[np.uint8], found: NDArray[np.uint8], klass: int) -> tuple[float, float]:
    """Return the share of a class's points that are found, and the share of found points that belong to it."""
    both = ((truth == klass) & (found == klass)).sum()
    return float(both / max((truth == klass).sum(), 1)), float(both / max((found == klass).sum(), 1))
