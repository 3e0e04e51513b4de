"""Reliability diagram: how often what is stated to be so probable is a leak."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.blind.score import BINS, Reliability

FORMATS = (".svg", ".png", ".pdf")
COLOUR, GREY = "#0072b2", "#7f7f7f"


def draw_reliability(reliability: Reliability, title: str, path: Path) -> None:
    """Draw the classes of probability with Wilson's intervals of 95 %, and beneath them how many regions each holds.

    Parameters
    ----------
    reliability : Reliability
    title : str
        Says of what it is.
    path : Path
        File to write, of one of FORMATS.
    """
    figure = Figure(figsize=(6.0, 7.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(4, 1))
    held = reliability.count > 0
    stated, true = reliability.stated[held], reliability.true[held]
    upper.plot((0, 1), (0, 1), color=GREY, linestyle="--", label="probabilities that are true")
    upper.vlines(stated, reliability.low[held], reliability.high[held], color=COLOUR, label="interval of 95 % (Wilson)")
    upper.plot(stated, true, "o", color=COLOUR, clip_on=False, label="regions of the class")
    upper.set(xlim=(0, 1), ylim=(0, 1), ylabel="share that are leaks", title=title)
    upper.legend(loc="upper left")
    bars = lower.bar(BINS[:-1], reliability.count, np.diff(BINS), align="edge", color=COLOUR, edgecolor="white", log=True)
    lower.bar_label(bars, [str(number) if number else "" for number in reliability.count], fontsize=8)
    lower.set(xlabel="stated probability of a leak", ylabel="regions")
    lower.margins(y=0.3)
    figure.savefig(path, dpi=110)
