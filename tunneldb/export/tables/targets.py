"""Report of target spheres and their differences from control points, as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from tunneldb.counted import counted
from tunneldb.geometry.crs import srid_name
from tunneldb.geometry.stationing import Stationing
from tunneldb.pipeline.target_control import Comparison, mean_centres
from tunneldb.pipeline.targets import Search, TargetObservation
from tunneldb.registration.control import Motion
from tunneldb.store.survey import Survey

_HOW = {
    "place": "by their places",
    "distances": "by their distances among themselves, since they do not lie near each other",
    "ambiguous": "not at all: their distances among themselves agree in more than one way; give more points",
    "none": "not at all: none lies near a sphere, and no three have the distances of three spheres",
}

_DETERMINED = {
    "all": "",
    "line": "The points lie on one line: the rotation about it cannot be determined and is not part of the motion.",
    "shift": "There is one pair only: a rotation cannot be determined; give 3 points that do not lie on one line.",
}

HEADER = ("sphere", "scan", "chainage", "x", "y", "z", "radius mm", "rms mm", "sigma mm", "coverage", "points")


def sphere_rows(rows: Iterable[TargetObservation], stationing: Stationing) -> list[tuple[str, ...]]:
    """Return the cells of the table of spheres, for `HEADER`."""
    return [
        (
            str(row.number),
            str(row.scan),
            "" if row.chainage is None else stationing.label(row.chainage),
            *(f"{value:.4f}" for value in row.sphere.centre),
            f"{1e3 * row.sphere.radius:.1f}",
            f"{1e3 * row.sphere.rms:.1f}",
            f"{1e3 * row.sphere.sigma:.2f}",
            f"{100 * row.sphere.coverage:.0f} %",
            str(row.sphere.points),
        )
        for row in rows
    ]


def report(
    survey: Survey,
    stationing: Stationing,
    found: Search,
    radius: float,
    tolerance: float,
    comparison: Comparison | None,
) -> str:
    """Report of a search; nothing in it has been applied to the survey."""
    spheres = len({row.number for row in found.spheres})
    parts = [
        f"# Target spheres of {survey.name}",
        f"Tunnel {survey.tunnel}, scanned {survey.date}, {srid_name(survey.srid)}. Spheres of {1e3 * radius:g} mm radius"
        f" ± {1e3 * tolerance:g} mm; {counted(found.points, 'point')} read."
        f" {counted(spheres, 'sphere')}, seen {counted(len(found.spheres), 'time')}.",
        "Centres are from a fit with the nominal radius; radius is that of the best sphere of any radius, as a check."
        " sigma is the standard deviation of the centre in space.",
    ]
    if found.spheres:
        parts += ["## Spheres", _table(HEADER, sphere_rows(found.spheres, stationing))]
        parts += _between_scans(found.spheres)
    if comparison is not None:
        parts += _control(comparison)
    if found.refusals:
        parts.append("## Rejected candidates")
        cells = [
            (str(scan), *(f"{value:.2f}" for value in refusal.centre), str(refusal.points), refusal.reason)
            for scan, refusal in found.refusals
        ]
        parts.append(_table(("scan", "x", "y", "z", "points", "reason"), cells))
    return "\n\n".join(parts) + "\n"


def control_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """Return the cells of the table of pairs: sphere, control point, difference in mm, and residual after a best motion."""
    assert comparison.motion is not None
    ours, theirs = comparison.match.pairs.T
    off = comparison.centres[ours] - comparison.control.xyz[theirs]
    left = comparison.motion.apply(comparison.centres[ours]) - comparison.control.xyz[theirs]
    return [
        (
            str(comparison.numbers[ours[k]]),
            comparison.control.names[theirs[k]],
            *(f"{1e3 * value:.1f}" for value in off[k]),
            f"{1e3 * float(np.linalg.norm(off[k])):.1f}",
            f"{1e3 * float(np.linalg.norm(left[k])):.1f}",
        )
        for k in np.argsort(ours, kind="stable")
    ]


CONTROL_HEADER = ("sphere", "control", "dx mm", "dy mm", "dz mm", "length mm", "left mm")


def motion_lines(motion: Motion) -> list[str]:
    """Return lines on the best motion."""
    x, y, z = motion.pivot
    lines = [
        f"Best rigid motion of the spheres onto the control points (not applied), without scale, {motion.freedom} redundant"
        f" coordinates: rms {1e3 * motion.rms_before:.1f} mm before, {1e3 * motion.rms_after:.1f} mm after.",
        "Shift: " + ", ".join(f"{value:+.4f}" for value in motion.shift)
        + f" m, of the centre of gravity ({x:.4f}, {y:.4f}, {z:.4f}), about which is rotated.",
        "Rotation about x, then y, then z: " + ", ".join(f"{value:+.6f}°" for value in motion.angles)
        + (f"; least certain to ± {motion.turn_sigma:.4f}°." if motion.determined == "all" else "."),
    ]  # fmt: skip
    note = _DETERMINED[motion.determined]
    return [*lines, note] if note else lines


def unmatched_lines(comparison: Comparison) -> list[str]:
    """Return lines on the spheres and control points without a partner."""
    ours, theirs = comparison.match.pairs.T
    spheres = [str(number) for k, number in enumerate(comparison.numbers) if k not in ours]
    points = [name for k, name in enumerate(comparison.control.names) if k not in theirs]
    return [
        f"Spheres without a control point: {', '.join(spheres) or 'none'}.",
        f"Control points without a sphere: {', '.join(points) or 'none'}.",
    ]


def how_line(comparison: Comparison) -> str:
    """Return a line on the matching of spheres and control points."""
    count = len(comparison.match.pairs)
    return f"{count} of {len(comparison.control.names)} control points matched {_HOW[comparison.match.how]}."


def _control(comparison: Comparison) -> list[str]:
    parts = ["## Control points", how_line(comparison)]
    if comparison.motion is not None:
        parts.append("d: sphere less control point; left: what remains after the best motion.")
        parts.append(_table(CONTROL_HEADER, control_rows(comparison)))
        parts += motion_lines(comparison.motion)
        matrix = "\n".join("  ".join(f"{value:+.9f}" for value in row) for row in comparison.motion.rotation)
        parts.append(f"```\n{matrix}\n```")
    parts += unmatched_lines(comparison)
    if comparison.scans:
        cells = [
            (str(scan), str(count), f"{1e3 * motion.rms_before:.1f}", f"{1e3 * motion.rms_after:.1f}",
             *(f"{1e3 * value:+.1f}" for value in motion.shift),
             *(f"{value:+.4f}" if motion.determined != "shift" else "" for value in motion.angles), str(motion.freedom))
            for scan, (count, motion) in comparison.scans.items()
        ]  # fmt: skip
        head = ("scan", "pairs", "rms mm", "after mm", "shift x mm", "y", "z", "turn x °", "y", "z", "redundant")
        parts += ["Each scan by itself, with its own best motion:", _table(head, cells)]
    return parts


def _between_scans(rows: list[TargetObservation]) -> list[str]:
    """Return the differences between scans of each sphere: the accuracy of their registration."""
    numbers, centres = mean_centres(rows)
    several = [row for row in rows if sum(other.number == row.number for other in rows) > 1]
    if not several:
        return []
    mean = dict(zip(numbers.tolist(), centres, strict=True))
    off = [row.sphere.centre - mean[row.number] for row in several]
    cells = [
        (str(row.number), str(row.scan), *(f"{1e3 * value:+.1f}" for value in d), f"{1e3 * float(np.linalg.norm(d)):.1f}")
        for row, d in zip(several, off, strict=True)
    ]
    rms = float(np.sqrt((np.array(off) ** 2).sum(axis=1).mean()))
    head = ("sphere", "scan", "dx mm", "dy mm", "dz mm", "length mm")
    text = f"Spheres that several scans saw, against the mean of the scans; rms {1e3 * rms:.1f} mm."
    return ["## Between scans", text, _table(head, cells)]


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)
