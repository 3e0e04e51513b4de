"""Picture of an axis that was found: in plan and in profile, over the points."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tunneldb.alignment.found import FoundAxis
from tunneldb.alignment.section_centres import Frames, place_points
from tunneldb.geometry.stationing import chainage_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS, _LINE, _DOUBT = "#7f8c8d", "#c0392b", "#f1c40f"
_MAX_POINTS = 400_000  # points that are drawn


def write_found(found: FoundAxis, path: Path, start: float, title: str) -> None:
    """Write the picture, .png.

    Parameters
    ----------
    start
        Chainage of the first vertex, m.
    title
        Points it was found in.
    """
    from matplotlib.figure import Figure

    extent = np.ptp(found.xyz[:, :2], axis=0)
    figure = Figure(figsize=(14, 5.0 + min(max(12.0 * extent[1] / max(extent[0], 1.0), 4.0), 10.0)), layout="constrained")
    plan, profile = figure.subplots(2, 1, height_ratios=[2.5, 1])
    points = found.points[:: max(1, len(found.points) // _MAX_POINTS)]
    _draw_plan(plan, found, points, start)
    _draw_profile(profile, found, points, start)
    figure.suptitle(f"{title}: chainage grows with the arrow; yellow: look there", fontsize=11)
    figure.savefig(path, dpi=110)


def _draw_plan(axes: Axes, found: FoundAxis, points: np.ndarray, start: float) -> None:
    corner = np.floor(found.xyz[:, :2].min(axis=0) / 100.0) * 100.0
    x, y = (found.xyz[:, :2] - corner).T
    axes.plot(*(points[:, :2] - corner).T, ".", ms=1.5, mew=0, color=_POINTS, rasterized=True)
    axes.plot(x, y, color=_LINE, lw=1.5)
    chainage = _chainages(found) + start
    for low, high in found.doubtful:
        bad = (chainage >= start + low - 1e-6) & (chainage <= start + high + 1e-6)
        axes.plot(x[bad], y[bad], color=_DOUBT, lw=5, alpha=0.7, zorder=1)
    for at in _ticks(chainage):
        place = np.interp(at, chainage, x), np.interp(at, chainage, y)
        axes.plot(*place, "o", ms=4, color=_LINE)
        axes.annotate(chainage_label(at, 0), place, xytext=(5, 5), textcoords="offset points", fontsize=9, color=_LINE)
    last = max(len(x) - 2, 0)
    axes.annotate(
        "", (x[-1], y[-1]), xytext=(x[last], y[last]), arrowprops={"arrowstyle": "-|>", "color": _LINE, "mutation_scale": 25}
    )
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x - {corner[0]:.0f}, m")
    axes.set_ylabel(f"y - {corner[1]:.0f}, m")


def _draw_profile(axes: Axes, found: FoundAxis, points: np.ndarray, start: float) -> None:
    """Draw heights over the chainage, only of points near the line in plan: floor and vault."""
    chainage = _chainages(found)
    placed = place_points(points, Frames.along(found.xyz), 3.0 * max(found.width, found.height))
    near = (placed.station >= 0) & (np.abs(placed.right) < found.width / 8.0)
    at = chainage[placed.station[near]] + placed.along[near] + start
    axes.plot(at, points[near, 2], ".", ms=2.5, mew=0, color=_POINTS, rasterized=True)
    axes.plot(chainage + start, found.xyz[:, 2], color=_LINE, lw=1.5)
    axes.xaxis.set_major_formatter(lambda value, _: chainage_label(value, 0))
    axes.set_xlabel("chainage")
    axes.set_ylabel("height along the middle, m")
    axes.grid(alpha=0.3)


def _chainages(found: FoundAxis) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(found.xyz[:, :2], axis=0).T))])


def _ticks(chainage: np.ndarray) -> list[float]:
    """Round chainages, about ten of them, and the first one."""
    from matplotlib.ticker import MaxNLocator

    low, high = float(chainage[0]), float(chainage[-1])
    inside = [
        at for at in np.asarray(MaxNLocator(10, steps=[1, 2, 5, 10]).tick_values(low, high)).tolist() if low <= at <= high
    ]
    return inside if inside and inside[0] - low < 1e-6 else [low, *inside[1:]]
