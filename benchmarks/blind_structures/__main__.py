"""Measure detection on structures on rounds of blind scenes.

    python -m benchmarks.blind_structures round_01
    python -m benchmarks.blind_structures --all
    python -m benchmarks.blind_structures round_01 --only silo   # scenes with a word in their name; nothing is stored
    python -m benchmarks.blind_structures --all --table          # from the results stored last; runs nothing

Results go to ``benchmarks/results/blind-structures-ROUND.json``.
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

from benchmarks.blind_structures.score import judge
from benchmarks.common import RESULTS, print_table, progress, save

ROUNDS = tuple(sorted(path.name for path in Path(__file__).parent.glob("round_*")))
HEADER = ("scene", "points", "point F1", "asked", "found", "limits", "false", "m²", "false/100", "two viewpoints", "s")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.blind_structures", description=__doc__.splitlines()[0])
    asked = parser.add_mutually_exclusive_group(required=True)
    asked.add_argument("rounds", nargs="*", default=[], metavar="ROUND", help=f"of {', '.join(ROUNDS)}")
    asked.add_argument("--all", action="store_true", help="all rounds")
    parser.add_argument("--only", default="", metavar="WORD", help="scenes with this in their name")
    parser.add_argument("--table", action="store_true", help="print the results stored last")
    parser.add_argument("--folder", type=Path, help="keep the files of the scenes here")
    arguments = parser.parse_args()
    rounds = ROUNDS if arguments.all else tuple(arguments.rounds)
    if unknown := set(rounds) - set(ROUNDS):
        parser.error(f"no such round: {', '.join(sorted(unknown))}")
    every: list[dict[str, Any]] = []
    for name in rounds:
        stored = RESULTS / f"blind-structures-{name}.json"
        if arguments.table:
            if not stored.is_file():
                parser.error(f"no results of {name} are stored: python -m benchmarks.blind_structures {name}")
            scenes = json.loads(stored.read_text())["scenes"]
        else:
            scenes = measure(name, arguments.only, arguments.folder)
            if not arguments.only:
                save(f"blind-structures-{name}", {"scenes": scenes})
        print_table(name, HEADER, [row(scene) for scene in scenes])
        every += scenes
    if len(every) > 1:
        print_table("all", HEADER, [total(every)])


def measure(name: str, only: str, folder: Path | None) -> list[dict[str, Any]]:
    """Make and run the scenes of a round."""
    scenes = importlib.import_module(f"benchmarks.blind_structures.{name}").SCENES
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
    per = 100.0 * len(scene["false"]) / max(scene["seen"], 1.0)
    return [
        scene["scene"], scene["points"], _share(scene["f1"]), scene["asked"], scene["found"], scene["limits"],
        len(scene["false"]), round(scene["seen"]), f"{per:.2f}", _share(scene["pair"]),
        "refused" if scene["refused"] else round(scene["seconds"], 1),
    ]  # fmt: skip


def total(scenes: Sequence[dict[str, Any]]) -> Sequence[object]:
    """Return the line of all scenes: means of F1 and IoU, sums of the rest."""
    false, seen = sum(len(scene["false"]) for scene in scenes), sum(scene["seen"] for scene in scenes)
    f1, pairs = ([scene[key] for scene in scenes if scene[key] is not None] for key in ("f1", "pair"))
    return [
        f"{len(scenes)} scenes", sum(scene["points"] for scene in scenes), _share(float(np.mean(f1)) if f1 else None),
        *(sum(scene[key] for scene in scenes) for key in ("asked", "found", "limits")), false, round(seen),
        f"{100.0 * false / max(seen, 1.0):.2f}", _share(float(np.mean(pairs)) if pairs else None),
        round(float(np.nansum([scene["seconds"] for scene in scenes])), 1),
    ]  # fmt: skip


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


if __name__ == "__main__":
    main()
