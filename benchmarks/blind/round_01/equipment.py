"""What hangs on the lining or stands before it: cables, pipes, boxes, rails, walkways."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .frames import Array, Mask, Tunnel

PIECE = 0.9


@dataclass(frozen=True)
class Rod:
    """A straight piece of a cable or a pipe, in site coordinates, with its reflectance in dB."""

    start: Array
    end: Array
    radius: float
    shade: float

    def corners(self) -> Array:
        """Points that span it."""
        way = np.linspace(0.0, 1.0, 5)[:, None]
        middle = self.start + way * (self.end - self.start)
        sides = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * self.radius
        return (middle[:, None, :] + sides[None]).reshape(-1, 3)

    def meet(self, origin: Array, ray: Array, grow: float) -> tuple[Array, Array]:
        """Range at which rays meet it, grown by some millimetres, and cosine of the incidence; infinite where they miss."""
        axis = self.end - self.start
        length = float(np.linalg.norm(axis))
        axis = axis / length
        from_start = origin - self.start
        along_ray, along_origin = ray @ axis, from_start @ axis
        across = ray - along_ray[..., None] * axis
        offset = from_start - along_origin[..., None] * axis
        a = np.einsum("...i,...i", across, across)
        b = np.einsum("...i,...i", across, np.broadcast_to(offset, across.shape))
        c = np.einsum("...i,...i", offset, offset) - (self.radius + grow) ** 2
        root = b * b - a * c
        with np.errstate(invalid="ignore", divide="ignore"):
            reach = (-b - np.sqrt(root)) / a
            place = along_origin + reach * along_ray
            hit = (root > 0) & (reach > 0.3) & (place > -0.01) & (place < length + 0.01)
            cosine = np.sqrt(root) / (self.radius + grow)
        return np.where(hit, reach, np.inf), np.where(hit, cosine, 1.0)


@dataclass(frozen=True)
class Block:
    """A cuboid in site coordinates: middle, unit axes as rows, half sizes, reflectance in dB."""

    middle: Array
    axes: Array
    half: Array
    shade: float

    def corners(self) -> Array:
        """Points that span it."""
        grid = np.array([[x, y, z] for x in (-1, -0.5, 0, 0.5, 1) for y in (-1, 1) for z in (-1, 1)])
        corners: Array = self.middle + (grid * self.half) @ self.axes
        return corners

    def meet(self, origin: Array, ray: Array, grow: float) -> tuple[Array, Array]:
        """Range at which rays meet it, grown by some millimetres, and cosine of the incidence; infinite where they miss."""
        start = (origin - self.middle) @ self.axes.T
        way = ray @ self.axes.T
        way = np.where(np.abs(way) < 1e-9, 1e-9, way)
        size = np.maximum(self.half + grow, 5e-4)
        near = (-np.sign(way) * size - start) / way
        far = (np.sign(way) * size - start) / way
        reach = near.max(axis=-1)
        hit = (reach < far.min(axis=-1)) & (reach > 0.3)
        face = near.argmax(axis=-1)
        cosine = np.abs(np.take_along_axis(way, face[..., None], axis=-1)[..., 0])
        return np.where(hit, reach, np.inf), np.where(hit, cosine, 1.0)


Body = Rod | Block


def _cuts(start: float, end: float) -> Array:
    """Chainages that cut a length into pieces short enough to be straight."""
    return np.linspace(start, end, max(2, int(np.ceil((end - start) / PIECE)) + 1))


def strand(
    tunnel: Tunnel,
    span: tuple[float, float],
    v: float,
    off: float,
    radius: float,
    shade: float,
    sag: float = 0.0,
    pitch: float = 1.0,
) -> Iterator[Rod]:
    """A cable or pipe along the tunnel, ``off`` from the lining to its middle, sagging between holders."""
    u = _cuts(*span) if sag == 0.0 else np.linspace(*span, int((span[1] - span[0]) / pitch * 4) + 1)
    line = tunnel.surface(u, np.full_like(u, v), np.full_like(u, -off))
    line[:, 2] -= sag * np.sin(np.pi * ((u - span[0]) / pitch % 1.0))
    for start, end in pairwise(line):
        yield Rod(start, end, radius, shade)


def hoop(tunnel: Tunnel, u: float, v_span: tuple[float, float], off: float, radius: float, shade: float) -> Iterator[Rod]:
    """A cable or pipe round the wall at one chainage."""
    v = np.linspace(*v_span, max(2, int(abs(v_span[1] - v_span[0]) / 0.25) + 1))
    line = tunnel.surface(np.full_like(v, u), v, np.full_like(v, -off))
    for start, end in pairwise(line):
        yield Rod(start, end, radius, shade)


def plate(tunnel: Tunnel, u: float, v: float, size: tuple[float, float, float], shade: float, gap: float = 0.0) -> Block:
    """A box on the wall: length along the tunnel, along the girth, and height off the lining; ``gap`` is behind it."""
    depth = gap + size[2] / 2
    middle = tunnel.surface(np.array([u]), np.array([v]), np.array([-depth]))
    on_wall = tunnel.surface(np.array([u]), np.array([v]))
    axes = np.concatenate(tunnel.normals(on_wall))
    return Block(middle[0], axes, np.array(size) / 2, shade)


def beam(
    tunnel: Tunnel, span: tuple[float, float], y: float, z: float, width: float, height: float, shade: float
) -> Iterator[Block]:
    """A bar of rectangular section along the tunnel: a rail, a walkway, a duct; y and z are of its middle."""
    u = _cuts(*span)
    for start, end in pairwise(u):
        ends = tunnel.axis.to_site(np.array([start, end]), np.array([y]), np.array([z]))
        along = ends[1] - ends[0]
        length = float(np.linalg.norm(along))
        along = along / length
        across = tunnel.axis.across(np.array((start + end) / 2))
        axes = np.stack([along, across, np.cross(along, across)])
        yield Block(ends.mean(axis=0), axes, np.array([length / 2 + 0.002, width / 2, height / 2]), shade)


def rack(
    tunnel: Tunnel,
    span: tuple[float, float],
    places: list[tuple[float, float, float, float]],
    pitch: float,
    bracket: tuple[float, float, float],
    rng: np.random.Generator,
) -> list[Body]:
    """Cables (girth, distance off the wall, radius, reflectance) that sag between brackets of a given size."""
    bodies: list[Body] = []
    for v, off, radius, shade in places:
        sag = float(rng.uniform(0.006, 0.025))
        bodies += strand(tunnel, span, v + float(rng.normal(0, 0.004)), off, radius, shade, sag, pitch)
    middle = float(np.mean([place[0] for place in places]))
    for u in np.arange(span[0] + 0.02, span[1], pitch):
        bodies.append(plate(tunnel, float(u), middle, bracket, float(rng.normal(-1.5, 0.8))))
    return bodies


def hits(body: Body, origin: Array, ray: Array, beam_width: float) -> tuple[Array, Array, Mask]:
    """Where rays meet a body with any part of the beam; those that only part of the beam meets are flagged."""
    reach, cosine = body.meet(origin, ray, beam_width / 2)
    full, _ = body.meet(origin, ray, -beam_width / 2)
    return reach, cosine, np.isfinite(reach) & ~np.isfinite(full)
