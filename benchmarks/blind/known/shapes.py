"""Outlines of leaks and stains in a local plane: a along the tunnel, b downwards; the origin where water comes out."""

from __future__ import annotations

import numpy as np
from shapely import Polygon, box, unary_union
from shapely.affinity import affine_transform, rotate, scale, translate
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.known.section import Array

Rng = np.random.Generator


def on_wall(shape: BaseGeometry, u: float, s: float, down: float) -> BaseGeometry:
    """Put a local shape onto the lining; ``down`` is +1 or -1, the direction of s that leads down."""
    placed: BaseGeometry = affine_transform(shape, [1.0, 0.0, 0.0, down, u, s])
    return placed


def wave(rng: Rng, x: Array, longest: float, shortest: float, amplitude: float) -> Array:
    """Sum of sines of random phases; amplitude about its standard deviation."""
    lengths = np.geomspace(longest, shortest, 6)
    weights = lengths**0.7
    phases = rng.uniform(0, 2 * np.pi, 6)
    total = np.sum(
        [w * np.sin(2 * np.pi * x / length + p) for w, length, p in zip(weights, lengths, phases, strict=True)], axis=0
    )
    value: Array = total * (amplitude / np.sqrt(0.5 * np.sum(weights**2)))
    return value


def blob(rng: Rng, area: float, aspect: float, raggedness: float = 0.16) -> Polygon:
    """A roundish patch; ``aspect`` is its length along the tunnel over its height."""
    angle = np.linspace(0.0, 2.0 * np.pi, 240, endpoint=False)
    radius = np.ones_like(angle)
    for k in range(2, 15):
        radius += raggedness * k**-1.0 * rng.normal() * np.cos(k * angle + rng.uniform(0, 2 * np.pi))
    radius = np.maximum(radius, 0.35)
    shape = Polygon(np.column_stack([radius * np.cos(angle) * np.sqrt(aspect), radius * np.sin(angle) / np.sqrt(aspect)]))
    factor = float(np.sqrt(area / shape.area))
    return scale(shape, factor, factor, origin=(0, 0))


def run(rng: Rng, a: float, b: float, length: float, width: float) -> Polygon:
    """A run of water from (a, b) down, tapering, with a round end."""
    x = np.linspace(0.0, 1.0, max(8, int(length / 0.03)))
    centre = a + wave(rng, x * length, 1.6, 0.2, 0.012)
    half = 0.5 * width * (1.0 - 0.45 * x) * np.sqrt(np.clip(1.0 - x**8, 0.02, 1.0)) + wave(rng, x * length, 0.5, 0.08, 0.004)
    half = np.maximum(half, 0.012)
    down = b + x * length
    edge = np.vstack([np.column_stack([centre - half, down]), np.column_stack([centre + half, down])[::-1]])
    return Polygon(edge).buffer(0)


def smooth(shape: BaseGeometry, radius: float) -> BaseGeometry:
    """Round off corners as water does."""
    return shape.buffer(radius).buffer(-2 * radius).buffer(radius).union(shape).buffer(0)


def largest(shape: BaseGeometry) -> BaseGeometry:
    """The largest part, without holes under a hand's breadth."""
    parts = list(shape.geoms) if hasattr(shape, "geoms") else [shape]
    main = max(parts, key=lambda part: part.area)
    holes = [ring for ring in main.interiors if Polygon(ring).area > 0.01]
    return Polygon(main.exterior, holes)


def _lower_edge(body: BaseGeometry, a: float) -> float:
    cut = body.intersection(box(a - 0.01, -9.0, a + 0.01, 9.0))
    return float(cut.bounds[3]) if not cut.is_empty else 0.0


def dripping(rng: Rng, area: float, count: int = 0) -> BaseGeometry:
    """A patch with runs that leave its lower edge."""
    body: BaseGeometry = blob(rng, 0.72 * area, rng.uniform(0.8, 1.9))
    half = 0.8 * body.bounds[2]
    count = count or int(rng.integers(2, 5))
    spots = half * (2.0 * (np.arange(count) + rng.uniform(0.15, 0.85, count)) / count - 1.0)
    each = 0.28 * area / count
    for spot in spots:
        width = float(rng.uniform(0.06, 0.12))
        length = float(np.clip(rng.uniform(0.7, 1.5) * each / (0.75 * width), 0.15, 1.8))
        start = _lower_edge(body, float(spot)) - 0.08
        body = unary_union([body, run(rng, float(spot), start, length + 0.08, width)])
    return largest(smooth(body, 0.012))


def interrupted(rng: Rng, area: float) -> BaseGeometry:
    """A patch whose runs, 15 to 30 cm from each other, go on after a gap of 15 to 30 cm: one leak of several parts."""
    body: BaseGeometry = blob(rng, 0.62 * area, rng.uniform(1.2, 2.0), 0.12)
    pieces = [body]
    spot, last = 0.75 * body.bounds[0], 0.75 * body.bounds[2]
    while spot < last:
        width = float(rng.uniform(0.08, 0.13))
        start = _lower_edge(body, spot) - 0.06
        first = float(rng.uniform(0.15, 0.35)) + 0.06
        gap = float(rng.uniform(0.15, 0.30))
        pieces.append(run(rng, spot, start, first, width))
        pieces.append(run(rng, spot, start + first + gap, float(rng.uniform(0.3, 0.7)), width * 0.95))
        spot += float(rng.uniform(0.15, 0.30)) + width
    return unary_union(pieces).buffer(0)


def curtain(rng: Rng, area: float) -> BaseGeometry:
    """A sheet of water under a line, with an uneven lower edge."""
    length = float(np.sqrt(area * rng.uniform(1.4, 2.4)))
    a = np.linspace(0.0, length, 160)
    ends = np.clip(np.minimum(a, length - a) / (0.18 * length), 0.0, 1.0) ** 0.5
    top = wave(rng, a, 2.0, 0.3, 0.015)
    depth = (area / length) * (1.1 + wave(rng, a, 1.0, 0.12, 0.22)) * ends
    lower = top + np.maximum(depth, 0.02)
    shape = Polygon(np.vstack([np.column_stack([a, top]), np.column_stack([a, lower])[::-1]])).buffer(0)
    return translate(largest(smooth(shape, 0.01)), -0.5 * length, 0.0)


def crack(rng: Rng, area: float) -> BaseGeometry:
    """A wet crack, slanting."""
    width = float(rng.uniform(0.11, 0.17))
    length = area / width
    x = np.linspace(0.0, length, max(20, int(length / 0.03)))
    centre = wave(rng, x, 2.2, 0.25, 0.05)
    half = 0.5 * width * (1.0 + wave(rng, x, 0.8, 0.15, 0.22))
    half *= np.clip(np.minimum(x, length - x) / 0.15, 0.05, 1.0) ** 0.5
    half = np.maximum(half, 0.015)
    edge = np.vstack([np.column_stack([x, centre - half]), np.column_stack([x, centre + half])[::-1]])
    shape = largest(Polygon(edge).buffer(0))
    return rotate(translate(shape, -0.5 * length, 0.0), float(rng.uniform(-60, 60)), origin=(0, 0))


def strip(rng: Rng, length: float, width: float, unevenness: float = 0.06) -> Polygon:
    """A straight strip along a, such as a wet joint; its width varies by ``unevenness`` of itself."""
    x = np.linspace(0.0, length, max(20, int(length / 0.03)))
    ends = np.clip(np.minimum(x, length - x) / (0.6 * width), 0.0, 1.0) ** 0.5
    upper = 0.45 * width * (1.0 + wave(rng, x, 1.5, 0.2, unevenness)) * ends
    lower = 0.55 * width * (1.0 + wave(rng, x, 1.2, 0.15, 1.5 * unevenness)) * ends
    edge = np.vstack([np.column_stack([x, -upper - 0.002]), np.column_stack([x, lower + 0.002])[::-1]])
    return translate(Polygon(edge).buffer(0), -0.5 * length, 0.0)


def pocket(rng: Rng, area: float) -> BaseGeometry:
    """A bolt pocket that weeps: itself and the run below it."""
    body: BaseGeometry = box(-0.11, -0.09, 0.11, 0.09).buffer(0.025)
    length = float(np.clip((area - body.area) / 0.09, 0.3, 1.6))
    runs = [run(rng, float(rng.uniform(-0.05, 0.05)), 0.04, length, 0.13)]
    if area > 0.2:
        runs.append(run(rng, float(rng.choice([-0.08, 0.08])), 0.04, 0.5 * length, 0.08))
    return largest(smooth(unary_union([body, *runs]), 0.015))


def foot_damp(rng: Rng, length: float, height: float) -> Polygon:
    """Rising damp along the foot: b = 0 is the foot, upwards negative."""
    a = np.linspace(0.0, length, 200)
    ends = np.clip(np.minimum(a, length - a) / 0.5, 0.0, 1.0) ** 0.7
    top = height * ends * (1.0 + wave(rng, a, 1.6, 0.2, 0.18)) + 0.03
    edge = np.vstack([np.column_stack([a, -top]), [[length, 0.0], [0.0, 0.0]]])
    return translate(Polygon(edge).buffer(0), -0.5 * length, 0.0)


def fringe(rng: Rng, body: BaseGeometry, width: float, share: float) -> BaseGeometry:
    """Part of a seam about a wet patch, with wandering width."""
    outer = body.buffer(width).difference(body.buffer(0.02))
    u0, s0, u1, s1 = body.bounds
    angle = rng.uniform(0, 2 * np.pi)
    reach = 2.0 * max(u1 - u0, s1 - s0) + 1.0
    middle = np.array([0.5 * (u0 + u1), 0.5 * (s0 + s1)])
    sweep = np.linspace(angle, angle + 2 * np.pi * share, 24)
    sector = Polygon(np.vstack([middle, middle + reach * np.column_stack([np.cos(sweep), np.sin(sweep)])])).buffer(0)
    part = outer.intersection(sector)
    holes = unary_union(
        [translate(blob(rng, 0.012, 1.0, 0.3), *_point_on(rng, body.buffer(width))) for _ in range(int(3 + body.length / 0.5))]
    )
    return part.difference(holes).buffer(0)


def _point_on(rng: Rng, shape: BaseGeometry) -> tuple[float, float]:
    ring = shape.exterior if hasattr(shape, "exterior") else max(shape.geoms, key=lambda part: part.area).exterior
    point = ring.interpolate(float(rng.uniform(0.0, ring.length)))
    return float(point.x), float(point.y)


def rectangle(length: float, height: float, turn: float = 0.0) -> BaseGeometry:
    """A rectangle, turned by degrees."""
    return rotate(box(-0.5 * length, -0.5 * height, 0.5 * length, 0.5 * height), turn, origin=(0, 0))
