"""Measure registration of sonar scans on rounds of blind canals.

    python -m benchmarks.blind_canal round_01
    python -m benchmarks.blind_canal --all
    python -m benchmarks.blind_canal round_01 --only basin     # scenes with a word in their name; nothing is stored
    python -m benchmarks.blind_canal --all --table             # from the results stored last; runs nothing
    python -m benchmarks.blind_canal --files FOLDER            # one scene whose files are there

Results go to ``benchmarks/results/blind-canal-ROUND.json``.
"""

from __future__ import annotations

import argparse
import importlib
import json
import tempfile
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.blind_canal.score import RIGHT, SAME, is_wrong, judge
from benchmarks.common import RESULTS, print_table, progress, save

ROUNDS = tuple(sorted(path.name for path in Path(__file__).parent.glob("round_*")))
HEADER = ("scene", "scans", "asked", "determined", "weak", "right", "wrong", "alternatives", "true among", "median", "p95", "s")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.blind_canal", description=__doc__.splitlines()[0])
    asked = parser.add_mutually_exclusive_group(required=True)
    asked.add_argument("rounds", nargs="*", default=[], metavar="ROUND", help=f"of {', '.join(ROUNDS)}")
    asked.add_argument("--all", action="store_true", help="all rounds")
    asked.add_argument("--files", type=Path, help="folder with the files of one scene")
    parser.add_argument("--only", default="", metavar="WORD", help="scenes with this in their name")
    parser.add_argument("--table", action="store_true", help="print the results stored last")
    parser.add_argument("--folder", type=Path, help="keep the files of the scenes here")
    arguments = parser.parse_args()
    if arguments.files:
        print_table("scene", HEADER, [row(judge(arguments.files.name, arguments.files))])
        return
    rounds = ROUNDS if arguments.all else tuple(arguments.rounds)
    if unknown := set(rounds) - set(ROUNDS):
        parser.error(f"no such round: {', '.join(sorted(unknown))}")
    every: list[dict[str, Any]] = []
    for name in rounds:
        stored = RESULTS / f"blind-canal-{name}.json"
        if arguments.table:
            if not stored.is_file():
                parser.error(f"no results of {name} are stored: python -m benchmarks.blind_canal {name}")
            scenes = json.loads(stored.read_text())["scenes"]
        else:
            scenes = measure(name, arguments.only, arguments.folder)
            if not arguments.only:
                save(f"blind-canal-{name}", {"scenes": scenes})
        print_table(name, HEADER, [row(scene) for scene in scenes])
        every += scenes
    if len(rounds) > 1:
        print_table("all rounds", HEADER, [total(every)])


def measure(name: str, only: str, folder: Path | None) -> list[dict[str, Any]]:
    """Make and register the scenes of a round."""
    scenes = importlib.import_module(f"benchmarks.blind_canal.{name}").SCENES
    out = []
    with nullcontext(folder) if folder else tempfile.TemporaryDirectory() as place:
        for scene in scenes:
            if only not in scene.name:
                continue
            here = Path(place).resolve() / name / scene.name
            if not (here / "truth.json").is_file():
                here.mkdir(parents=True, exist_ok=True)
                scene.make(here)
            out.append(judge(scene.name, here))
            progress(f"{name} " + "  ".join(map(str, row(out[-1]))))
    return out


def row(scene: dict[str, Any]) -> Sequence[object]:
    """Return the line of the table of a scene."""
    return [scene["scene"], *_figures(scene["scans"]), round(scene["seconds"], 1)]


def total(scenes: Sequence[dict[str, Any]]) -> Sequence[object]:
    """Return the line of all scenes."""
    scans = [scan for scene in scenes for scan in scene["scans"]]
    return [f"{len(scenes)} scenes", *_figures(scans), round(sum(scene["seconds"] for scene in scenes), 1)]


def _figures(scans: Sequence[dict[str, Any]]) -> Sequence[object]:
    placed = [scan for scan in scans if scan["state"] != "undetermined"]
    open_scans = [scan for scan in scans if scan["state"] == "undetermined"]
    listed = [scan for scan in open_scans if scan["alternatives"]]
    among = [scan for scan in listed if min(scan["alternatives"]) <= SAME]
    return [
        len(scans),
        sum(scan["asked"] for scan in scans),
        sum(scan["state"] == "determined" for scan in scans),
        sum(scan["state"] == "weak" for scan in scans),
        sum(scan["p95"] <= RIGHT for scan in placed),
        sum(is_wrong(scan) for scan in scans),
        len(listed),
        len(among),
        _millimetres([scan["median"] for scan in placed]),
        _millimetres([scan["p95"] for scan in placed]),
    ]


def _millimetres(values: Sequence[float]) -> str:
    return "-" if not values else f"{1000.0 * float(np.max(values)):.0f}"


if __name__ == "__main__":
    main()
