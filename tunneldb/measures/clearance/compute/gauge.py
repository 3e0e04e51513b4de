"""Clearance outline in the frame of a track, widened in curves and by cant and speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tunneldb.arrays import Float
from tunneldb.shape.outline import TOLERANCE, Outline

GRAVITY = 9.80665
"""Standard gravity, m/s²."""


@dataclass(frozen=True)
class Widening:
    """Widening of an outline. All values are parameters: none is taken from a standard.

    Attributes
    ----------
    bogie_distance, overhang : float
        Vehicle's distance between bogie centres, and from there to its end, m.
    inside, outside : float
        Widening times radius, m², if the vehicle is not given.
    speed : float
        m/s; without it there is no roll.
    flexibility : float
        Roll angle of the vehicle on its springs, divided by the deviation of the track's plane from equilibrium.
    roll_height : float
        Height of the roll centre above the running surface, m.
    allowance : float
        Allowance for everything else, dynamic terms included, m to each side.
    """

    bogie_distance: float = 0.0
    overhang: float = 0.0
    inside: float = 0.0
    outside: float = 0.0
    speed: float = 0.0
    flexibility: float = 0.0
    roll_height: float = 0.5
    allowance: float = 0.0


@dataclass(frozen=True)
class Terms:
    """Terms of a section's widening, (n,) arrays, m; ``roll`` is an angle, rad, positive to the right."""

    inward: Float
    outward: Float
    deficiency: Float
    roll: Float


def overthrow(bogie_distance: float, overhang: float, curvature: Float) -> tuple[Float, Float]:
    """Return the overthrow of a vehicle's middle inside the track's axis, and of its ends outside, (n,), m.

    The bogie centres are on a circle of radius R: their chord is h = √(R² − a²/4) from its centre. So the vehicle's middle
    is R − h inside, and a point at x from it √(h² + x²) − R outside. This is geometry only; bogies are treated as points.
    """
    half = bogie_distance / 2.0
    bend = np.abs(curvature)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = np.where(bend > 1e-9, 1.0 / bend, np.inf)
        # Written without differences of nearly equal numbers.
        chord = np.sqrt(np.maximum(radius**2 - half**2, 0.0))
        inward = np.where(bend > 1e-9, half**2 / (radius + chord), 0.0)
        end = (half + overhang) ** 2 - half**2
        outward = np.where(bend > 1e-9, end / (radius + np.sqrt(radius**2 + end)), 0.0)
    return np.nan_to_num(inward), np.nan_to_num(outward)


def terms(widening: Widening, curvature: Float, cant: Float, spacing: float) -> Terms:
    """Compute the terms of the widening at sections.

    Parameters
    ----------
    widening : Widening
    curvature : (n,) float array
        1/m, positive to the right.
    cant : (n,) float array
        Height of the left head above the right one, m.
    spacing : float
        Distance of the heads' middles, m.

    Notes
    -----
    At speed v in a curve of radius R the track's plane would be in equilibrium at a cant of b v² / (g R), b being the heads'
    distance. The missing cant is the deficiency; the vehicle rolls by ``flexibility`` times that divided by b.
    """
    inward, outward = overthrow(widening.bogie_distance, widening.overhang, curvature)
    bend = np.abs(curvature)
    inward, outward = inward + widening.inside * bend, outward + widening.outside * bend
    # In a right-hand curve the left head must be higher.
    deficiency = spacing * widening.speed**2 / GRAVITY * curvature - cant if widening.speed > 0.0 else np.zeros(len(bend))
    # Cant deficiency rolls the vehicle outwards: to the left in a curve to the right.
    return Terms(inward, outward, deficiency, -widening.flexibility * deficiency / spacing)


def widened(outline: Outline, left: float, right: float, roll: float = 0.0, about: float = 0.0) -> Outline:
    """Widen an outline: shift its left part to the left and its right part to the right, m, and then roll it.

    Roll shifts each vertex sideways by the angle times its height above ``about``, towards the side of the roll, and only on
    that side. The outline must come from `halved`.
    """
    elements = outline.elements
    moved = elements.copy()
    middle = (elements[:, 0] + elements[:, 2]) / 2.0
    bulged = middle + 0.5 * elements[:, 4] * (elements[:, 3] - elements[:, 1])
    to_right = bulged > 0.0
    for x, y in ((0, 1), (2, 3)):
        lean = roll * (elements[:, y] - about)
        moved[:, x] += np.where(to_right, right + np.maximum(lean, 0.0), -left + np.minimum(lean, 0.0))
    parts = []
    for k, element in enumerate(moved):
        parts.append(element)
        after = moved[(k + 1) % len(moved)]
        if np.hypot(*(after[:2] - element[2:4])) > TOLERANCE:
            parts.append(np.array([*element[2:4], *after[:2], 0.0]))
    return Outline(np.array(parts))


def halved(outline: Outline) -> Outline:
    """Cut the elements that cross the track's middle there."""
    line_ends = np.concatenate([[0.0], np.cumsum(outline.lengths)]) / outline.length
    dense = np.unique(np.concatenate([np.linspace(0.0, 1.0, 4001), line_ends]))
    x = outline.places(dense)[0][:, 0]
    shares = []
    for k in np.flatnonzero(np.sign(x[:-1]) * np.sign(x[1:]) < 0):
        low, high = dense[k], dense[k + 1]
        for _ in range(50):
            share = (low + high) / 2.0
            same = np.sign(outline.places(np.array([share]))[0][0, 0]) == np.sign(x[k])
            low, high = (share, high) if same else (low, share)
        shares.append((low + high) / 2.0)
    return outline.cut(np.array(shares)) if shares else outline


def closed(outline: Outline) -> Outline:
    """Close an outline by a straight line between its ends, if it is open."""
    if outline.closed:
        return outline
    elements = outline.elements
    return Outline(np.vstack([elements, [*elements[-1, 2:4], *elements[0, :2], 0.0]]))
