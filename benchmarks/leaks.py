"""Leaks found on a benchmark set of simulated tunnels, against those put in (benchmarks/leak_set.py, wide_set.py).

    python -m benchmarks.leaks                         # all tunnels, about 15 minutes on two cores
    python -m benchmarks.leaks --only static --seed 2  # those with a word in their name
    python -m benchmarks.leaks --set wide              # one phenomenon a tunnel, about 20 minutes
    python -m benchmarks.leaks --folder DIR --images   # keep the files, with the images of each tunnel

Each tunnel is made, loaded and run by the command line. Figures are those of ``tunneldb evaluate`` for leaks of 0.1 m² and
more. Strong leaks are those whose drop is at least 4 standard deviations of dry lining. What was missed and what is wrong is
listed: where, and what lies there.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import shapely
from shapely.geometry.base import BaseGeometry

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from benchmarks.leak_set import SET, Case, Truth, prepare
from benchmarks.scene import Scene
from benchmarks.wide_set import WIDE_SET
from tunneldb.database import connect
from tunneldb.evaluate.measure import MIN_OVERLAP, Comparison, compare, figures
from tunneldb.evaluate.survey import read_findings
from tunneldb.store.survey import get_survey

SETS: dict[str, Sequence[Case]] = {"leak": SET, "wide": WIDE_SET}
SMALLEST, STRONG = 0.1, 4.0
HEADER = (
    "tunnel", "true", "found", "strong", "found", "called", "false", "/1000 m²", "F1", "area F1", "IoU", "area err", "p95",
    "edge mm", "p95", "joints", "dark",
)  # fmt: skip
LIST_HEADER = ("", "tunnel", "chainage", "arc", "m²", "dB", "sigmas", "of it", "there")


@dataclass(frozen=True)
class Anomaly:
    """What detection found, and what it takes it for."""

    shape: BaseGeometry
    kind: str
    reasons: list[str]
    confidence: float | None
    contrast: float | None
    drop: float

    def __str__(self) -> str:
        confidence = "" if self.confidence is None else f" {self.confidence:.2f}"
        return f"{self.kind}{confidence} ({', '.join(self.reasons)})"


@dataclass(frozen=True)
class Outcome:
    """One tunnel: what was put in, and what came out; `sigma` is that of dry lining's pixels, dB."""

    name: str
    truth: Truth
    anomalies: list[Anomaly]
    seen: float
    sigma: float

    @property
    def leaks(self) -> list[Anomaly]:
        return [anomaly for anomaly in self.anomalies if anomaly.kind == "leak"]

    def comparison(self) -> Comparison:
        return compare(self.truth.leaks, [anomaly.shape for anomaly in self.leaks], SMALLEST)

    def sigmas(self) -> np.ndarray:
        """Drop of each true leak in standard deviations of dry lining."""
        return self.truth.drops / self.sigma

    @classmethod
    def read(cls, conn: psycopg.Connection[Any], scene: Scene, name: str) -> Outcome:
        survey = get_survey(conn, scene.name)
        rows = conn.execute(
            "SELECT public.ST_AsBinary(unrolled), coalesce(kind_override, kind), reasons, confidence, contrast, darkening_mean"
            " FROM tunnel.finding WHERE survey_id = %s ORDER BY chainage_from, arc_from",
            (survey.id,),
        ).fetchall()
        (sigma,) = conn.execute(
            "SELECT avg(dry_sigma) FROM tunnel.radiometry WHERE survey_id = %s", (survey.id,)
        ).fetchone() or (None,)
        anomalies = [Anomaly(shapely.from_wkb(bytes(row[0])), *row[1:]) for row in rows]
        return cls(name, Truth.of(scene), anomalies, read_findings(conn, survey).seen, float(sigma))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--set", choices=list(SETS), default="leak", help="which tunnels: leak_set.py or wide_set.py")
    parser.add_argument("--only", help="tunnels whose name holds this")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="where to make the files, or where they are; default: a temporary one")
    parser.add_argument("--images", action="store_true", help="write the images of each tunnel into the folder")
    arguments = parser.parse_args()
    cases, outcomes = SETS[arguments.set], []
    with nullcontext(arguments.folder) if arguments.folder else tempfile.TemporaryDirectory() as folder:
        for case in chosen(arguments.only, cases):
            progress(case.name)
            outcomes.append(measure(arguments.dsn, case, arguments.seed, Path(folder), arguments.images, cases))
            progress("  " + "  ".join(row(outcomes[-1].name, [outcomes[-1]])[1:]))
    print_table(
        f"Leaks of {SMALLEST} m² and more, seed {arguments.seed}",
        HEADER,
        [*(row(outcome.name, [outcome]) for outcome in outcomes), row("all", outcomes)],
    )
    listed = [line for outcome in outcomes for line in lines(outcome)]
    print_table("Missed leaks and wrong ones", LIST_HEADER, listed)
    table = {outcome.name: plain([outcome]) for outcome in outcomes}
    name = "leaks" if arguments.set == "leak" else f"leaks_{arguments.set}"
    print(f"\n{save(name, {'seed': arguments.seed, 'tunnels': table, 'all': plain(outcomes), 'wrong': listed})}")


def chosen(only: str | None, among: Sequence[Case] = SET) -> list[Case]:
    cases = [case for case in among if only is None or only in case.name]
    if not cases:
        raise SystemExit("no such tunnel; there are: " + "; ".join(case.name for case in among))
    return cases


def measure(dsn: str | None, case: Case, seed: int, folder: Path, images: bool = False, among: Sequence[Case] = SET) -> Outcome:
    """Make a tunnel, run it, and read what was found."""
    with scratch_database(dsn) as database:
        scene = prepare(case, seed, folder, database, among)
        scene.run(database, "detect", "detect")
        if images:
            tunneldb("image", scene.name, "-o", folder / "images", dsn=database)
        with connect(database) as conn:
            return Outcome.read(conn, scene, case.name)


def values(outcomes: list[Outcome]) -> dict[str, Any]:
    """Figures of tunnels together; each lies in a kilometre of its own, so that none touches another's leaks."""
    true = [leak for outcome in outcomes for leak in outcome.truth.leaks]
    found = [leak.shape for outcome in outcomes for leak in outcome.leaks]
    comparison = compare(true, found, SMALLEST)
    sigmas = np.concatenate([outcome.sigmas() for outcome in outcomes])[comparison.true]
    kinds = [anomaly.kind for outcome in outcomes for anomaly in outcome.anomalies]
    return {
        **asdict(figures(comparison, sum(outcome.seen for outcome in outcomes))),
        "strong": int((sigmas >= STRONG).sum()),
        "strong_found": int(((sigmas >= STRONG) & (comparison.covered >= MIN_OVERLAP)).sum()),
        "joints": kinds.count("joint"),
        "dark": kinds.count("dark"),
    }


def plain(outcomes: list[Outcome]) -> dict[str, Any]:
    """The same for JSON, in which what there is not is null."""
    return {name: value if np.isfinite(value) else None for name, value in values(outcomes).items()}


def row(name: str, outcomes: list[Outcome]) -> list[str]:
    """A line of the table."""
    v = values(outcomes)
    counts = [str(v[key]) for key in ("true", "found", "strong", "strong_found", "called", "false")]
    shares = [f"{v[key]:.3f}" for key in ("f1", "area_f1", "area_iou")]
    errors = [f"{100 * v[key]:.0f} %" for key in ("area_error", "area_error_p95")]
    edges = [f"{1000 * v[key]:.0f}" for key in ("edge", "edge_p95")]
    cells = [name, *counts, f"{v['false_per_1000']:.2f}", *shares, *errors, *edges, str(v["joints"]), str(v["dark"])]
    return ["" if cell.startswith("nan") else cell for cell in cells]


def lines(outcome: Outcome) -> list[list[str]]:
    """Missed leaks with what was found there, and wrong ones with what is there in truth."""
    c = outcome.comparison()
    out = []
    for i in np.flatnonzero(c.covered < MIN_OVERLAP):
        drop, sigmas = outcome.truth.drops[c.true[i]], outcome.sigmas()[c.true[i]]
        there = [str(anomaly) for anomaly in outcome.anomalies if anomaly.shape.intersects(c.true_shape[i])]
        out.append(
            ["missed", outcome.name, *_where(c.true_shape[i]), f"{drop:.1f}", f"{sigmas:.1f}", f"{100 * c.covered[i]:.0f} %",
             "; ".join(there) or "nothing"]
        )  # fmt: skip
    for i in np.flatnonzero(c.right < MIN_OVERLAP):
        anomaly = outcome.leaks[c.found[i]]
        word = "wrong" if c.found_group[i] >= 0 else "false"
        contrast = "" if anomaly.contrast is None else f"{anomaly.contrast:.1f}"
        out.append(
            [word, outcome.name, *_where(anomaly.shape), f"{anomaly.drop:.1f}", contrast,
             f"{100 * c.right[i]:.0f} %", f"{outcome.truth.near(anomaly.shape)}; {anomaly}"]
        )  # fmt: skip
    return out


def _where(shape: BaseGeometry) -> tuple[str, str, str]:
    inside = shapely.point_on_surface(shape)
    return f"{inside.x:.2f}", f"{inside.y:+.2f}", f"{shape.area:.2f}"


if __name__ == "__main__":
    main()
