"""Detectability of leaks, as stated from synthetic leaks injected into a survey's own images, against its true leaks.

    python -m benchmarks.detectability                    # all tunnels, about 10 minutes on two cores
    python -m benchmarks.detectability --only d500 brick  # tunnels with one of these in their names
    python -m benchmarks.detectability --table            # from the results stored last

The true leaks are those of ``tunneldb simulate``, whose shapes are drawn by other rules than those of the injected ones. Of the
leaks that are said to be found with 90 % and more, 85 to 95 % should be.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise, product
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from scipy import ndimage
from shapely.geometry import shape

from benchmarks.common import RESULTS, print_table, progress, save, scratch_database
from benchmarks.scene import Scene
from tunneldb.anomalies.background.contrast import ContrastImage
from tunneldb.anomalies.background.relate import relate
from tunneldb.anomalies.detect import Detection, find_anomalies
from tunneldb.anomalies.detectability.chance import Chance
from tunneldb.anomalies.detectability.conditions import Conditions, measure_conditions
from tunneldb.anomalies.detectability.pieces import Pieces
from tunneldb.anomalies.detectability.trials import MIN_OVERLAP
from tunneldb.arrays import Bool
from tunneldb.database import connect
from tunneldb.pipeline import detect as stage
from tunneldb.raster.image import LiningImage
from tunneldb.raster.polygons import mask_of_polygons
from tunneldb.raster.state import PixelState
from tunneldb.segmentation.network import standard_network
from tunneldb.stages.parameters import settings
from tunneldb.store.survey import get_survey

COMMON = (
    "--length", 60, "--station-spacing", 12, "--leaks", 45, "--leak-area", 0.06, 2.0, "--leak-drop", 0.8, 8,
)  # fmt: skip
TUNNELS: dict[str, tuple[object, ...]] = {
    "d1500 plain": ("--density", 1500, "--section", "horseshoe", "--seed", 1),
    "d500 plain": ("--density", 500, "--section", "horseshoe", "--seed", 3),
    "d500 segments": ("--density", 500, "--lining", "segments", "--intensity-noise", 0.6, "--seed", 4),
    "d150 plain": ("--density", 150, "--section", "horseshoe", "--seed", 5),
    "d150 segments": ("--density", 150, "--lining", "segments", "--intensity-noise", 0.6, "--seed", 6),
    "d60 segments": ("--density", 60, "--lining", "segments", "--intensity-noise", 0.6, "--seed", 8),
    **{
        f"sparse d{density} n{noise}": (
            "--density", density, "--lining", "segments", "--intensity-noise", noise, "--seed", 40 + k,
        )
        for k, (density, noise) in enumerate(product((50, 100, 150, 500), (0.3, 0.6, 1.2)))
    },
    "profiles 0.5": ("--scanner", "profiler", "--profile-spacing", 0.5, "--lining", "segments", "--seed", 35),
    "profiles 0.1": ("--scanner", "profiler", "--profile-spacing", 0.1, "--section", "horseshoe", "--seed", 31),
    "profiles 0.25": ("--scanner", "profiler", "--profile-spacing", 0.25, "--lining", "cast", "--seed", 32),
    "brick": ("--density", 1500, "--section", "horseshoe", "--lining", "brick", "--intensity-noise", 0.5, "--seed", 33),
    "dirty segments": (
        "--density", 1500, "--lining", "segments", "--intensity-noise", 0.5, "--joint-leaks", 4, "--soot", 3, "--paint", 3,
        "--patches", 4, "--seed", 34,
    ),
}  # fmt: skip
CERTAIN = 0.9
MARGIN = 0.2
"""Width of a true leak's rim that belongs to it, m."""
DEMAND = (0.3, 3.0)
"""A leak of this area, m², and darkening, dB."""
STATED = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
NAME = "detectability"
HEADER = ("tunnel", "pixel m", "injected", "found", "true", "found", "stated", "p ≥ 0.9", "of these found", "0.3 m², 3 dB")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.detectability", description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", default=[""], metavar="WORD")
    parser.add_argument("--table", action="store_true", help="print the results stored last; run nothing")
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    arguments = parser.parse_args()
    if arguments.table:
        found = json.loads((RESULTS / f"{NAME}.json").read_text())["tunnels"]
    else:
        chosen = [name for name in TUNNELS if any(word in name for word in arguments.only)]
        found = [dict(measure(name, arguments.dsn), tunnel=name) for name in chosen]
        save(NAME, {"tunnels": found})
    report(found)


def measure(name: str, dsn: str | None) -> dict[str, Any]:
    """Return what is stated for the true leaks of a tunnel, and which of them were found."""
    progress(name)
    with tempfile.TemporaryDirectory() as folder, scratch_database(dsn) as scratch:
        scene = Scene.simulate(Path(folder), NAME, *COMMON, *TUNNELS[name])
        scene.register(scratch)
        scene.load(scratch)
        scene.run(scratch, last="ground")
        picture = picture_of(scratch)
        features = json.loads(scene.file("truth.geojson").read_text())["features"]
    pieces = Pieces.of(picture)
    contrast, found = search(copied(picture))
    conditions = measure_conditions(contrast, found.dark, found.size)
    trials = pieces.try_out(found.dark, conditions, wet_pixels)
    chance = Chance.fit(trials)
    shown = [(one, mask) for one in features if (mask := mask_of(picture, one)).any()]
    masks = [mask for _, mask in shown]
    stated = chance.probability(
        np.array([shape(one["geometry"]).area for one, _ in shown]),
        np.array([one["properties"]["drop_db"] for one, _ in shown]),
        np.array([at(before(contrast, found, mask), mask) for mask in masks]),
    )
    typical = np.median(conditions.values[:, conditions.seen > 0], axis=1)
    return {
        "pixel": picture.grid.pixel,
        "injected": len(trials.found),
        "injected_found": int(trials.found.sum()),
        "stated": stated.tolist(),
        "found": [bool((found.wet & mask).sum() >= MIN_OVERLAP * mask.sum()) for mask in masks],
        "demand": float(chance.probability(np.array([DEMAND[0]]), np.array([DEMAND[1]]), typical[None])[0]),
    }


def picture_of(dsn: str) -> LiningImage:
    """Return the picture in which the stage ``detect`` would search for leaks."""
    values = settings()
    with connect(dsn) as conn, picture_taken() as taken:
        inputs = stage.load_inputs(conn, get_survey(conn, NAME), 0, values)
        assert inputs.sample is not None
        stage.compute_detection(inputs, inputs.sample, values, lambda grid, window: None, lambda share: None)
    return taken[0]


@contextmanager
def picture_taken() -> Iterator[list[LiningImage]]:
    """Keep copies of the pictures whose background is mapped meanwhile."""
    taken: list[LiningImage] = []
    original = stage.relate

    def tap(picture: LiningImage, *rest: Any) -> Any:
        taken.append(copied(picture))
        return original(picture, *rest)

    with mock.patch.object(stage, "relate", tap):
        yield taken


def copied(picture: LiningImage) -> LiningImage:
    return LiningImage(picture.grid, picture.state.copy(), picture.level.copy(), picture.gaps)


def search(picture: LiningImage) -> tuple[ContrastImage, Detection]:
    """Detect leaks in a picture, which is overwritten."""
    background, contrast = relate(picture, [], standard_network())
    return contrast, find_anomalies(contrast, background, settings()["leak.min_area"])


def wet_pixels(picture: LiningImage) -> Bool:
    return search(picture)[1].wet


def mask_of(picture: LiningImage, leak: dict[str, Any]) -> Bool:
    """Mark the lining on which a true leak lies."""
    mask = np.zeros(picture.state.shape, np.bool_)
    for columns, part in mask_of_polygons(picture.grid, [shape(leak["geometry"])]):
        mask[:, columns] |= part
    return mask & (picture.state <= PixelState.RECESS)


def before(contrast: ContrastImage, found: Detection, mask: Bool) -> Conditions:
    """Return the conditions without a leak: its own darkness is no clutter, as for injected leaks."""
    around = ndimage.binary_dilation(mask, iterations=round(MARGIN / contrast.grid.pixel))
    return measure_conditions(contrast, found.dark & ~around, found.size)


def at(conditions: Conditions, mask: Bool) -> np.ndarray:
    """Return the conditions in the middle of a leak."""
    row, column = (int(place.mean()) // conditions.tile for place in np.nonzero(mask))
    return conditions.values[:, row, column]


def report(found: list[dict[str, Any]]) -> None:
    rows = []
    for one in found:
        stated, seen = np.array(one["stated"]), np.array(one["found"])
        certain = stated >= CERTAIN
        share = f"{seen[certain].mean():.2f}" if certain.any() else "–"
        rows.append(
            (one["tunnel"], one["pixel"], one["injected"], f"{one['injected_found'] / one['injected']:.2f}", len(seen),
             f"{seen.mean():.2f}", f"{stated.mean():.2f}", int(certain.sum()), share, f"{one['demand']:.2f}")
        )  # fmt: skip
    print_table("detectability", HEADER, rows)
    stated, seen = (np.concatenate([np.array(one[key], float) for one in found]) for key in ("stated", "found"))
    classes = np.digitize(stated, STATED[1:-1])
    print_table(
        "true leaks by stated probability",
        ("stated", "mean", "number", "found"),
        [
            (f"{low:g} to {high:g}", f"{stated[here].mean():.2f}", int(here.sum()), f"{seen[here].mean():.2f}")
            for k, (low, high) in enumerate(pairwise(STATED))
            if (here := classes == k).any()
        ],
    )


if __name__ == "__main__":
    main()
