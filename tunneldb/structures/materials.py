"""Faces of two materials in one plane, split where the level steps along a straight line from rim to rim.

Geometry alone cannot separate a brick wall from the concrete beside it, and the paper's histogram of both has two peaks. A
stain or rust does not end on a straight line over the whole of a wide face. A wall of another material does, and so does most
of it beyond a line that rust covers. The step is measured between nearby places, so that neither incidence nor range has an
effect, and over the whole plane: objects in front of a wall divide it into faces, and each shows only a part of the line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from tunneldb.arrays import Bool, Float, Int32, Int64
from tunneldb.radiometry.robust_statistics import robust_statistics
from tunneldb.robust import MAD_TO_SIGMA
from tunneldb.structures.contrast import Observed, curve_of
from tunneldb.structures.face_raster import Layout
from tunneldb.structures.level import SHORTH
from tunneldb.structures.models import to_space, unroll

MIN_SIDE_WIDTH = 0.4
"""Minimum width of both sides of the line, and minimum length of the line, m: on a beam rust may span from rim to rim."""

MIN_STEP_SIGMAS = 1.0
"""Minimum step of the level, in standard deviations of a pixel."""

MIN_STEP_DB = 1.0
"""Minimum step of the level, dB: smaller differences may be unevenness."""

USUAL_STEPS = 4.0
"""Minimum ratio of the step to those across other lines, which are large on an uneven surface."""

EVEN = 0.85
"""Minimum share of the blocks along the line with half to one and a half of the whole step …"""

PARTLY = 1.0 / 3.0
"""… or this share, if most of one whole side differs from most of the other by that much: rust may hide the step."""

MAX_EDGE_SCATTER = 0.5
"""Maximum mean deviation of the step from its line, pixels: a built edge can lie anywhere in a pixel. The edge of damp
that rises over the whole width of a wall varies by many."""

ALONG, ACROSS = 8, 3
"""Pixels of a block along the line and across it."""

BLOCKS = 4
"""Number of blocks to either side whose median counts: near enough for the same incidence."""

MIN_BLOCKS = 6
"""Minimum number of blocks along the line."""

MAX_PLANE_PIXELS = 2_000_000
"""Maximum number of pixels of a plane; beyond it they are made larger."""

LINES_FOR_USUAL_STEP = 12
"""Number of lines that give the usual step: around the right one about four show its step."""

DEPTH = 3
"""Maximum number of splits of a face."""


@dataclass(frozen=True)
class Plane:
    """Faces in one plane, rasterised together.

    Attributes
    ----------
    pixel : float
        Side of a pixel, m.
    place : list of int arrays
        Pixel of the plane for each pixel of each face.
    shape : (int, int)
        Rows and columns.
    """

    pixel: float
    place: list[Int64]
    shape: tuple[int, int]

    @classmethod
    def of(cls, layout: Layout, faces: list[int]) -> Plane:
        """Draw faces, the largest first, in the unrolled coordinates of the first."""
        model = layout.models[faces[0]]
        places = []
        for face in faces:
            u, v = layout.centres(face)
            if face == faces[0]:
                places.append(np.column_stack([np.tile(u, len(v)), np.repeat(v, len(u))]))
                continue
            space = to_space(layout.models[face], np.tile(u, len(v)), np.repeat(v, len(u)))
            places.append(np.column_stack(unroll(model, space)[:2]))
        low = np.min([at.min(axis=0) for at in places], axis=0)
        size = np.max([at.max(axis=0) for at in places], axis=0) - low
        pixel = max(float(np.median(layout.pixel[faces])), float(np.sqrt(size.prod() / MAX_PLANE_PIXELS)))
        columns, rows = (np.floor(size / pixel).astype(np.int64) + 1).tolist()
        cells = [np.floor((at - low) / pixel).astype(np.int64) for at in places]
        return cls(pixel, [at[:, 1] * columns + at[:, 0] for at in cells], (rows, columns))


def parts_of_plane(layout: Layout, faces: list[int], seen: list[list[Observed]]) -> list[Int32] | None:
    """Return the material of each pixel of the faces of a plane, the largest first, from 0; None if there is only one.

    Parameters
    ----------
    layout : Layout
    faces : list of int
    seen : list of list of Observed
        Each of the faces as the scans saw it.
    """
    plane = Plane.of(layout, faces)
    if max(plane.shape) * plane.pixel < 2.0 * MIN_SIDE_WIDTH:
        return None
    images = []
    for scan in sorted({one.scan for by_scan in seen for one in by_scan}):  # by itself: what one saw most of is its level
        here = [one for by_scan in seen for one in by_scan if one.scan == scan]
        curve = curve_of(here, layout.models[faces[0]], by_range=False, one_surface=False)
        total, count = np.zeros(plane.shape).ravel(), np.zeros(plane.shape).ravel()
        for place, by_scan in zip(plane.place, seen, strict=True):
            for one in by_scan:
                if one.scan != scan:
                    continue
                use = np.flatnonzero(curve.known(one.angle))
                rest = one.value[use] - curve(one.angle[use], one.range_m[use])
                at = place[one.pixel[use]]
                total += np.bincount(at, one.points[use] * rest, len(total))
                count += np.bincount(at, one.points[use], len(total))
        images.append(np.where(count > 0.0, total / np.maximum(count, 1.0), np.nan).reshape(plane.shape))
    parts = part_by_material(images, plane.pixel).ravel()
    return [parts[place] for place in plane.place] if parts.any() else None


def part_by_material(images: list[Float], pixel: float) -> Int32:
    """Part a plane.

    Parameters
    ----------
    images : list of (rows, columns) float arrays
        Level as each scan saw it, dB; NaN where it did not.
    pixel : float
        Side of a pixel, m.

    Returns
    -------
    (rows, columns) int32 array
        Number of the part of each pixel, 0 being the first; all 0 where there is but one.
    """
    parts = np.zeros(images[0].shape, np.int32)
    waiting, count = [(0, 0)], 1
    while waiting:
        number, depth = waiting.pop()
        inside = parts == number
        found = _best_line([np.where(inside, image, np.nan) for image in images], pixel) if depth < DEPTH else None
        if found is None:
            continue
        axis, at = found
        beyond = np.zeros(inside.shape, np.bool_)
        np.moveaxis(beyond, axis, 0)[at:] = True
        parts[inside & beyond] = count
        waiting += [(number, depth + 1), (count, depth + 1)]
        count += 1
    return parts


def _best_line(images: list[Float], pixel: float) -> tuple[int, int] | None:
    """Return axis and place of the most significant level step, as all scans see it; None if there is no step."""
    possible: list[tuple[float, int, int, Bool]] = []
    for axis in (0, 1):
        turned = [np.moveaxis(image, axis, 0) for image in images]
        place = np.flatnonzero(np.any([np.isfinite(lines).any(axis=1) for lines in turned], axis=0))
        if len(place) * pixel < 2.0 * MIN_SIDE_WIDTH:
            continue
        first = int(place[0])
        blocks, sigmas = zip(*(_blocks(lines[first : place[-1] + 1]) for lines in turned), strict=True)
        sigma = float(np.median(sigmas))
        edge = max(BLOCKS, int(np.ceil(MIN_SIDE_WIDTH / (ACROSS * pixel))))
        if len(blocks[0]) <= 2 * edge:
            continue
        medians = _medians(np.moveaxis(sliding_window_view(np.array(blocks), BLOCKS, axis=1), -1, 0))
        found = []
        for k in range(edge, len(blocks[0]) - edge):
            steps = medians[:, k] - medians[:, k - BLOCKS]
            length = int(np.isfinite(steps).any(axis=0).sum())
            if length >= MIN_BLOCKS and length * ALONG * pixel >= MIN_SIDE_WIDTH:
                found.append((k, steps, float(np.nanmedian(steps))))
        usual = (
            MAD_TO_SIGMA * float(np.median([abs(step) for _, _, step in found])) if len(found) >= LINES_FOR_USUAL_STEP else 0.0
        )
        least = max(MIN_STEP_SIGMAS * sigma, MIN_STEP_DB, USUAL_STEPS * usual)
        for k, steps, local in found:
            seen = int(np.isfinite(steps).sum())
            if max((steps > 0.5 * least).sum(), (steps < -0.5 * least).sum()) < PARTLY * seen:
                continue
            for step, share in ((local, EVEN), (_apart(blocks, k), PARTLY)):
                there = np.abs(steps - step) < 0.5 * abs(step)
                sure = abs(step) / sigma * float(np.sqrt(there.sum()))
                if abs(step) >= least and there.sum() >= share * seen:
                    possible.append((sure, axis, first + ACROSS * k, there))
    if not possible:
        return None
    _, axis, about, there = max(possible, key=lambda line: line[0])
    turned = [np.moveaxis(image, axis, 0) for image in images]
    clear = np.repeat(there, ALONG, axis=1)[:, : turned[0].shape[1]]
    at, scatter = _sharpest([np.where(here, lines, np.nan) for here, lines in zip(clear, turned, strict=True)], about)
    return (axis, at) if scatter <= MAX_EDGE_SCATTER else None


def _apart(blocks: Sequence[Float], k: int) -> float:
    """Return the difference between most of both sides of a line, dB, the mean of all scans."""
    steps, weights = [0.0], [0.0]
    for scan in blocks:
        sides = [side[np.isfinite(side)] for side in (scan[:k], scan[k:])]
        if min(len(side) for side in sides) >= MIN_BLOCKS:
            before, beyond = (robust_statistics(side, SHORTH, two_sided=True).mean for side in sides)
            steps.append(beyond - before)
            weights.append(float(sum(len(side) for side in sides)))
    return float(np.dot(steps, weights)) / max(sum(weights), 1.0)


def _blocks(lines: Float) -> tuple[Float, float]:
    """Return medians of blocks (across, along) and the standard deviation of a pixel about them, dB."""
    rows, columns = -(-lines.shape[0] // ACROSS), -(-lines.shape[1] // ALONG)
    padded = np.full((rows * ACROSS, columns * ALONG), np.nan)
    padded[: lines.shape[0], : lines.shape[1]] = lines
    cells = padded.reshape(rows, ACROSS, columns, ALONG).transpose(0, 2, 1, 3).reshape(rows, columns, -1)
    known = np.isfinite(cells).sum(axis=2)
    medians = np.where(known >= ACROSS * ALONG // 3, _nan_median(np.moveaxis(cells, 2, 0)), np.nan)
    full = np.isfinite(medians)
    if not full.any():
        return medians, np.inf
    off = np.abs(cells[full] - medians[full][:, None])
    sigma = MAD_TO_SIGMA * float(np.median(off[np.isfinite(off)]))
    return medians, max(sigma, 0.05)


def _medians(blocks: Float) -> Float:
    """Return the median over the first axis; NaN if less than half of the blocks are known."""
    return np.where(np.isfinite(blocks).sum(axis=0) * 2 >= len(blocks), _nan_median(blocks), np.nan)


def _nan_median(values: Float) -> Float:
    """Return the median of known values over the first axis; NaN if none is. NumPy's own takes many times as long."""
    ordered = np.sort(values, axis=0)
    count = np.isfinite(ordered).sum(axis=0)
    low, high = np.maximum(count - 1, 0) // 2, np.minimum(count // 2, len(ordered) - 1)
    both = [np.take_along_axis(ordered, at[None], axis=0)[0] for at in (low, high)]
    return np.asarray(0.5 * (both[0] + both[1]))


def _sharpest(images: list[Float], about: int) -> tuple[int, float]:
    """Return the first line behind a step near a place, and the scatter of the step about it, pixels.

    Most pixels before the line are below the middle of the step, most behind it above. All scans vote: where something hides
    the step from one, another sees it. NaN is where none is seen. The scatter is that of the lines found so block by block.
    """
    reach = (BLOCKS + 1) * ACROSS
    first = max(about - 2 * reach, 0)
    size, width = images[0][first : about + 2 * reach].shape
    votes = np.zeros((size, -(-width // ALONG)))
    starts = np.arange(0, width, ALONG)
    for image in images:
        near = image[first : about + 2 * reach]
        known = np.isfinite(near)
        before, after = near[: about - first][known[: about - first]], near[about - first :][known[about - first :]]
        if len(before) and len(after):
            low, high = float(np.median(before)), float(np.median(after))
            sides = np.where(known, np.sign((near - 0.5 * (low + high)) * (high - low)), 0.0)
            votes += np.add.reduceat(sides, starts, axis=1)
    inner = slice(max(about - reach - first, 1), about + reach - first)
    at = _step_of(votes.sum(axis=1, keepdims=True), inner)[0]
    seen = (votes != 0.0).sum(axis=0) >= 2 * ACROSS
    off = np.abs(_step_of(votes[:, seen], inner) - at)
    nearer = np.sort(off)[: max(3 * len(off) // 4, 1)]  # rust along the line hides the rest
    return first + int(at), float(nearer.mean()) if len(off) else np.inf


def _step_of(votes: Float, inner: slice) -> Int64:
    """Return the first line behind the step in each column of votes (lines, n)."""
    score = votes.sum(axis=0) - 2.0 * np.vstack([np.zeros(votes.shape[1]), np.cumsum(votes, axis=0)])
    return np.asarray(inner.start + np.argmax(score[inner], axis=0))
