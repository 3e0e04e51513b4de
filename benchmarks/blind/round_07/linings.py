"""Linings as they are when dry and clean: their tone, joints and unevenness."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .canvas import Canvas
from .shapes import smooth


def cast_concrete(
    canvas: Canvas, joints: Sequence[float], level: float = -4.0, panels: float = 0.0, patchy: float = 0.5
) -> None:
    """Concrete cast in blocks against a form.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    joints : sequence of float
        Chainages of the joints between blocks.
    level : float
        Mean reflectance, in dB.
    panels : float
        Width of the form's panels along the tunnel, in metres; none where zero.
    patchy : float
        Deviation of the tone, in dB.
    """
    rng = canvas.rng
    canvas.base += level + patchy * canvas.noise(5.0, 4) + 0.3 * canvas.noise(0.5, 3) + 0.15 * canvas.noise(0.06, 1)
    block = np.searchsorted(np.asarray(joints), canvas.u)
    canvas.base += rng.normal(0, 0.45, len(joints) + 1)[block].astype(np.float32)[:, None]
    for joint in joints:
        near = np.abs(canvas.u - joint)
        canvas.base -= (1.8 * smooth((0.02 - near) / 0.015))[:, None].astype(np.float32)
        canvas.height -= (0.01 * (near < 0.012))[:, None].astype(np.float32)
        step = rng.normal(0, 0.004)
        canvas.height += np.where(canvas.u > joint, step, 0.0).astype(np.float32)[:, None]
    if panels:
        line = np.abs(np.mod(canvas.u + 0.3, panels) - panels / 2)
        canvas.base -= (0.6 * (line < canvas.cell))[:, None].astype(np.float32)
        seam = np.abs(np.mod(canvas.s + 0.4, 1.5) - 0.75)
        canvas.base -= (0.5 * (seam < canvas.cell))[None, :].astype(np.float32)
    pores = canvas.noise(0.07, 1)
    canvas.base -= 1.2 * smooth((pores - 2.9) / 0.4).astype(np.float32)
    canvas.height += 0.004 * canvas.noise(3.0, 3)


def shotcrete(canvas: Canvas, level: float = -4.5, rough: float = 0.02, patchy: float = 0.9) -> None:
    """Sprayed concrete: uneven, in lifts of differing age, with lumps that shade.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    level : float
        Mean reflectance, in dB.
    rough : float
        Deviation of its unevenness, in metres.
    patchy : float
        Deviation of the tone, in dB.
    """
    lifts = canvas.noise(3.5, 2, stretch=(0.5, 1.4))
    canvas.base += level + patchy * (0.6 * np.tanh(3 * lifts) + 0.5 * canvas.noise(4.0, 4)) + 0.35 * canvas.noise(0.3, 3)
    canvas.base += 0.2 * canvas.noise(0.05, 1)
    canvas.height += rough * canvas.noise(1.6, 4, 0.5) + 0.2 * rough * canvas.noise(0.12, 2)


def masonry(
    canvas: Canvas,
    course: float,
    length: float,
    joint: float,
    spread: float,
    part: tuple[float, float],
    mortar: float = 1.0,
) -> None:
    """Bricks or stones in courses along the tunnel, in bond.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    course, length : float
        Height and length of a stone with its joint, in metres.
    joint : float
        Width of the joints, in metres.
    spread : float
        Deviation of the tone from stone to stone, in dB.
    part : tuple of float
        Places on the girth between which it lies.
    mortar : float
        By how much mortar is brighter than the stones, in dB.
    """
    rng = canvas.rng
    columns = np.flatnonzero((canvas.s >= part[0]) & (canvas.s < part[1]))
    row = np.floor((canvas.s[columns] - part[0]) / course).astype(int)
    jitter = rng.normal(0, 0.08 * length, row.max() + 1)
    shifted = canvas.u[:, None] + (0.5 * length * (row % 2) + jitter[row])[None, :]
    stone = np.floor(shifted / length).astype(int) + 3
    tone = rng.normal(0, spread, (row.max() + 1, stone.max() + 1)).astype(np.float32)
    proud = rng.normal(0, 0.1 * joint, tone.shape).astype(np.float32)
    face = np.abs(np.mod(shifted, length) - length / 2) < (length - joint) / 2
    bed = np.abs(np.mod(canvas.s[columns] - part[0], course) - course / 2) < (course - joint) / 2
    solid = face & bed[None, :]
    canvas.base[:, columns] += np.where(solid, tone[row[None, :], stone], mortar)
    canvas.height[:, columns] += np.where(solid, proud[row[None, :], stone], -0.4 * joint)


def rock(canvas: Canvas, level: float, rough: float, blocks: float = 0.8) -> None:
    """Blasted or hewn rock: faces of joints, ledges and the tone of its beds.

    Parameters
    ----------
    canvas : Canvas
        The lining.
    level : float
        Mean reflectance, in dB.
    rough : float
        Deviation of its unevenness, in metres.
    blocks : float
        Size of its blocks, in metres.
    """
    relief = canvas.noise(3 * blocks, 5, 0.5)
    ledges = np.abs(canvas.noise(2 * blocks, 3, 0.5, stretch=(1.4, 0.7)))
    canvas.height += (rough * (0.7 * relief - 0.7 * (ledges - ledges.mean()) + 0.12 * canvas.noise(0.15, 2))).astype(np.float32)
    beds = np.sin(2 * np.pi * (canvas.s[None, :] * 0.6 + 0.35 * canvas.u[:, None] + 0.4 * canvas.noise(4.0, 3)))
    canvas.base += (level + 0.5 * beds + 0.9 * canvas.noise(1.8, 5, 0.65) + 0.35 * canvas.noise(0.1, 2)).astype(np.float32)


def floor(canvas: Canvas, level: float, patchy: float = 0.6, rough: float = 0.0, reach: float = 0.0) -> None:
    """Floor of one material, from wall to wall or up to a distance from the walls, that replaces what was there."""
    section = canvas.section
    ground = (canvas.s < section.foot_right - reach) | (canvas.s > section.foot_left + reach)
    tone = level + patchy * canvas.noise(2.0, 4) + 0.3 * canvas.noise(0.08, 1)
    canvas.base[:, ground] = tone[:, ground]
    canvas.sheen[:, ground] = 0.0
    canvas.height[:, ground] = (rough * canvas.noise(0.25, 3))[:, ground]
