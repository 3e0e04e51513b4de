"""Run the benchmark: ``python -m benchmarks.canal [--scenes KIND] --seeds FIRST COUNT --results FILE``.

Each seed's figures are a line of FILE; seeds that it has are not made again. The table is printed at the end.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from benchmarks.canal.judge import judge
from benchmarks.canal.literal import gap_errors
from benchmarks.canal.peers import compare
from benchmarks.canal.scenes import SCENES, case_of
from benchmarks.canal.table import peers_table, table


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.canal", description=__doc__)
    parser.add_argument("--seeds", nargs=2, type=int, default=[1, 100], metavar=("FIRST", "COUNT"))
    parser.add_argument("--scenes", choices=list(SCENES), default="usual", help="kind of scenes")
    parser.add_argument("--results", type=Path, default=Path("canal.jsonl"))
    parser.add_argument("--peers", action="store_true", help="beside Open3D, small_gicp, least squares and the paper's steps")
    asked = parser.parse_args()
    done = {}
    if asked.results.is_file():
        done = {row["seed"]: row for row in map(json.loads, asked.results.read_text().splitlines())}
    first, count = asked.seeds
    for seed in range(first, first + count):
        if seed in done:
            continue
        case = case_of(asked.scenes, seed)
        done[seed] = judge(case)
        if asked.peers:
            done[seed]["peers"] = compare(case)
            pairs = zip(case.clouds, case.scene.sonar, strict=True)
            done[seed]["gaps"] = [error for cloud, true in pairs for error in gap_errors(case, cloud, true)]
        with asked.results.open("a") as file:
            file.write(json.dumps(done[seed]) + "\n")
    rows = [done[seed] for seed in range(first, first + count)]
    print(table(rows))
    if asked.peers:
        print(peers_table(rows))


main()
