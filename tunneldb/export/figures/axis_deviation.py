"""Figure and table of the deviation of the measured axis from the given one."""

from __future__ import annotations

import csv
import warnings
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tunneldb.alignment.deviation import Deviation
from tunneldb.errors import UserError
from tunneldb.files import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FIGURES = (".png", ".pdf", ".svg")
HEADER = ("chainage", "label", "source", "to_right", "up", "x", "y", "z")
_LINE, _EDITED, _CURVE, _CLOTHOID = "#2166ac", "#d95f02", "#bcbddc", "#dadaeb"
_COLOUR = {"arc": _CURVE, "clothoid": _CLOTHOID, "parabola": _CURVE, "circle": _CURVE}
_MILLI = 1000.0


def check_format(path: Path) -> None:
    """Raise UserError for an extension that is no format of figures or tables."""
    if path.suffix.lower() not in (*FIGURES, ".csv"):
        raise UserError(f"{path}: write the deviation as {', '.join(FIGURES)} (a figure) or .csv (a table)")


def write_deviation(deviation: Deviation, path: Path) -> None:
    """Write the deviation in the format of the file's extension: a figure, or a table of all vertices.

    The file appears when complete. Raises UserError if its extension is no known format or it cannot be written.
    """
    check_format(path)
    with replacing(path) as temporary:
        if path.suffix.lower() == ".csv":
            _write_table(deviation, temporary)
        else:
            _write_figure(deviation, temporary)


def _write_table(deviation: Deviation, path: Path) -> None:
    rows = zip(
        deviation.chainage, deviation.label, deviation.source, deviation.to_right, deviation.up, deviation.vertices, strict=True
    )
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(HEADER)
        for chainage, label, source, right, up, vertex in rows:
            numbers = (f"{value:.4f}" for value in (right, up, *vertex))
            table.writerow([f"{chainage:.3f}", label, source, *numbers])


def _write_figure(deviation: Deviation, path: Path) -> None:
    from matplotlib.figure import Figure

    plan, profile = deviation.parts("horizontal"), deviation.parts("vertical")
    heights = [2.2, 2.2] if not plan else [0.9, 2.2, 2.2, 0.9]
    figure = Figure(figsize=(14, 6.5 if not plan else 9.0), layout="constrained")
    panels = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    if plan:
        _curvature(panels[0], deviation)
        _grade(panels[-1], deviation)
    right, up = (panels[1], panels[2]) if plan else (panels[0], panels[1])
    _course(right, deviation, deviation.to_right, "to the right, mm")
    _course(up, deviation, deviation.up, "upwards, mm")
    right.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8, frameon=False)
    for axes, parts in ((right, plan), (up, profile)):
        for part in parts:
            if part.kind in _COLOUR:
                axes.axvspan(part.chainage_from, part.chainage_to, color=_COLOUR[part.kind], alpha=0.5, lw=0)
    _stations(panels, deviation)
    whole = deviation.summaries()[-1]
    figures = (
        f"right {_text(whole.right_mean)} on average, at most {_text(whole.right_most)}; "
        f"up {_text(whole.up_mean)} on average, at most {_text(whole.up_most)}"
    )
    figure.suptitle(
        f"{deviation.survey}: measured axis minus {deviation.design or 'the axis given'}\n"
        f"{whole.vertices} vertices measured{'; ' + figures if whole.vertices else ''}",
        fontsize=11,
    )
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # of a name in letters that the font lacks
        figure.savefig(path, dpi=110)


def _stations(panels: Sequence[Axes], deviation: Deviation) -> None:
    """Draw ticks at round stations, and a line where the stationing jumps or reverses."""
    from matplotlib.ticker import FixedLocator, MaxNLocator

    low, high = float(deviation.chainage[0]), float(deviation.chainage[-1])
    if low == high:
        low, high = low - 1.0, high + 1.0
    step = float(np.diff(MaxNLocator(10, steps=[1, 2, 5, 10]).tick_values(low, high))[0])
    jumps = [piece for piece in deviation.stationing.equations if low < piece.chainage < high]
    ends = [low, *(piece.chainage for piece in jumps), high]
    ticks: list[float] = []
    for begin, end in pairwise(ends):
        first, last = deviation.stationing.station(begin), deviation.stationing.station(np.nextafter(end, begin))
        direction = 1.0 if last >= first else -1.0
        whole = np.arange(np.ceil(min(first, last) / step), np.floor(max(first, last) / step) + 1) * step
        ticks += (begin + direction * (whole - first)).tolist()
    for axes in panels:
        for jump in jumps:
            axes.axvline(jump.chainage, color="black", ls=":", lw=1.0)
    below = panels[-1]
    below.set_xlim(low, high)
    below.xaxis.set_major_locator(FixedLocator(ticks))
    below.xaxis.set_major_formatter(lambda chainage, _: deviation.stationing.label(chainage, 0))
    below.set_xlabel("station (dotted: where it jumps)" if jumps else "station")


def _course(axes: Axes, deviation: Deviation, values: np.ndarray, what: str) -> None:
    """Draw a deviation over the chainage, with measured, interpolated and manual vertices distinguished."""
    source = np.array(deviation.source)
    axes.axhline(0.0, color="black", lw=0.8)
    axes.plot(deviation.chainage, _MILLI * values, color=_LINE, lw=1.0)
    size = 12 if len(values) <= 300 else 3
    for kind, face, edge in (("measured", _LINE, _LINE), ("interpolated", "white", "grey"), ("edited", _EDITED, _EDITED)):
        rows = source == kind
        if rows.any():
            axes.scatter(deviation.chainage[rows], _MILLI * values[rows], s=size, c=face, edgecolors=edge, zorder=3, label=kind)
    axes.set_ylabel(what)
    axes.grid(alpha=0.3)


def _curvature(axes: Axes, deviation: Deviation) -> None:
    """Draw the curvature of the design: left above, right below."""
    for part in deviation.parts("horizontal"):
        sign = -1.0 if part.turn == "right" else 1.0
        ends = [sign * _MILLI / radius if radius else 0.0 for radius in (part.radius_from, part.radius_to)]
        axes.fill_between([part.chainage_from, part.chainage_to], ends, color=_COLOUR.get(part.kind, "none"), lw=0)
        axes.plot([part.chainage_from, part.chainage_to], ends, color="black", lw=1.0)
        if part.kind == "arc":
            middle = (part.chainage_from + part.chainage_to) / 2
            if deviation.chainage[0] < middle < deviation.chainage[-1]:
                axes.text(middle, ends[0] / 2, f"R {part.radius_from:.5g}", ha="center", va="center", fontsize=7)
    axes.set_ylabel("curvature,\n1/km (left +)", fontsize=8)
    axes.grid(alpha=0.3)


def _grade(axes: Axes, deviation: Deviation) -> None:
    """Draw the grade of the design."""
    for part in deviation.parts("vertical"):
        if part.grade_from is not None and part.grade_to is not None:
            axes.plot([part.chainage_from, part.chainage_to], [part.grade_from, part.grade_to], color="black", lw=1.0)
            if part.kind in _COLOUR:
                axes.axvspan(part.chainage_from, part.chainage_to, color=_COLOUR[part.kind], alpha=0.5, lw=0)
    axes.set_ylabel("grade, %", fontsize=8)
    axes.grid(alpha=0.3)


def _text(metres: float) -> str:
    return f"{_MILLI * metres:+.1f} mm"
