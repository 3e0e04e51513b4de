"""Regions of change between scans of simulated tunnels that did not change, and bulges of 3 mm on 1 m² between those that did.

    python -m benchmarks.unchanged_pairs FOLDER                    # half a minute a scan, three scans of each tunnel
    python -m benchmarks.unchanged_pairs FOLDER --only box stone

Each tunnel, 24 m long, is scanned once, once more unchanged, and once more with three bulges; both later scans have poses that
are off by 20 mm and 0.02°. All goes from files through all stages. A bulge is found where regions of its sign cover half of it;
a region is false where it lies farther than BESIDE from every bulge.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pyogrio.raw
import shapely

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from tunneldb.database import connect
from tunneldb.store.survey import get_survey

BESIDE = 0.3  # m
BULGES, BULGE = 3, 0.003
LENGTH = 24.0  # m
SRID = 25830
OFF = ("--pose-error", 0.02, "--pose-turn", 0.02)
STATIC = ("--scanner", "static", "--angular-step", 0.25)
PROFILER = ("--scanner", "profiler", "--profile-spacing", 0.02, "--profile-points", 1000)
TUNNELS: dict[str, tuple[object, ...]] = {
    "segments": (*STATIC, "--lining", "segments", "--segment-step", 0.001, "--seed", 101, "--range-noise", 0.002),
    "segments_mobile": (*PROFILER, "--lining", "segments", "--seed", 102, "--clutter", 4, "--radius", -250),
    "cast": (*STATIC, "--lining", "cast", "--section", "horseshoe", "--seed", 103, "--range-noise", 0.004),
    "shotcrete": (*STATIC, "--lining", "shotcrete", "--seed", 104, "--slope", 3),
    "rough_shotcrete": (*PROFILER, "--lining", "rough_shotcrete", "--seed", 105),
    "stone": (*STATIC, "--lining", "stone", "--section", "horseshoe", "--wall-height", 2, "--seed", 106, "--beam", 0.3),
    "brick": (*PROFILER, "--lining", "brick", "--seed", 107, "--range-noise", 0.0015, "--section", "horseshoe"),
    "box": (*STATIC, "--lining", "cast", "--section", "box", "--width", 7, "--height", 5, "--seed", 108, "--radius", 0),
    "clutter": (*STATIC, "--lining", "plain", "--seed", 109, "--clutter", 6, "--thin-cables", 2, "--beam", 0.4, "--sheets", 1),
    "relief": (*PROFILER, "--lining", "plain", "--relief", 0.003, "--seed", 110, "--noise-growth", 0.3),
}


@dataclass(frozen=True)
class Judged:
    """What one comparison says: area seen by both, m²; area and place of each false region; bulges found."""

    area: float
    false: list[dict[str, float]]
    found: list[float]
    bulges: int


def scan(folder: Path, name: str, options: tuple[object, ...], dsn: str, *changed: object) -> None:
    """Simulate a scan of a tunnel and bring it to its leaks."""
    survey = folder.name
    if not (folder / "demo.laz").is_file():
        tunneldb("simulate", folder, "--name", "demo", "--no-truth", "--length", LENGTH, *options, *changed)
    if survey.endswith("-old"):
        tunneldb("tunnel", "add", name, "--srid", SRID, "--axis", folder / "demo.axis.csv", dsn=dsn)
    trajectory = folder / "demo.trajectory.csv"
    poses = ("--trajectory", trajectory) if trajectory.is_file() else ("--stations", folder / "demo.stations.csv")
    day = "2024-05-04" if survey.endswith("-old") else "2026-05-04"
    tunneldb(
        "survey", "add", survey, "--tunnel", name, "--date", day, *poses,
        "--reference", folder / "demo.reference.csv", "--intensity", "Amplitude", "--intensity-kind", "amplitude", dsn=dsn,
    )  # fmt: skip
    tunneldb("load", survey, folder / "demo.laz", dsn=dsn)
    tunneldb("run", survey, dsn=dsn)


def make(folder: Path, name: str, dsn: str) -> None:
    """Three scans of a tunnel, and both comparisons."""
    options = TUNNELS[name]
    scan(folder / f"{name}-old", name, options, dsn)
    scan(folder / f"{name}-same", name, options, dsn, "--epoch", 1, *OFF)
    scan(folder / f"{name}-bulged", name, options, dsn, "--epoch", 2, *OFF, "--bulges", BULGES, "--bulge", BULGE)
    for later in ("same", "bulged"):
        tunneldb("compare", f"{name}-old", f"{name}-{later}", dsn=dsn)


def judge(conn: psycopg.Connection[Any], folder: Path, name: str, later: str) -> Judged:
    """Hold what was stored of a comparison against what was put in."""
    ids = [get_survey(conn, f"{name}-{which}").id for which in (later, "old")]
    row = conn.execute(
        "SELECT sum(seen_both) FROM tunnel.change_section WHERE survey_id = %s AND old_survey_id = %s", ids
    ).fetchone()
    regions = [
        (shapely.make_valid(shapely.from_wkb(bytes(outline))), mean)
        for outline, mean in conn.execute(
            "SELECT public.ST_AsBinary(unrolled), change_mean FROM tunnel.change_region"
            " WHERE survey_id = %s AND old_survey_id = %s",
            ids,
        )
    ]
    bulges: list[Any] = []
    if later == "bulged":
        shapes = pyogrio.raw.read(folder / f"{name}-bulged" / "demo.truth.gpkg", layer="deformation")[2]
        bulges = shapely.from_wkb(shapes).tolist()
    about = shapely.union_all([bulge.buffer(BESIDE) for bulge in bulges])
    covered = [
        shapely.union_all([region for region, mean in regions if mean > 0.0]).intersection(bulge).area / bulge.area
        for bulge in bulges
    ]
    false = [
        {"area": region.area, "chainage": region.centroid.x, "arc": region.centroid.y, "mean": mean}
        for region, mean in regions
        if not region.intersects(about)
    ]
    return Judged(float(row[0] or 0.0) if row else 0.0, false, covered, len(bulges))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where scans are written, and taken from if they are there")
    parser.add_argument("--only", nargs="+", choices=TUNNELS, default=list(TUNNELS), help="these tunnels")
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    arguments = parser.parse_args()
    judged: dict[str, dict[str, Judged]] = {}
    with scratch_database(arguments.dsn) as dsn:
        for name in arguments.only:
            progress(name)
            make(arguments.folder, name, dsn)
            with connect(dsn) as conn:
                judged[name] = {later: judge(conn, arguments.folder, name, later) for later in ("same", "bulged")}
    report(judged)


def report(judged: dict[str, dict[str, Judged]]) -> None:
    """Print and save what was found of each tunnel, and the sums."""
    rows = [
        (name, later, one.area, len(one.false), sum(false["area"] for false in one.false),
         f"{sum(cover >= 0.5 for cover in one.found)} of {one.bulges}" if one.bulges else "")
        for name, both in judged.items() for later, one in both.items()
    ]  # fmt: skip
    print_table("Unchanged lining, and bulges of 3 mm on 1 m²", ("tunnel", "scan", "m²", "false", "m² of them", "found"), rows)
    every = [one for both in judged.values() for one in both.values()]
    area, false = sum(one.area for one in every), sum(len(one.false) for one in every)
    found = np.concatenate([np.asarray(one.found) >= 0.5 for one in every])
    print(
        f"\n{false} false in {area:.0f} m², {1000.0 * false / area:.2f} in 1000 m²; {found.sum()} of {len(found)} bulges found"
    )
    figures = {name: {later: vars(one) for later, one in both.items()} for name, both in judged.items()}
    print(save("unchanged_pairs", json.loads(json.dumps({"tunnels": figures}))))


if __name__ == "__main__":
    main()
