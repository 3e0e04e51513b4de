"""Figure of intensity over range and incidence, before and after correction."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from tunneldb.arrays import Float
from tunneldb.errors import UserError
from tunneldb.files import replacing
from tunneldb.radiometry.dependence import ClassMeans
from tunneldb.radiometry.diagnosis import Diagnosis
from tunneldb.radiometry.oren_nayar import incidence_db

if TYPE_CHECKING:
    from matplotlib.axes import Axes


FORMATS = (".png", ".pdf", ".svg")
_LINE, _BAND, _MEASURED = "#b2182b", "#2166ac", "#1b7837"
_TITLE = 140  # characters a line of the title
_SHOWN = (0.002, 0.998)  # shares of the points between whose values an axis runs


def check_format(path: Path) -> None:
    """Raise UserError for an extension that is no format of figures."""
    if path.suffix.lower() not in FORMATS:
        raise UserError(f"{path}: write the figure as {', '.join(FORMATS)}")


def write_figure(look: Diagnosis, path: Path) -> None:
    """Write the figure: raw and corrected intensity over range and incidence, range curve and incidence effect.

    The file appears when complete. Raises UserError if its extension is no known format or it cannot be written.
    """
    from matplotlib.figure import Figure

    check_format(path)
    seen = look.dependence
    figure = Figure(figsize=(15, 8), layout="constrained")
    (raw_range, raw_angle, curve), (range_, angle, loss) = figure.subplots(2, 3)
    _panel(raw_range, look.range_m, look.raw, seen.raw_range, "range, m", "raw intensity, dB")
    _panel(raw_angle, look.angle, look.raw, seen.raw_incidence, "incidence, °", "raw intensity, dB")
    _panel(range_, look.range_m, look.corrected, seen.range, "range, m", "corrected intensity, dB")
    _panel(angle, look.angle, look.corrected, seen.incidence, "incidence, °", "corrected intensity, dB")
    _curves(curve, look)
    _losses(loss, look)
    figure.suptitle("\n".join(fill(line, _TITLE) for line in (look.title, seen.verdict())), fontsize=11)
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=110)


def _panel(axes: Axes, at: Float, level: Float, course: ClassMeans, over: str, what: str) -> None:
    axes.set_xlabel(over)
    axes.set_ylabel(what)
    known = np.isfinite(at) & np.isfinite(level)
    if not known.any():
        axes.text(0.5, 0.5, "could not be corrected", ha="center", va="center", transform=axes.transAxes)
        return
    x, y = np.quantile(at[known], _SHOWN), np.quantile(level[known], _SHOWN)
    y = y + np.array([-0.5, 0.5])
    count, left, low = np.histogram2d(at[known], level[known], bins=120, range=[x, y])
    axes.pcolormesh(left, low, np.sqrt(count.T), cmap="Greys", rasterized=True)
    axes.fill_between(course.at, course.low, course.high, color=_BAND, alpha=0.25, label="quartiles")
    axes.plot(course.at, course.middle, color=_LINE, marker=".", label="median")
    axes.set_xlim(*x)
    axes.set_ylim(*y)
    axes.legend(loc="lower left", fontsize=8)


def _curves(axes: Axes, look: Diagnosis) -> None:
    """Draw range curves, each relative to its mean over their common ranges: they are known except for a constant."""
    axes.set_xlabel("range, m")
    axes.set_ylabel("range curve about its mean, dB")
    if not len(look.range_m):
        return
    low, high = np.quantile(look.range_m, _SHOWN)
    at = np.linspace(low, high, 200)
    for number, found in enumerate(look.found):
        curve = found.curve(at) - found.curve(at).mean()
        sigma = np.interp(at, found.curve.range_m, found.sigma_db)
        axes.fill_between(at, curve - 2 * sigma, curve + 2 * sigma, color=_BAND, alpha=0.25, label=_once(number, "± 2 σ"))
        axes.plot(at, curve, color=_LINE, label=_once(number, "from the surface itself"))
    if look.measured is not None:
        curve = look.measured(at)
        axes.plot(at, curve - curve.mean(), color=_MEASURED, ls="--", label="measured on a target")
    if look.found or look.measured is not None:
        axes.legend(fontsize=8)
    else:
        axes.text(0.5, 0.5, "no range curve", ha="center", va="center", transform=axes.transAxes)


def _losses(axes: Axes, look: Diagnosis) -> None:
    axes.set_xlabel("incidence, °")
    axes.set_ylabel("effect of incidence, dB")
    angle = np.linspace(0.0, 80.0, 161)
    cosine = np.cos(np.radians(angle))
    for number, roughness in enumerate(look.roughness):
        effect = incidence_db(cosine, roughness)
        axes.plot(angle, effect - effect[0], color=_LINE, label=f"roughness {roughness:.1f}°" if number < 5 else None)
    axes.plot(angle, incidence_db(cosine, 0.0), color="grey", ls=":", label="Lambert")
    if len(look.angle):
        axes.axvspan(*np.quantile(look.angle, _SHOWN), color=_BAND, alpha=0.08, label="angles seen")
    axes.legend(fontsize=8)


def _once(number: int, label: str) -> str | None:
    return label if number == 0 else None
