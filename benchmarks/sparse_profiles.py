"""Profiles far apart along the tunnel: leaks found, in how many pieces, and their area, by the distance of the profiles.

    python -m benchmarks.sparse_profiles               # two tunnels at five distances, about 15 minutes on two cores
    python -m benchmarks.sparse_profiles --only 0.5    # one distance
    python -m benchmarks.sparse_profiles --folder DIR  # keep the files, or take those that are there

Each tunnel is run twice: as it is, and with ``image.spacing`` no larger than a pixel, by which nothing is done about the
profiles: each slice of a leak is then a leak of its own. Leaks longer than two distances must be found, and once; shorter ones
may lie between two profiles.
"""

from __future__ import annotations

import argparse
import tempfile
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from benchmarks.leak_set import COMMON, KILOMETRE, MARKED
from benchmarks.leaks import LIST_HEADER, Outcome, lines
from benchmarks.scene import Scene
from tunneldb.database import connect
from tunneldb.evaluate.measure import MIN_OVERLAP, figures

SPACINGS = (0.02, 0.1, 0.25, 0.5, 1.0)
TUNNELS: dict[str, dict[str, Any]] = {
    "circular plain": {"section": "circular", "lining": "plain", "roughness": 12, "leaks": 14},
    "horseshoe segments": {
        "section": "horseshoe",
        "lining": "segments",
        "ring": 1.37,
        "ring_step": 0.003,
        "roughness": 16,
        **MARKED,
        "leaks": 12,
    },
}
LENGTH, POINTS = 100, 1500
WAYS = {"closed": "image.spacing=0", "left open": "image.spacing=0.02"}
HEADER = (
    "spacing m", "gaps", "true", "found", "called", "false", "long", "found", "once", "area F1", "true m²", "found m²", "seen",
)  # fmt: skip


@dataclass(frozen=True)
class Figures:
    """What was found at one distance, summed over the tunnels.

    Attributes
    ----------
    true, found, called, false : int
        As ``tunneldb evaluate`` counts them, of 0.1 m² and more.
    long, long_found, long_once : int
        True leaks longer than two distances; those found; those that one called leak alone touches.
    area_f1, true_area, found_area : float
        Of all leaks, m².
    seen : float
        Share of the lining that a point or a profile stands for.
    """

    true: int
    found: int
    called: int
    false: int
    long: int
    long_found: int
    long_once: int
    area_f1: float
    true_area: float
    found_area: float
    seen: float

    @classmethod
    def of(cls, outcomes: list[Outcome], shares: list[float], spacing: float) -> Figures:
        comparisons = [outcome.comparison() for outcome in outcomes]
        single = [figures(c) for c in comparisons]
        common = sum(f.area_recall * f.true_area for f in single)
        true_area, found_area = sum(f.true_area for f in single), sum(f.found_area for f in single)
        long = once = hit = 0
        for c in comparisons:
            for shape, covered in zip(c.true_shape, c.covered, strict=True):
                if shape.bounds[2] - shape.bounds[0] > 2.0 * spacing:
                    long += 1
                    hit += covered >= MIN_OVERLAP
                    once += int(shapely.intersects(c.found_shape, shape).sum()) == 1
        return cls(
            sum(f.true for f in single), sum(f.found for f in single), sum(f.called for f in single),
            sum(f.false for f in single), long, int(hit), once, 2.0 * common / max(true_area + found_area, 1e-9),
            true_area, found_area, float(np.mean(shares)),
        )  # fmt: skip

    def row(self, spacing: float, way: str) -> list[object]:
        """A line of the table."""
        counts = [self.true, self.found, self.called, self.false, self.long, self.long_found, self.long_once]
        areas = [f"{self.area_f1:.3f}", f"{self.true_area:.1f}", f"{self.found_area:.1f}", f"{100 * self.seen:.0f} %"]
        return [f"{spacing:g}", way, *counts, *areas]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--only", type=float, help="one distance, m")
    parser.add_argument("--tunnel", help="tunnels whose name holds this")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="where to make the files, or where they are; default: a temporary one")
    arguments = parser.parse_args()
    names = [name for name in TUNNELS if arguments.tunnel is None or arguments.tunnel in name]
    table: dict[str, dict[str, Any]] = {}
    rows, listed = [], []
    with nullcontext(arguments.folder) if arguments.folder else tempfile.TemporaryDirectory() as folder:
        for spacing in SPACINGS if arguments.only is None else (arguments.only,):
            found: dict[str, tuple[list[Outcome], list[float]]] = {way: ([], []) for way in WAYS}
            for name in names:
                progress(f"{name}, {spacing:g} m")
                for way, (outcome, share) in measure(arguments.dsn, name, spacing, arguments.seed, Path(folder)).items():
                    found[way][0].append(outcome)
                    found[way][1].append(share)
            for way, (outcomes, shares) in found.items():
                made = Figures.of(outcomes, shares, spacing)
                rows.append(made.row(spacing, way))
                progress("  " + "  ".join(map(str, rows[-1])))
                table[f"{spacing:g} {way}"] = vars(made)
                if way == "closed":
                    listed += [[f"{spacing:g} m {line[0]}", *line[1:]] for outcome in outcomes for line in lines(outcome)]
    print_table(f"Leaks by the distance of profiles, seed {arguments.seed}", HEADER, rows)
    print_table("Missed leaks and wrong ones, gaps closed", LIST_HEADER, listed)
    print(f"\n{save('sparse_profiles', {'seed': arguments.seed, 'distances': table})}")


def measure(dsn: str | None, name: str, spacing: float, seed: int, folder: Path) -> dict[str, tuple[Outcome, float]]:
    """Make a tunnel, and find its leaks in both ways: what was found, and the share of the lining seen."""
    number = list(TUNNELS).index(name)
    options = {
        **COMMON, **TUNNELS[name], "scanner": "profiler", "profile_spacing": spacing, "profile_points": POINTS,
        "length": LENGTH, "seed": 100 * seed + number, "joint_leaks": 0,
    }  # fmt: skip
    start = KILOMETRE * (30 + number) + 310.0
    scene = Scene(folder, f"{name.replace(' ', '-')}-{round(1000 * spacing)}-{seed}", start)
    if not scene.file("json").exists():
        flags: list[object] = []
        for option, value in options.items():
            if value is not False and option != "start_chainage":
                flags.append("--" + option.replace("_", "-"))
                flags += [] if value is True else list(value) if isinstance(value, tuple) else [value]
        tunneldb("simulate", folder, "--name", scene.name, "--no-truth", "--start-chainage", start, *flags)
    found = {}
    with scratch_database(dsn) as database:
        scene.register(database)
        scene.load(database)
        scene.run(database, "axis", "ground")
        for way, setting in WAYS.items():
            scene.run(database, "detect", "detect", "--set", setting)
            with connect(database) as conn:
                outcome = Outcome.read(conn, scene, name)
                (share,) = conn.execute(
                    "SELECT (counts ->> 'seen')::float8 FROM tunnel.run WHERE stage = 'detect' ORDER BY id DESC LIMIT 1"
                ).fetchone() or (np.nan,)
            found[way] = outcome, float(share)
    return found


if __name__ == "__main__":
    main()
