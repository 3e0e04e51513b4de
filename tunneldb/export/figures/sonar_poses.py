"""Pictures of the poses of sonar scans: the walls that each shows, over the walls that the laser sees."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tunneldb.arrays import Float
from tunneldb.export.tables.registration import azimuth_of
from tunneldb.registration.underwater import Alternative, Registration, SonarPose

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LASER, _SONAR, _STATION = "#7f8c8d", "#2471a3", "#c0392b"
_AROUND = 14.0  # m around the sonar
_COLUMNS = 3


def write_pictures(found: Registration, folder: Path) -> list[Path]:
    """Write a picture of each scan into a folder: of its pose, or of its possible poses with their numbers, .png.

    Scans with neither are left out.
    """
    written = []
    for scan in found.scans:
        shown = _shown(scan)
        if shown:
            path = folder / f"{scan.path.stem}.png"
            _write(scan, shown, found.plan, path)
            written.append(path)
    return written


def _shown(scan: SonarPose) -> list[tuple[str, Alternative]]:
    """Return titles and poses."""
    if np.isfinite(scan.scale):
        pose = Alternative(scan.rotation, scan.translation, scan.scale, 1.0)
        return [(f"{scan.state}, azimuth {azimuth_of(pose):.0f}°", pose)]
    return [
        (f"choice {k}: {100.0 * one.probability:.0f} %, azimuth {azimuth_of(one):.0f}°", one)
        for k, one in enumerate(scan.alternatives, start=1)
    ]


def _write(scan: SonarPose, shown: list[tuple[str, Alternative]], plan: Float, path: Path) -> None:
    from matplotlib.figure import Figure

    columns = min(len(shown), _COLUMNS)
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(5.0 * columns, 5.0 * rows + 0.6), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for one in axes[len(shown) :]:
        one.set_visible(False)
    for one, (title, pose) in zip(axes, shown, strict=False):
        _draw(one, scan.walls, pose, plan, title)
    figure.suptitle(f"{scan.path.name}: its walls (blue) over those of the laser (grey); north is up", fontsize=11)
    figure.savefig(path, dpi=110)


def _draw(axes: Axes, walls: Float, pose: Alternative, plan: Float, title: str) -> None:
    corner = np.floor(pose.translation[:2])
    near = plan[(np.abs(plan - pose.translation[:2]) < _AROUND).all(axis=1)] - corner
    seen = (pose.scale * walls @ pose.rotation.T + pose.translation)[:, :2] - corner
    axes.plot(*near.T, ".", ms=3.0, mew=0, color=_LASER)
    axes.plot(*seen.T, ".", ms=2.0, mew=0, color=_SONAR)
    x, y = pose.translation[:2] - corner
    axes.plot(x, y, "o", ms=6, color=_STATION)
    axes.annotate(
        "", (x + 2.0 * pose.rotation[0, 0], y + 2.0 * pose.rotation[1, 0]), xytext=(x, y),
        arrowprops={"arrowstyle": "-|>", "color": _STATION},
    )  # fmt: skip
    axes.set_aspect("equal")
    axes.set_xlim(x - _AROUND, x + _AROUND)
    axes.set_ylim(y - _AROUND, y + _AROUND)
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(f"x - {corner[0]:.0f}, m")
    axes.set_ylabel(f"y - {corner[1]:.0f}, m")
