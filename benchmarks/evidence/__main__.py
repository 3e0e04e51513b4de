"""Fit the model of evidence that comes with the program.

    python -m benchmarks.evidence --pictures DIR                         # an hour; pictures in DIR are not made again
    python -m benchmarks.evidence --pictures DIR --families known set-1  # to these tunnels alone
    python -m benchmarks.evidence --pictures DIR --write                 # writes tunneldb/anomalies/evidence.json
    python -m benchmarks.evidence --pictures DIR --judge                 # detection by models that know no tunnel of the family

Families are the rounds of blind scenes that were measured, the known phenomena, the leak set by seeds, and painted pictures.
Each family is judged by a model fitted to all others; of the numbers of rounds of boosting the fewest is taken that does there
as well as any, but for a hundredth.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from benchmarks.common import print_table
from benchmarks.evidence.candidates import candidates, together
from benchmarks.evidence.fit import Array, cooled, fit_model, left_out, loss, temperature, weights_of
from benchmarks.evidence.judge import Regions, judge
from benchmarks.evidence.networks import Networks
from benchmarks.evidence.painted import paintings
from benchmarks.evidence.pictures import pictures
from tunneldb.anomalies import evidence

FAMILIES = ("known", *(f"round_{k:02}" for k in range(1, 13)), "set-1")
PAINTINGS, PAINTED = 320, 0.5
"""How many pictures are painted, and how much their regions count: less than those of scans."""

ROUNDS = (80, 120, 180)
WORSE = 1.01
"""The fewest rounds are taken whose loss is no more than so many times the least."""

VERSION = "4"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.evidence", description=__doc__.splitlines()[0])
    parser.add_argument("--pictures", type=Path, required=True, help="where pictures are kept")
    parser.add_argument("--families", nargs="+", default=FAMILIES, metavar="FAMILY", help=f"of {', '.join(FAMILIES)}")
    parser.add_argument(
        "--write", action="store_true", help="put the model in the place of the one that comes with the program"
    )
    parser.add_argument("--judge", action="store_true", help="detect in each family by a model fitted to the others")
    parser.add_argument("--networks", type=Path, help="folder of networks, of which one was trained without each family")
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    arguments = parser.parse_args()
    networks = Networks(arguments.networks)
    parts = [
        candidates(family, picture, truth, networks.of(family))
        for family in arguments.families
        for picture, truth in pictures(family, arguments.pictures, arguments.dsn)
    ]
    parts += paintings(PAINTINGS)
    features, leak, families = together(parts)
    scenes = np.concatenate([np.full(len(part.leak), f"{part.family} {part.scene}", dtype=object) for part in parts])
    weights = weights_of(scenes) * np.where(families == "painted", PAINTED, 1.0)
    groups = families if len(set(families)) > 2 else scenes
    scanned = families != "painted"
    held = {rounds: left_out(features, leak, weights, groups, fitted(rounds)) for rounds in ROUNDS}
    losses = {rounds: loss(p[scanned], leak[scanned], weights[scanned]) for rounds, p in held.items()}
    best = min(rounds for rounds, value in losses.items() if value <= WORSE * min(losses.values()))
    rows = [(rounds, f"{losses[rounds]:.3f}", *_right(p[scanned], leak[scanned])) for rounds, p in held.items()]
    print_table(
        f"{scanned.sum()} regions of scans, judged by models of other families", ("rounds", "loss", "recall", "precision"), rows
    )
    if arguments.judge:
        regions = Regions(features, leak, weights, families, held[best])
        judge(regions, best, arguments.families, arguments.pictures, networks, arguments.dsn)
    count = {family: int((families == family).sum()) for family in sorted(set(families))}
    model = fit_model(features, leak, weights, best, VERSION, {"regions": count, "rounds": best})
    model = cooled(model, max(temperature(held[best][scanned], leak[scanned], weights[scanned]), 1.0))
    if arguments.write:
        path = Path(evidence.__file__).with_name("evidence.json")
        path.write_text(json.dumps(model.to_json(), separators=(",", ":")) + "\n")
        print(path)


def fitted(rounds: int):  # type: ignore[no-untyped-def]
    """Fit with so many rounds; gives a function from features to probabilities."""

    def fit(features: Array, leak: np.ndarray, weights: Array):  # type: ignore[no-untyped-def]
        return fit_model(features, leak, weights, rounds, "", {}).probabilities

    return fit


def _right(probabilities: Array, leak: np.ndarray) -> tuple[str, str]:
    """Share of the leaks that are taken for such, and of what is taken for leaks that are."""
    called = probabilities >= 0.5
    return f"{(called & leak).sum() / leak.sum():.3f}", f"{(called & leak).sum() / max(called.sum(), 1):.3f}"


if __name__ == "__main__":
    main()
