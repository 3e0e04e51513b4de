"""Change between two scans of scenes that somebody wrote who has not read the program (benchmarks/change_scenes).

    python -m benchmarks.change_scenes all FOLDER      # make the scenes: 20 s each
    python -m benchmarks.epoch_scenes FOLDER           # both scans of each to leaks, compare, held against the truth: minutes

A movement is found where regions of its sign cover half of its outline. A region is false where it touches no outline within
BESIDE, for outlines are at half height; the crown's lobe of an oval counts neither way, for what moved there depends on what is
taken to stay. A leak has the state of the row that shares most area with it; a change is false where a row that says `new`,
`grown`, `shrunk` or `dry` touches no place of the truth.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import shapely
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.run import SRID, layer
from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from tunneldb.database import connect
from tunneldb.store.survey import get_survey

BESIDE = 0.75  # m
CHANGED = {"new", "grown", "shrunk", "dry"}


@dataclass(frozen=True)
class Rows:
    """Shapes in the unrolled plane of the older survey, and what is said of each."""

    shapes: list[BaseGeometry]
    values: list[dict[str, Any]]


def run(folder: Path, dsn: str) -> None:
    """Bring both scans of a scene to leaks and compare them, by the command line."""
    name = folder.name
    tunneldb("tunnel", "add", name, "--srid", SRID, "--axis", folder / "old" / "axis.csv", dsn=dsn)
    for epoch, day in (("old", "2024-05-04"), ("new", "2026-05-04")):
        files, survey = folder / epoch, f"{name}-{epoch}"
        poses = ("--stations", "stations.csv") if (files / "stations.csv").is_file() else ("--trajectory", "trajectory.csv")
        tunneldb(
            "survey", "add", survey, "--tunnel", name, "--date", day, poses[0], files / poses[1],
            "--reference", files / "reference.csv", "--intensity", "Amplitude", "--intensity-kind", "amplitude", dsn=dsn,
        )  # fmt: skip
        tunneldb("load", survey, files / "scan.laz", "--density", "all", dsn=dsn)
        tunneldb("run", survey, dsn=dsn)
    tunneldb("compare", f"{name}-old", f"{name}-new", dsn=dsn)


def read(conn: psycopg.Connection[Any], name: str, folder: Path) -> tuple[Rows, Rows, Rows, Rows]:
    """True movements, found regions, true leaks, what became of those found."""
    old = get_survey(conn, f"{name}-old")
    moved = Rows(*layer(conn, old, folder / "truth_change.geojson"))
    leaks = Rows(*layer(conn, old, folder / "truth_leaks.geojson"))
    regions = conn.execute(
        "SELECT public.ST_AsBinary(unrolled), change_mean, lod FROM tunnel.change_region WHERE old_survey_id = %s ORDER BY id",
        [old.id],
    ).fetchall()
    became = conn.execute(
        "SELECT public.ST_AsBinary(unrolled), state, area_old, area_new FROM tunnel.leak_change WHERE old_survey_id = %s"
        " ORDER BY id",
        [old.id],
    ).fetchall()
    return (
        moved,
        Rows(_shapes(regions), [{"mean": row[1], "lod": row[2]} for row in regions]),
        leaks,
        Rows(_shapes(became), [{"state": row[1], "area_old": row[2], "area_new": row[3]} for row in became]),
    )


def _shapes(rows: Sequence[Sequence[Any]]) -> list[BaseGeometry]:
    return [shapely.make_valid(shapely.from_wkb(bytes(row[0]))) for row in rows]


def movements(true: Rows, found: Rows) -> dict[str, Any]:
    """Return the detected movements, and detected regions without movement."""
    rows = []
    for shape, said in zip(true.shapes, true.values, strict=True):
        alike = [
            k for k, region in enumerate(found.shapes)
            if region.intersects(shape) and found.values[k]["mean"] * said["mean_m"] > 0.0
        ]  # fmt: skip
        cover = shapely.union_all([found.shapes[k] for k in alike]).intersection(shape).area / shape.area
        weights = np.array([found.shapes[k].intersection(shape).area for k in alike])
        mean = float(np.average([found.values[k]["mean"] for k in alike], weights=weights)) if weights.sum() > 0.0 else None
        crown = said["kind"] == "oval" and said["mean_m"] < 0.0
        rows.append({
            "kind": said["kind"], "area": said["area"], "mean": said["mean_m"], "abs": said["mean_abs_m"], "covered": cover,
            "found_mean": mean, "counts": not crown,
        })  # fmt: skip
    about = shapely.union_all([shape.buffer(BESIDE) for shape in true.shapes])
    false = [k for k, region in enumerate(found.shapes) if not region.intersects(about)]
    return {
        "movements": rows,
        "false": [{"area": found.shapes[k].area, "at": _place(found.shapes[k]), **found.values[k]} for k in false],
    }


def _place(shape: BaseGeometry) -> list[float]:
    return [round(float(v), 2) for v in shape.centroid.coords[0]]


def leaks(true: Rows, found: Rows) -> dict[str, Any]:
    """State of each place as it is true and as it was found; changes that touch no place."""
    rows = []
    for shape, said in zip(true.shapes, true.values, strict=True):
        shared = [one.intersection(shape).area for one in found.shapes]
        best = int(np.argmax(shared)) if shared and max(shared) > 0.0 else None
        value = found.values[best] if best is not None else {"state": "nothing", "area_old": None, "area_new": None}
        rows.append({"true": said["state"], "areas": [said["area_old"], said["area_new"]], "drop": said["drop_db"], **value})
    places = shapely.union_all(true.shapes)
    false = [
        {"at": _place(shape), **value}
        for shape, value in zip(found.shapes, found.values, strict=True)
        if value["state"] in CHANGED and not shape.intersects(places)
    ]
    return {"leaks": rows, "false_changes": false}


def report(figures: dict[str, dict[str, Any]]) -> None:
    """Print what was found, scene by scene, and the sums."""
    said = [
        (name, m["kind"], m["area"], 1e3 * m["mean"], "" if m["found_mean"] is None else f"{1e3 * m['found_mean']:.1f}",
         f"{100 * m['covered']:.0f}" if m["counts"] else f"({100 * m['covered']:.0f})")
        for name, one in figures.items() for m in one["movements"]
    ]  # fmt: skip
    print_table("Movements", ("scene", "what", "m²", "true mm", "found mm", "covered %"), said)
    rows = []
    for name, one in figures.items():
        counted = [m for m in one["movements"] if m["counts"]]
        area, states = one["unchanged"], one["leaks"]
        rows.append((
            name, len(counted), sum(m["covered"] >= 0.5 for m in counted), len(one["false"]),
            sum(f["area"] for f in one["false"]), 1000.0 * len(one["false"]) / area, len(states),
            sum(row["true"] == row["state"] for row in states), len(one["false_changes"]),
        ))  # fmt: skip
    columns = ("scene", "moved", "found", "false", "m²", "false/1000 m²", "leaks", "state right", "false changes")
    print_table("Scenes", columns, rows)
    confusion = Counter((row["true"], row["state"]) for one in figures.values() for row in one["leaks"])
    print_table("Leaks", ("true", "found", "number"), [(*pair, number) for pair, number in sorted(confusion.items())])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where benchmarks.change_scenes wrote the scenes")
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    arguments = parser.parse_args()
    figures = {}
    with scratch_database(arguments.dsn) as dsn:
        for folder in sorted(path.parent for path in arguments.folder.glob("*/truth.json")):
            progress(folder.name)
            run(folder, dsn)
            with connect(dsn) as conn:
                figures[folder.name] = measured(conn, folder)
    report(figures)
    print(f"\n{save('epoch_scenes', {'scenes': figures})}")


def measured(conn: psycopg.Connection[Any], folder: Path) -> dict[str, Any]:
    """Hold what was stored of a scene against its truth."""
    moved, regions, true, became = read(conn, folder.name, folder)
    unchanged = json.loads((folder / "truth.json").read_text())["lining_unchanged_seen_by_both_m2"]
    return {**movements(moved, regions), **leaks(true, became), "unchanged": unchanged}


if __name__ == "__main__":
    main()
