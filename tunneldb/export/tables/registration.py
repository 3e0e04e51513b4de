"""Table and report of a registration of sonar scans, as Markdown."""

from __future__ import annotations

import numpy as np

from tunneldb.registration.underwater import Alternative, Registration, SonarPose

HEADER = ("scan", "state", "x", "y", "z", "sigma mm", "turn °", "scale", "badly known")

ALTERNATIVES_HEADER = ("scan", "choice", "probability", "x", "y", "z", "azimuth", "row for --start")

_DEGREES = 180.0 / np.pi
_CHOOSE = (
    "Choose one of each scan, by what is known of the place or by the pictures of `--pictures`. Write its row below a header"
    " `file,x,y,within,azimuth` into a file, and register again with `--start` and that file."
)
_WITHIN = 0.5  # m; alternatives are farther apart


def scan_rows(found: Registration) -> list[tuple[str, ...]]:
    """Return the cells of the table of scans, for `HEADER`: sigma of x, y and z, turn its largest about an axis."""
    return [_row(scan) for scan in found.scans]


def _row(scan: SonarPose) -> tuple[str, ...]:
    named = ", ".join(scan.undetermined)
    if not np.isfinite(scan.scale):
        return (scan.path.name, scan.state, "", "", "", "", "", "", named)
    sigma = np.sqrt(np.diag(scan.covariance))
    return (
        scan.path.name,
        scan.state,
        *(f"{value:.3f}" for value in scan.translation),
        " ".join(f"{1e3 * value:.0f}" for value in sigma[3:6]),
        f"{_DEGREES * sigma[:3].max():.3f}",
        f"{scan.scale:.5f} ± {sigma[6]:.5f}",
        named,
    )


def alternative_rows(found: Registration) -> list[tuple[str, ...]]:
    """Return the cells of the table of possible poses, for `ALTERNATIVES_HEADER`; none if all scans have a pose."""
    rows: list[tuple[str, ...]] = []
    for scan in found.scans:
        for k, one in enumerate(scan.alternatives, start=1):
            azimuth = azimuth_of(one)
            x, y, z = one.translation
            row = f"{scan.path.name},{x:.1f},{y:.1f},{_WITHIN:g},{azimuth:.0f}"
            place = (f"{x:.2f}", f"{y:.2f}", f"{z:.2f}", f"{azimuth:.0f}°")
            rows.append((scan.path.name, str(k), f"{100.0 * one.probability:.0f} %", *place, row))
    return rows


def azimuth_of(pose: Alternative) -> float:
    """Return the direction of the file's x axis in plan, degrees clockwise from north."""
    east, north = pose.rotation[0, 0], pose.rotation[1, 0]
    return float(_DEGREES * np.arctan2(east, north)) % 360.0


def as_report(survey: str, found: Registration) -> str:
    """Report of a registration."""
    parts = [
        f"# Sonar scans of {survey}",
        f"Water at {found.water_level:.3f} m. A point of a file lies in the tunnel at"
        " rotation · (scale · point) + translation.",
        _table(HEADER, scan_rows(found)),
        "## Ladders, as the laser sees them",
    ]
    if found.ladders:
        rows: list[tuple[str, ...]] = [
            (one.name, f"{1e3 * one.rms:.1f}", ", ".join(map(str, one.rungs)), ", ".join(one.scans) or "none")
            for one in found.ladders
        ]
        parts.append(_table(("ladder", "rms mm", "rungs above the water", "seen by"), rows))
    else:
        parts.append("None was found before the walls.")
    choices = alternative_rows(found)
    if choices:
        parts += ["## Possible poses of scans without a pose", _CHOOSE, _table(ALTERNATIVES_HEADER, choices)]
    parts += ["## What is left between scans and what they were fitted to", _table(*_residuals(found))]
    parts += [f"- {note}" for note in found.notes]
    return "\n\n".join(parts) + "\n"


def _residuals(found: Registration) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    rows: list[tuple[str, ...]] = [
        (scan.path.name, one.kind, one.name, str(one.count), f"{1e3 * one.median:.1f}", f"{1e3 * one.p95:.1f}")
        for scan in found.scans
        for one in scan.residuals
    ]
    return ("scan", "to", "which", "compared", "median mm", "95 % mm"), rows


def _table(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [header, ("---",) * len(header), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
