"""Leaks found against those put in, and the figures of Table 1 of Xu et al. (2018), on simulated tunnels.

    python -m benchmarks.leaks [--scanner static] [--seed 1] [--section circular]

For leaks of 0.1 m² and more: area F1 and IoU of the union of all polygons, and the mean IoU of single leaks.
A detected polygon that only meets smaller true leaks neither counts nor harms.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import shapely
from shapely.geometry.base import BaseGeometry

from benchmarks.common import print_table, progress, save, scratch_database
from benchmarks.scene import APPENDAGE, FLOOR, RAIL, Scene
from tunneldb.database import connect

Figures = dict[str, Any]

SMALLEST = 0.1
LEAK_HEADER = (
    "scanner", "seed", "true", "found", "area F1", "area IoU", "mean IoU", "missed", "false", "on appendage",
    "on floor",
)  # fmt: skip
TABLE_1_HEADER = (
    "scanner", "seed", "km", "sigma raw", "Lambert", "Oren-Nayar", "noise put in",
    "roughness", "true roughness",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--section", default="circular", choices=("circular", "horseshoe", "box"))
    parser.add_argument("--scanner", action="append", choices=("profiler", "static"))
    parser.add_argument("--seed", action="append", type=int)
    parser.add_argument("--length", type=float, default=120.0)
    arguments = parser.parse_args()
    leaks: list[Figures] = []
    table_1: list[Figures] = []
    for scanner in arguments.scanner or ("static", "profiler"):
        for seed in arguments.seed or (1, 2, 3):
            progress(f"{scanner}, seed {seed}")
            found, radiometry = measure(arguments.dsn, arguments.section, seed, scanner, arguments.length)
            case: Figures = {"scanner": scanner, "seed": seed}
            leaks.append(case | found)
            table_1 += [case | row for row in radiometry]
    print_table(f"Leaks of {SMALLEST} m² and more", LEAK_HEADER, [list(row.values()) for row in leaks])
    print_table("Dry lining, dB and degrees", TABLE_1_HEADER, [list(row.values()) for row in table_1])
    save("leaks", {"section": arguments.section, "leaks": leaks, "table_1": table_1})


def measure(dsn: str | None, section: str, seed: int, scanner: str, length: float) -> tuple[Figures, list[Figures]]:
    """Figures of one simulated tunnel: of its leaks, and of its kilometres' radiometry."""
    with tempfile.TemporaryDirectory() as folder, scratch_database(dsn) as database:
        scene = Scene.simulate(
            Path(folder),
            "tunnel",
            "--section",
            section,
            "--length",
            length,
            "--scanner",
            scanner,
            "--seed",
            seed,
        )
        scene.register(database)
        scene.load(database)
        scene.run(database)
        with connect(database) as connection:
            return compare(scene, found_leaks(connection, scene.name)), radiometry(connection, scene)


def found_leaks(connection: psycopg.Connection, survey: str) -> list[BaseGeometry]:
    rows = connection.execute(
        "SELECT public.ST_AsBinary(l.unrolled) FROM tunnel.anomaly AS l"
        " JOIN tunnel.survey AS s ON s.id = l.survey_id WHERE s.name = %s ORDER BY l.id",
        (survey,),
    ).fetchall()
    return list(shapely.from_wkb([bytes(row[0]) for row in rows]))


def compare(scene: Scene, found: list[BaseGeometry]) -> Figures:
    """Compare found with true leaks in the unrolled plane."""
    large = [leak for leak in scene.leaks if leak.area >= SMALLEST]
    small = shapely.union_all([leak for leak in scene.leaks if leak.area < SMALLEST])
    true = shapely.union_all(large)
    judged = [polygon for polygon in found if polygon.intersects(true) or not polygon.intersects(small)]
    detected = shapely.union_all(judged)
    common = true.intersection(detected).area
    return {
        "true": len(large),
        "found": len(judged),
        "area_f1": 2 * common / (true.area + detected.area),
        "area_iou": common / true.union(detected).area,
        "mean_iou": float(np.mean([leak_iou(leak, judged) for leak in large])),
        "missed": sum(not leak.intersects(detected) for leak in large),
        "false": sum(not polygon.intersects(true) for polygon in judged),
        "on_appendage": lying_on(scene, judged, [APPENDAGE]),
        "on_floor": lying_on(scene, judged, [FLOOR, RAIL]),
    }


def leak_iou(leak: BaseGeometry, found: list[BaseGeometry]) -> float:
    """IoU of one true leak with all polygons that touch it."""
    touching = shapely.union_all([polygon for polygon in found if polygon.intersects(leak)])
    return float(leak.intersection(touching).area / leak.union(touching).area)


def lying_on(scene: Scene, found: list[BaseGeometry], classes: list[int]) -> int:
    """Count polygons in which at least half the points are of any of some classes."""
    truth = scene.truth
    order = np.argsort(truth["chainage"])
    chainage = truth["chainage"][order]
    count = 0
    for polygon in found:
        west, _, east, _ = polygon.bounds
        near = order[np.searchsorted(chainage, west) : np.searchsorted(chainage, east)]
        inside = near[shapely.contains_xy(polygon, truth["chainage"][near], truth["arc"][near])]
        count += bool(len(inside)) and float(np.isin(truth["class"][inside], classes).mean()) >= 0.5
    return count


def radiometry(connection: psycopg.Connection, scene: Scene) -> list[Figures]:
    """Per kilometre: deviations of the dry lining and roughness, with what the simulation put in."""
    rows = connection.execute(
        "SELECT r.km, r.sigma_raw, r.sigma_lambert, r.sigma_oren_nayar, r.roughness"
        " FROM tunnel.radiometry AS r JOIN tunnel.survey AS s ON s.id = r.survey_id"
        " WHERE s.name = %s ORDER BY r.km",
        (scene.name,),
    ).fetchall()
    noise, roughness = scene.parameters["intensity_noise"], scene.parameters["roughness"]
    names = ("km", "sigma_raw", "sigma_lambert", "sigma_oren_nayar")
    return [
        dict(zip(names, row[:4], strict=True)) | {"noise": noise, "roughness": row[4], "true_roughness": roughness}
        for row in rows
    ]


if __name__ == "__main__":
    main()
