"""How many reviews it takes until detection knows an owner's dirt.

    python -m benchmarks.learning                    # a quarter of an hour
    python -m benchmarks.learning --regions DIR      # regions in DIR are not painted again

Owners have two tunnels each, in which water shows as it does elsewhere, and dirt of their own. An inspector reviews the first
of them from its beginning on, all that detection found dark; then ``tunneldb learn`` is asked, and the second tunnel is judged
by what it learned. Errors are dark regions of the second that are taken for leaks and are none, or the other way round; leaks
that were not found dark are not among them. The mean of several inspections is shown, each of which begins elsewhere.

The pictures are painted (benchmarks/evidence/painted.py), with other seeds than those that the model was fitted to.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely import affinity
from shapely.geometry import LineString, Point, Polygon

from benchmarks.common import print_table, progress
from benchmarks.evidence.candidates import DARK, LEAK
from benchmarks.evidence.painted import CELL, HALF, LONG, THINGS, Painting, blob, patch, uneven
from tunneldb.anomalies.evidence import standard_model
from tunneldb.anomalies.learning import Adjustment, Reviewed, Way, learn

REVIEWS = (0, 25, 50, 100, 200, 400)
STARTS = 6
"""Inspections, each of which begins at another picture of the first tunnel."""

FIRST, SECOND = 36, 24
"""Pictures, of 15 m each, of an owner's two tunnels."""

SEED = 50_000
"""Of the first picture; the model was fitted to pictures of seeds below 1000."""

Array = NDArray[np.float64]
Maker = Callable[[Painting, float, float], None]


def soot_stripe(art: Painting, s: float, a: float) -> None:
    """A stripe along the tunnel as exhaust leaves it: soft and wavy, of uneven darkness."""
    t = np.linspace(s - art.uniform(0.5, 1.35), s + art.uniform(0.5, 1.35), 30)
    wave = art.uniform(0.02, 0.08) * np.sin(art.uniform(2, 6) * t + art.uniform(0, 6))
    shape = LineString(np.column_stack([t, a + wave])).buffer(art.uniform(0.08, 0.25))
    art.paint(art.cover(shape, art.log(0.02, 0.06)) * uneven(art), art.log(2.0, 6.0), DARK)


def marking(art: Painting, s: float, a: float) -> None:
    """A painted arrow, cross, tee or numeral: strokes with sharp sides."""
    size, width = art.uniform(0.25, 0.7), art.uniform(0.05, 0.12)
    strokes = {
        "arrow": [[(-1, 0), (1, 0)], [(0.3, 0.6), (1, 0), (0.3, -0.6)]],
        "cross": [[(-0.8, -0.8), (0.8, 0.8)], [(-0.8, 0.8), (0.8, -0.8)]],
        "tee": [[(-0.8, 0.8), (0.8, 0.8)], [(0, 0.8), (0, -0.8)]],
        "seven": [[(-0.5, 0.9), (0.5, 0.9), (-0.1, -0.9)]],
        "five": [[(0.5, 0.9), (-0.4, 0.9), (-0.4, 0.1), (0.4, 0.1), (0.5, -0.8), (-0.4, -0.9)]],
    }
    lines = strokes[str(art.rng.choice(list(strokes)))]
    shape = shapely.union_all([LineString(np.array(line) * size).buffer(width, cap_style="flat") for line in lines])
    art.paint(art.cover(affinity.translate(shape, s, a)), art.log(2.0, 6.0), DARK)


def damp_repair(art: Painting, s: float, a: float) -> None:
    """Mortar that was put on by hand: of irregular outline, sharp, and even as water hardly is."""
    shape = blob(art, s, a, art.log(0.1, 1.5), art.uniform(0.6, 1.5))
    art.paint(art.cover(shape), art.log(1.8, 5.0), DARK)


def salted(art: Painting, s: float, a: float) -> None:
    """A leak with bright salts about it."""
    before = art.drop.copy()
    patch(art, s, a)
    wet = (art.drop > before + 0.3) & (art.kind == LEAK)
    rim = ndimage.binary_dilation(wet, iterations=int(art.uniform(4, 10))) & ~ndimage.binary_dilation(wet)
    art.drop[rim & (art.drop < 0.3)] -= art.uniform(1.5, 4.0)


def old_stain(art: Painting, s: float, a: float) -> None:
    """Paint a former leak: a patch shaped like a leak, a little fainter, with nothing around it."""
    shape = blob(art, s, a, art.log(0.06, 2.0), art.uniform(0.5, 2.5))
    art.paint(art.cover(shape, art.log(0.006, 0.08)) * uneven(art), art.log(1.5, 6.0), DARK)


def rust_run(art: Painting, s: float, a: float) -> None:
    """Rust that runs down the wall from an anchor: narrow, tapering, soft at its sides."""
    down, length, half = (1.0 if a >= 0 else -1.0), art.uniform(0.5, 1.4), art.uniform(0.05, 0.12)
    top = a - 0.5 * down * length
    shape = Polygon(
        [(s - half, top), (s + half, top), (s + 0.3 * half, top + down * length), (s - 0.3 * half, top + down * length)]
    )
    art.paint(art.cover(shape.union(Point(s, top).buffer(1.4 * half)), art.log(0.01, 0.03)), art.log(2.0, 6.0), DARK)


def tar_band(art: Painting, s: float, a: float) -> None:
    """Tar brushed over a joint around the tunnel: wider than the joint, with ragged sides, even."""
    t = np.linspace(a - 1.3, a + 1.3, 60)
    sides = [art.uniform(0.08, 0.16) + ndimage.gaussian_filter(art.rng.normal(0, 0.05, len(t)), 1.5) for _ in range(2)]
    shape = Polygon([*zip(s - sides[0], t, strict=True), *zip((s + sides[1])[::-1], t[::-1], strict=True)]).buffer(0)
    art.paint(art.cover(shape), art.log(3.0, 7.0), DARK)


def moss(art: Painting, s: float, a: float) -> None:
    """Moss: many small patches close together, soft and uneven."""
    for _ in range(art.rng.integers(4, 9)):
        shape = blob(art, s + art.uniform(-0.8, 0.8), a + art.uniform(-0.8, 0.8), art.log(0.04, 0.25))
        art.paint(art.cover(shape, art.log(0.015, 0.04)) * uneven(art), art.log(1.5, 4.0), DARK)


USUAL = tuple(THINGS)
OWNERS: dict[str, tuple[tuple[Maker, float], ...]] = {
    "as elsewhere": USUAL,
    "soot stripes": (*USUAL, (soot_stripe, 15.0)),
    "painted markings": (*USUAL, (marking, 15.0)),
    "damp-looking repairs": (*USUAL, (damp_repair, 15.0)),
    "salts tell": (*((make, share) for make, share in USUAL if make is not patch), (salted, 8.0), (old_stain, 12.0)),
    "rust runs": (*USUAL, (rust_run, 15.0)),
    "tarred joints": (*USUAL, (tar_band, 15.0)),
    "moss": (*USUAL, (moss, 8.0)),
}
"""What an owner's tunnels show, and how often in proportion: what tunnels usually do, and what is their own."""


@dataclass(frozen=True)
class Tunnel:
    """Dark regions of a tunnel, in order of chainage: features, whether each is a leak, and its picture."""

    features: Array
    leak: NDArray[np.bool_]
    picture: NDArray[np.int64]

    def reviewed(self, start: int, count: int) -> Reviewed:
        """The first regions from a picture on, as reviews; behind the last picture comes the first."""
        order = np.argsort((self.picture - start) % FIRST, kind="stable")
        place = np.empty(len(order))
        place[order] = (self.picture[order] - start) % FIRST * LONG
        place += np.arange(len(order)) % 16 * (LONG / 16)  # somewhere in its picture
        rows = order[:count]
        ones = np.ones(len(rows))
        return Reviewed(self.features[rows], ones, self.leak[rows], np.ones(len(rows), np.int64), place[rows])


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.learning", description=__doc__.splitlines()[0])
    parser.add_argument("--regions", type=Path, help="where painted regions are kept")
    parser.add_argument("--owners", nargs="+", choices=OWNERS, default=list(OWNERS), metavar="OWNER", help=", ".join(OWNERS))
    arguments = parser.parse_args()
    rows, missing, ways = [], [], []
    for owner in arguments.owners:
        first, second = (tunnel_of(owner, other, arguments.regions) for other in (False, True))
        errors, missed, chosen = zip(*(inspections(first, second, count) for count in REVIEWS), strict=True)
        halved = next((str(count) for count, wrong in zip(REVIEWS, errors, strict=True) if wrong <= 0.5 * errors[0]), "-")
        rows.append((owner, len(second.leak), int(second.leak.sum()), *(f"{wrong:.1f}" for wrong in errors), halved))
        missing.append((owner, *(f"{lost:.1f}" for lost in missed)))
        ways.append((owner, *chosen))
    head = [str(count) for count in REVIEWS]
    print_table(
        f"errors in an owner's second tunnel after reviews in the first, mean of {STARTS} inspections",
        ("owner", "regions", "leaks", *head, "halved by"),
        rows,
    )
    print_table("of these, leaks that are taken for none", ("owner", *head), missing)
    print_table(f"what was chosen: {' / '.join(get_args(Way))}", ("owner", *head), ways)


def inspections(first: Tunnel, second: Tunnel, count: int) -> tuple[float, float, str]:
    """Mean number of errors in the second tunnel after so many reviews in the first, of missed leaks in them, and the ways."""
    model = standard_model()
    wrong, missed, ways = [], [], []
    for start in range(0, FIRST, FIRST // STARTS):
        adjustment = learn(model, first.reviewed(start, count)).adjustment if count else Adjustment()
        called = adjustment.apply(model, "learned").probabilities(second.features) >= 0.5
        wrong.append(np.count_nonzero(called != second.leak))
        missed.append(np.count_nonzero(second.leak & ~called))
        ways.append(adjustment.way)
    return (
        float(np.mean(wrong)),
        float(np.mean(missed)),
        "/".join(str(ways.count(way)) for way in get_args(Way)),
    )


def tunnel_of(owner: str, second: bool, folder: Path | None) -> Tunnel:
    """One of an owner's tunnels; painted, if the folder does not hold it."""
    name = f"{owner} {2 if second else 1}"
    path = None if folder is None else folder / f"{name.replace(' ', '_')}.npz"
    if path is not None and path.is_file():
        return Tunnel(**np.load(path))
    seed = SEED + 1000 * list(OWNERS).index(owner) + 500 * second
    found = []
    for k in range(SECOND if second else FIRST):
        progress(f"{name}: picture {k + 1}")
        found += [(features, kind == LEAK, k) for features, kind, _ in painted(owner, seed + k)]
    features, leak, picture = zip(*found, strict=True)
    tunnel = Tunnel(np.array(features), np.array(leak), np.array(picture))
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(path, features=tunnel.features, leak=tunnel.leak, picture=tunnel.picture)
    return tunnel


def painted(owner: str, seed: int) -> list[tuple[Array, int, float]]:
    """Dark regions of a picture of an owner's tunnel."""
    art = Painting(seed)
    makers = [make for make, _ in OWNERS[owner]]
    often = np.array([share for _, share in OWNERS[owner]])
    for s in np.arange(CELL / 2, LONG, CELL):
        for a in (-HALF + CELL / 2, 0.1, HALF - CELL / 2):
            makers[art.rng.choice(len(makers), p=often / often.sum())](art, float(s), float(a))
    return list(art.regions())


if __name__ == "__main__":
    main()
