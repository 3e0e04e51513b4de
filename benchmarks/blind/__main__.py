"""Measure detection on rounds of blind scenes.

    python -m benchmarks.blind round_01 round_02     # these rounds
    python -m benchmarks.blind --all
    python -m benchmarks.blind round_01 --only salt  # scenes with a word in their name; nothing is stored
    python -m benchmarks.blind --all --table         # from the results stored last; runs nothing
    python -m benchmarks.blind --all --table --diagram FILE.svg          # with a reliability diagram of all that is shown
    python -m benchmarks.blind round_01 --pictures DIR                   # search and judgement alone; nothing is stored

Each scene is made, loaded and run by the command line. Results go to ``benchmarks/results/blind-ROUND.json``. Pictures are
those that ``python -m benchmarks.evidence --pictures DIR`` keeps; those that are missing are made.
"""

from __future__ import annotations

import argparse
import importlib
import json
import tempfile
from contextlib import nullcontext
from pathlib import Path

from benchmarks.blind.diagram import FORMATS, draw_reliability
from benchmarks.blind.run import Outcome, make, outcome, run
from benchmarks.blind.scene import Scene
from benchmarks.blind.score import reliability
from benchmarks.blind.tables import cells, show
from benchmarks.common import RESULTS, progress, save, scratch_database
from benchmarks.evidence.detection import detect
from benchmarks.evidence.pictures import names, pictures
from tunneldb.database import connect
from tunneldb.segmentation.network import standard_network

ROUNDS = ("known", *sorted(path.name for path in Path(__file__).parent.glob("round_*")))


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.blind", description=__doc__.splitlines()[0])
    asked = parser.add_mutually_exclusive_group(required=True)
    asked.add_argument("rounds", nargs="*", default=[], metavar="ROUND", help=f"of {', '.join(ROUNDS)}")
    asked.add_argument("--all", action="store_true", help="all rounds")
    parser.add_argument("--only", default="", metavar="WORD", help="scenes with this in their name")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--table", action="store_true", help="print the results stored last")
    source.add_argument("--pictures", type=Path, metavar="DIR", help="detect in pictures that are kept here")
    parser.add_argument("--diagram", type=Path, metavar="FILE", help=f"draw a reliability diagram ({', '.join(FORMATS)})")
    parser.add_argument("--folder", type=Path, help="keep the files of the scenes here")
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    arguments = parser.parse_args()
    rounds = ROUNDS if arguments.all else tuple(arguments.rounds)
    if unknown := set(rounds) - set(ROUNDS):
        parser.error(f"no such round: {', '.join(sorted(unknown))}")
    if arguments.diagram and arguments.diagram.suffix.lower() not in FORMATS:
        parser.error(f"{arguments.diagram}: a diagram is written as {', '.join(FORMATS)}")
    if arguments.diagram and not arguments.diagram.absolute().parent.is_dir():
        parser.error(f"{arguments.diagram}: no such folder")
    every: list[Outcome] = []
    refused: list[str] = []
    for name in rounds:
        missing: list[str] = []
        if arguments.table:
            outcomes = stored(parser, name)
        elif arguments.pictures:
            outcomes, missing = measure_pictures(name, arguments.only, arguments.pictures, arguments.dsn)
        else:
            outcomes = measure(name, arguments.only, arguments.folder, arguments.dsn)
            if not arguments.only:
                save(f"blind-{name}", {"outcomes": [one.to_json() for one in outcomes]})
        show(name, outcomes, missing)
        every += outcomes
        refused += missing
    if len(rounds) > 1:
        show("all rounds", every, refused)
    if arguments.diagram:
        title = (
            f"{', '.join(rounds)}: {len(every)} tunnels" if len(rounds) < 4 else f"{len(rounds)} rounds: {len(every)} tunnels"
        )
        draw_reliability(reliability(every), title, arguments.diagram)
        print(arguments.diagram)


def stored(parser: argparse.ArgumentParser, name: str) -> list[Outcome]:
    """Read the outcomes of a round that were stored last."""
    path = RESULTS / f"blind-{name}.json"
    if not path.is_file():
        parser.error(f"no results of {name} are stored: python -m benchmarks.blind {name}")
    return [Outcome.from_json(values) for values in json.loads(path.read_text())["outcomes"]]


def measure_pictures(name: str, only: str, folder: Path, dsn: str | None) -> tuple[list[Outcome], list[str]]:
    """Detect in the pictures of a round; also names of the scenes of which there is none, for the program refused them."""
    found = []
    for picture, truth in pictures(name, folder, dsn, only):
        found.append(detect(picture, truth, standard_network()))
        progress(f"{name} " + "  ".join(cells(truth.scene, [found[-1][0]])))
    with scratch_database(dsn) as database, connect(database) as conn:
        outcomes = [one.classed(conn, coverage) for one, coverage in found]
    seen = {one.scene for one in outcomes}
    return outcomes, [scene for scene in names(name) if only in scene and scene not in seen]


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
            progress(f"{name} " + "  ".join(cells(scene.name, [found[-1]])))
    return found


if __name__ == "__main__":
    main()
