"""Structural members: profiles, pipes with elbows and flanges, gratings, trays, bundles, plates."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from tunneldb.arrays import Float
from tunneldb.simulate.structure.shapes import BEND, RECTANGLE, RING, TUBE, Member, Structure, axes_about, surface

# Outlines of sections: corners (p, q) of one turn, outside on the right; and rectangles (p, q, half sizes) that fill them.
Section = tuple[list[tuple[float, float]], list[tuple[float, float, float, float]]]


def i_section(depth: float, width: float, web: float, flange: float) -> Section:
    """Return the section of an I-profile, its web along q; outer sizes and thicknesses, m."""
    b, h, w, f = 0.5 * width, 0.5 * depth, 0.5 * web, 0.5 * depth - flange
    half = [(b, -h), (b, -f), (w, -f), (w, f), (b, f), (b, h)]
    corners = half + [(-p, -q) for p, q in half]
    return corners, [(0.0, h - 0.5 * flange, b, 0.5 * flange), (0.0, 0.5 * flange - h, b, 0.5 * flange), (0.0, 0.0, w, f)]


def u_section(depth: float, width: float, thick: float) -> Section:
    """Return the section of a U-profile, open towards +p."""
    b, h, t = 0.5 * width, 0.5 * depth, thick
    corners = [(-b, -h), (b, -h), (b, -h + t), (-b + t, -h + t), (-b + t, h - t), (b, h - t), (b, h), (-b, h)]
    return corners, [
        (0.0, 0.5 * t - h, b, 0.5 * t),
        (0.0, h - 0.5 * t, b, 0.5 * t),
        (0.5 * t - b, 0.0, 0.5 * t, h - t),
    ]


def l_section(depth: float, width: float, thick: float) -> Section:
    """Return the section of an L-profile, its corner at the least p and q."""
    b, h, t = 0.5 * width, 0.5 * depth, thick
    corners = [(-b, -h), (b, -h), (b, -h + t), (-b + t, -h + t), (-b + t, h), (-b, h)]
    return corners, [(0.0, 0.5 * t - h, b, 0.5 * t), (0.5 * t - b, 0.5 * t, 0.5 * t, h - 0.5 * t)]


def box_section(depth: float, width: float) -> Section:
    """Return the section of a box or a solid bar."""
    b, h = 0.5 * width, 0.5 * depth
    return [(b, -h), (b, h), (-b, h), (-b, -h)], [(0.0, 0.0, b, h)]


def profile(
    structure: Structure, kind: str, material: str, section: Section, start: Float, axes: Float, length: float
) -> Member:
    """Add a profile: a section drawn along the third axis; p and q are along the first two."""
    member = structure.member(kind)
    corners, parts = section
    p_axis, q_axis, along = axes
    middle = start + 0.5 * length * along
    for (p0, q0), (p1, q1) in pairwise([*corners, corners[0]]):
        side = np.array([p1 - p0, q1 - q0])
        size = float(np.linalg.norm(side))
        edge = side[0] / size * p_axis + side[1] / size * q_axis
        origin = middle + 0.5 * (p0 + p1) * p_axis + 0.5 * (q0 + q1) * q_axis
        frame = np.array([along, edge, np.cross(along, edge)])
        if frame[2] @ (side[1] * p_axis - side[0] * q_axis) < 0.0:
            frame[1:] *= -1.0
        structure.face(member, "plane", material, [surface(RECTANGLE, origin, frame, 0.5 * length, 0.5 * size)])
    for end, sign in ((start, -1.0), (start + length * along, 1.0)):
        frame = np.array([p_axis, sign * np.cross(along, p_axis), sign * along])
        caps = [surface(RECTANGLE, end + p * p_axis + q * q_axis, frame, a, b) for p, q, a, b in parts]
        structure.face(member, "plane", material, caps)
    return member


def pipe(
    structure: Structure,
    material: str,
    radius: float,
    start: Float,
    direction: Float,
    length: float,
    turn: Float | None,
    after: float,
    flanges: list[float],
) -> Member:
    """Add a pipe from ``start`` along ``direction``; with ``turn``, an elbow leads into that direction for ``after`` m.

    ``flanges`` are the positions of pairs of flanges along the first part, m.
    """
    member = structure.member("pipe")
    first = axes_about(direction)
    structure.face(member, "cylinder", material, [surface(TUBE, start, first, radius, length)])
    end, leaving = start + length * direction, direction
    if turn is not None:
        major = 3.0 * radius
        frame = np.array([-turn, direction, np.cross(-turn, direction)])
        structure.face(member, "bend", material, [surface(BEND, end + major * turn, frame, major, radius, 0.5 * math.pi)])
        begin = end + major * (direction + turn)
        structure.face(member, "cylinder", material, [surface(TUBE, begin, axes_about(turn), radius, after)])
        end, leaving = begin + after * turn, turn
    for place, out in ((start, -direction), (end, leaving)):
        structure.face(member, "plane", material, [surface(RING, place, axes_about(out), 0.0, radius)])
    outer, thick = 1.35 * radius + 0.02, 0.016 + 0.08 * radius
    for at in flanges:
        place = start + (at - thick) * direction
        structure.face(member, "cylinder", material, [surface(TUBE, place, first, outer, 2.0 * thick)])
        for step, sign in ((0.0, -1.0), (2.0 * thick, 1.0)):
            structure.face(
                member,
                "plane",
                material,
                [surface(RING, place + step * direction, axes_about(sign * direction), radius, outer)],
            )
    return member


def rod(start: Float, end: Float, radius: float) -> Float:
    """Return a wire or cable from end to end."""
    way = end - start
    return surface(TUBE, start, axes_about(way), radius, float(np.linalg.norm(way)))


def grating(structure: Structure, start: Float, across: Float, up: Float, width: float, height: float, pitch: float) -> None:
    """Add a grating of wires between two posts and two rails of L-profiles."""
    third = np.cross(across, up)
    for at in np.arange(pitch, width, pitch):
        structure.wires("galvanised", [rod(start + at * across, start + at * across + height * up, 0.0025)])
    for at in np.arange(2.0 * pitch, height, 2.0 * pitch):
        structure.wires("galvanised", [rod(start + at * up, start + at * up + width * across, 0.0025)])
    section = l_section(0.05, 0.05, 0.006)
    for at in (0.0, width):
        frame = np.array([third, across, up])  # across x up = third, so third x across = up
        profile(structure, "L profile", "galvanised", section, start + at * across, frame, height)


def tray(structure: Structure, start: Float, along: Float, across: Float, length: float, rng: np.random.Generator) -> None:
    """Add a cable tray: two rails, rungs, and sagging cables on them."""
    up = np.cross(along, across)
    width = 0.3
    member = structure.member("tray")
    for side in (-0.5, 0.5):
        for face in (-1.0, 1.0):
            frame = np.array([along, np.cross(face * across, along), face * across])
            origin = start + 0.5 * length * along + (side * width + face * 0.001) * across + 0.03 * up
            structure.face(member, "plane", "galvanised", [surface(RECTANGLE, origin, frame, 0.5 * length, 0.03)])
    for at in np.arange(0.15, length, 0.3):
        middle = start + at * along
        structure.wires("galvanised", [rod(middle - 0.5 * width * across, middle + 0.5 * width * across, 0.008)])
    for place in rng.uniform(-0.11, 0.11, 5):
        radius = float(rng.uniform(0.006, 0.015))
        cable(structure, start + place * across + (0.009 + radius) * up, along, length, radius, 0.006, rng)


def bundle(structure: Structure, start: Float, along: Float, length: float, rng: np.random.Generator) -> None:
    """Add a bundle of seven cables."""
    radius = float(rng.uniform(0.006, 0.012))
    first, second, _ = axes_about(along)
    for k in range(7):
        angle = k * math.pi / 3.0
        place = np.zeros(3) if k == 6 else 2.05 * radius * (math.cos(angle) * first + math.sin(angle) * second)
        cable(structure, start + place, along, length, radius, 0.002, rng)


def cable(
    structure: Structure, start: Float, along: Float, length: float, radius: float, wave: float, rng: np.random.Generator
) -> None:
    """Add a cable that varies by ``wave`` about its line, m."""
    many = max(2, math.ceil(length / 0.4))
    first, second, _ = axes_about(along)
    at = start + np.linspace(0.0, length, many + 1)[:, None] * along
    at = at + rng.normal(0.0, wave, (many + 1, 1)) * first + np.abs(rng.normal(0.0, wave, (many + 1, 1))) * second
    structure.wires("cable", [rod(one, other, radius) for one, other in pairwise(at)])


def plate(structure: Structure, kind: str, material: str, middle: Float, axes: Float, a: float, b: float) -> Member:
    """Add a plate of full sizes a and b, visible from the side of its third axis."""
    member = structure.member(kind)
    structure.face(member, "plane", material, [surface(RECTANGLE, middle, axes, 0.5 * a, 0.5 * b)])
    return member
