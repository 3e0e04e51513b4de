"""Galleries: tunnels with one side open, on columns, or with windows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.any_scan import files
from benchmarks.any_scan.judge import Plan, Scene
from benchmarks.any_scan.scan import Leak, static
from benchmarks.any_scan.scenes import plan
from benchmarks.any_scan.tube import Array, Tube, horseshoe, rectangle

LENGTH = 48.0
LEAKS = (Leak(10.0, -1.0, 1.2, 1.0, 5.0), Leak(25.0, -5.5, 1.2, 1.0, 5.0), Leak(40.0, 1.0, 1.0, 1.0, 6.0))
"""On roof and left wall; the right side is open."""


def gallery(tube: Tube, open_side: Callable[[Array, Array], np.ndarray], found_axis: bool) -> Callable[[Path], Plan]:
    """Make a scan without the right wall where `open_side` of s and w is true."""

    def build(folder: Path) -> Plan:
        cloud = static(tube, leaks=LEAKS)
        s, u, w = tube.unplace(cloud.xyz)
        wall = (u > 3.5) & (w > tube.section.floor + 0.1) & (w < tube.section.outline[:, 1].max() - 0.1)
        cloud = replace(cloud.take(~(wall & open_side(s, w))), leaks=LEAKS)
        out = plan(folder, cloud)
        if found_axis:
            out.tunnel = ["--srid", files.SRID, "--axis", "auto", "scan.laz"]
        return out

    return build


BOX, ARCH = Tube(rectangle(), LENGTH, grade=0.03), Tube(horseshoe(), LENGTH, radius=150.0)


def whole(s: Array, w: Array) -> np.ndarray:
    return np.full(len(s), True)


def columns(s: Array, w: Array) -> np.ndarray:
    return np.mod(s, 5.0) > 0.6


def windows(s: Array, w: Array) -> np.ndarray:
    return (np.mod(s, 5.0) > 1.5) & (np.abs(w) < 1.5)


GALLERIES: tuple[Scene, ...] = (
    Scene("open-side", "right side open, rectangular section", "result", gallery(BOX, whole, False)),
    Scene("open-side-arch", "right side open, horseshoe section, curve of 150 m", "result", gallery(ARCH, whole, False)),
    # A section with one wall has no centre; the user has to give a line.
    Scene(
        "auto-open-side", "axis to be found, right side open", "refusal", gallery(BOX, whole, True), r"open.*--axis axis\.csv"
    ),
    Scene("auto-columns", "axis found, right side on columns 5 m apart", "result", gallery(ARCH, columns, True)),
    Scene("auto-windows", "axis found, windows 3.5 m wide on the right", "result", gallery(BOX, windows, True)),
)
