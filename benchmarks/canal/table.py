"""The figures of all seeds as tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.canal.judge import RUNG


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown table of figures beside their targets."""
    scans = [scan for row in rows for scan in row["scans"]]
    known = [scan for scan in scans if "shift" in scan]
    wrong = [scan for scan in known if np.linalg.norm(scan["shift"]) > RUNG / 2 or np.linalg.norm(scan["turn"]) > 0.1]
    right = [scan for scan in known if scan not in wrong]
    ladders = [one for row in rows for one in row["ladders"]]
    height = 1e3 * np.array([one["off"][1] for one in ladders if one["off"]])
    lines = [
        ("ladders found by the laser", f"{len(height)} of {len(ladders)}", ""),
        *([("ladder height with known gaps, rms, worst", f"{_rms(height):.1f}, {np.abs(height).max():.1f} mm", "4 mm")]
          if len(height) else []),
        ("scans determined; weak; undetermined", f"{_states(scans)} of {len(scans)}", ""),
        ("rung, place or half turn wrong", f"{len(wrong)} of {len(known)}", "0"),
        *(_poses(right) if right else []),
        *(_points(rows, right) if right else []),
    ]  # fmt: skip
    head = [f"| {len(rows)} seeds | figure | target |", "|---|---|---|"]
    return "\n".join([*head, *(f"| {name} | {value} | {target} |" for name, value, target in lines)])


def _poses(right: list[dict[str, Any]]) -> list[tuple[str, str, str]]:
    check = np.concatenate([scan["check"] for scan in right]) * 1e3
    turn = np.degrees([np.linalg.norm(scan["turn"]) for scan in right])
    scale = 100.0 * np.abs([scan["scale"] for scan in right])
    z = np.array([[*scan["turn"], *scan["shift"], scan["scale"]] for scan in right]) / [scan["sigma"] for scan in right]
    return [
        ("check points within 10 m, median, p95", f"{np.median(check):.1f}, {np.quantile(check, 0.95):.1f} mm", "10, 25 mm"),
        ("rotation, median, p95", f"{np.median(turn):.3f}°, {np.quantile(turn, 0.95):.3f}°", "0.05°"),
        ("range scale, median, p95", f"{np.median(scale):.3f} %, {np.quantile(scale, 0.95):.3f} %", "0.1 %"),
        ("stated 95 % interval holds, parameters", f"{100 * (np.abs(z) < 1.96).mean():.1f} %", "92–98 %"),
        ("the same of check points' coordinates", f"{100 * np.mean([s['inside'] for s in right]):.1f} %", "92–98 %"),
        ("rms of error over σ: turns; shifts; scale", f"{_each(z)}", "1"),
    ]


def _points(rows: list[dict[str, Any]], right: list[dict[str, Any]]) -> list[tuple[str, str, str]]:
    surfaces = [row["surfaces"] for row in rows if row.get("surfaces")]
    seen, bed, wall = (1e3 * np.concatenate([one[kind] for one in surfaces]) for kind in ("seen", "bed", "wall"))
    volume = np.array([one["volume"] for one in surfaces])
    off = 100.0 * np.abs(volume[:, 0] / volume[:, 1] - 1.0)
    total = {name: sum(scan[name] for scan in right) for name in ("phantoms", "removed", "good", "lost")}
    timed = [row for row in rows if "seconds" in row]
    seconds, points = (np.median([row[name] for row in timed]) for name in ("seconds", "points"))
    return [
        ("phantoms removed", f"{100 * total['removed'] / total['phantoms']:.2f} %", "98 %"),
        ("good points lost", f"{100 * total['lost'] / total['good']:.2f} %", "1 %"),
        ("bed in cells of 1 m × 0.1 m, where it was seen, p95", f"{np.quantile(seen, 0.95):.1f} mm", "20 mm"),
        ("the same against the mean of the whole cell, p95", f"{np.quantile(bed, 0.95):.1f} mm", ""),
        ("submerged wall, cells of 0.1 m, p95", f"{np.quantile(wall, 0.95):.1f} mm", "25 mm"),
        (
            "volume of a scene over 0.5 m below the bed, median, p95",
            f"{np.median(off):.2f}, {np.quantile(off, 0.95):.2f} %",
            "2 %",
        ),
        ("registered in, median, of points", f"{seconds:.1f} s, {points:.0f}", "10 s, 3 M"),
        ("most memory, the simulation's included", f"{max(row['gigabytes'] for row in timed):.1f} GB", "1.5 GB"),
    ]


def _states(scans: list[dict[str, Any]]) -> str:
    return "; ".join(str(sum(scan["state"] == state for scan in scans)) for state in ("determined", "weak", "undetermined"))


def _rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _each(z: Any) -> str:
    groups = (z[:, :3], z[:, 3:6], z[:, 6])
    return "; ".join(f"{_rms(part):.2f}" for part in groups)


def peers_table(rows: list[dict[str, Any]]) -> str:
    """Markdown table of pose errors of each method on the same scans."""
    names = list(dict.fromkeys(name for row in rows for scan in row.get("peers", []) for name in scan))
    lines = ["| method | scans | check points, median, p95 mm | rotation, median, p95 ° | s a scan |", "|---|---|---|---|---|"]
    for name in names:
        mine = [scan[name] for row in rows for scan in row.get("peers", []) if name in scan]
        done = [one for one in mine if "check" in one]
        if not done:
            lines.append(f"| {name} | 0 of {len(mine)} | | | |")
            continue
        check = 1e3 * np.concatenate([one["check"] for one in done])
        turn = np.degrees([np.linalg.norm(one["turn"]) for one in done])
        seconds = np.median([one["seconds"] for one in done])
        lines.append(
            f"| {name} | {len(done)} of {len(mine)} | {np.median(check):.1f}, {np.quantile(check, 0.95):.1f} |"
            f" {np.median(turn):.3f}, {np.quantile(turn, 0.95):.3f} | {seconds:.1f} |"
        )
    gaps = 1e3 * np.abs([error for row in rows for error in row.get("gaps", [])])
    if len(gaps):
        lines.append(
            f"\nRung gaps by the paper's appendix B, {len(gaps)}: mean {gaps.mean():.0f}, median {np.median(gaps):.0f},"
            f" greatest {gaps.max():.0f} mm (its Table 2: 10, 5, 28)"
        )
    return "\n".join(lines)
