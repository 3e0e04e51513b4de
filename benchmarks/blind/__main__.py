"""Measure detection on rounds of blind scenes.

    python -m benchmarks.blind round_01 round_02     # these rounds
    python -m benchmarks.blind --all
    python -m benchmarks.blind round_01 --only salt  # scenes with a word in their name; nothing is stored
    python -m benchmarks.blind --all --table         # from the results stored last; runs nothing

Each scene is made, loaded and run by the command line. Results go to ``benchmarks/results/blind-ROUND.json``.
"""

from __future__ import annotations

import argparse
import importlib
import json
import tempfile
from contextlib import nullcontext
from pathlib import Path

from benchmarks.blind.run import Outcome, make, outcome, run
from benchmarks.blind.scene import Scene
from benchmarks.blind.score import by_phenomenon, calibration_error, hold, reliability, review, row
from benchmarks.common import RESULTS, print_table, progress, save, scratch_database
from tunneldb.database import connect

ROUNDS = ("known", *sorted(path.name for path in Path(__file__).parent.glob("round_*")))
HEADER = ("scene", "true", "found", "called", "right", "false", "leak F1", "area R", "area P", "area F1", "area p95",
          "edge p95", "pieces", "false/1000")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.blind", description=__doc__.splitlines()[0])
    asked = parser.add_mutually_exclusive_group(required=True)
    asked.add_argument("rounds", nargs="*", default=[], metavar="ROUND", help=f"of {', '.join(ROUNDS)}")
    asked.add_argument("--all", action="store_true", help="all rounds")
    parser.add_argument("--only", default="", metavar="WORD", help="scenes with this in their name")
    parser.add_argument("--table", action="store_true", help="print the results stored last")
    parser.add_argument("--folder", type=Path, help="keep the files of the scenes here")
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    arguments = parser.parse_args()
    if unknown := set(arguments.rounds) - set(ROUNDS):
        parser.error(f"no such round: {', '.join(sorted(unknown))}")
    every: list[Outcome] = []
    for name in ROUNDS if arguments.all else arguments.rounds:
        if arguments.table:
            stored = json.loads((RESULTS / f"blind-{name}.json").read_text())["outcomes"]
            outcomes = [Outcome.from_json(values) for values in stored]
        else:
            outcomes = measure(name, arguments.only, arguments.folder, arguments.dsn)
            if not arguments.only:
                save(f"blind-{name}", {"outcomes": [one.to_json() for one in outcomes]})
        show(name, outcomes)
        every += outcomes
    if arguments.all or len(arguments.rounds) > 1:
        show("all rounds", every)


def measure(name: str, only: str, folder: Path | None, dsn: str | None) -> list[Outcome]:
    """Make and run the scenes of a round."""
    scenes: tuple[Scene, ...] = importlib.import_module(f"benchmarks.blind.{name}").SCENES
    found = []
    with nullcontext(folder) if folder else tempfile.TemporaryDirectory() as place, scratch_database(dsn) as database:
        for scene in scenes:
            if only not in scene.name:
                continue
            here = Path(place).resolve() / name / scene.name
            make(scene, here)
            try:
                seconds = run(scene, here, database)
            except SystemExit as refusal:
                progress(f"{name} {scene.name}: {str(refusal).strip().splitlines()[-1]}")
                seconds = float("nan")
            with connect(database) as conn:
                found.append(outcome(conn, scene, here, seconds))
            progress(f"{name} " + "  ".join(_cells(scene.name, [found[-1]])))
    return found


def show(name: str, outcomes: list[Outcome]) -> None:
    """Print the tables of a round."""
    rows = [_cells(one.scene, [one]) for one in outcomes]
    print_table(name, HEADER, [*rows, _cells("all", outcomes)])
    phenomena = by_phenomenon(hold(outcomes))
    print_table("by phenomenon", ("", "true", "found", "area R"), [(k, n, f, f"{a:.2f}") for k, (n, f, a) in phenomena.items()])
    count, stated, true = reliability(outcomes)
    print_table("probabilities", ("", "stated", "true", "number"),
                [("", f"{s:.2f}", f"{t:.2f}", int(n)) for n, s, t in zip(count, stated, true, strict=True) if n])  # fmt: skip
    print(f"calibration error {calibration_error(outcomes):.3f}; looked at for each true leak {review(outcomes):.2f}")


def _cells(name: str, outcomes: list[Outcome]) -> list[str]:
    v = row(hold(outcomes))
    counts = [str(int(v[key])) for key in ("true", "found", "called", "right", "false")]
    shares = [f"{v[key]:.3f}" for key in ("f1", "area_recall", "area_precision", "area_f1")]
    cells = [name, *counts, *shares, f"{100 * v['area_error_p95']:.0f} %", f"{1000 * v['edge_p95']:.0f} mm",
             f"{v['pieces']:.2f}", f"{v['false_per_1000']:.2f}"]  # fmt: skip
    return ["" if cell.startswith("nan") else cell for cell in cells]


if __name__ == "__main__":
    main()
