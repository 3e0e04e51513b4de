"""Clearance: margins against shapely's, tracks against rails that are known, and the time of a long tunnel.

python -m benchmarks.clearance                       # seconds
python -m benchmarks.clearance --km 25 --points 60000000   # and a synthetic tunnel, minutes
python -m benchmarks.clearance --survey demo-2024 --truth scan/demo.json   # and a simulated survey
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import tempfile
import time
from dataclasses import fields
from pathlib import Path

import numpy as np
import shapely

from benchmarks.common import print_table, save, scratch_database
from benchmarks.synthetic import Size, make
from tunneldb.classification.classes import PointClass
from tunneldb.database import connect
from tunneldb.measures.clearance.compute.clearance import clearance
from tunneldb.measures.clearance.compute.gauge import Widening, halved, overthrow, widened
from tunneldb.measures.clearance.compute.track import fit_track, follow, rail_pairs
from tunneldb.measures.clearance.measure import Options, find_tracks, measure_kilometre, read_track
from tunneldb.measures.clearance.rows import load_classed, save_gauge
from tunneldb.simulate.parameters import Parameters
from tunneldb.store.surface import load_alignment
from tunneldb.store.survey import get_survey

sys.path.append(str(Path(__file__).parent.parent / "tests"))
from support.rails import BOX, rails

CORNERS = np.array([[-1.6, 0.3], [-1.6, 3.0], [-1.0, 4.3], [1.0, 4.3], [1.6, 3.0], [1.6, 0.3]])


def margins() -> list[tuple[object, ...]]:
    """Greatest difference of margins from shapely's, µm, of an example outline widened in curves."""
    rng = np.random.default_rng(1)
    rows: list[tuple[object, ...]] = []
    for radius in (np.inf, 1000.0, 300.0, 150.0):
        inward, outward = (float(v[0]) for v in overthrow(14.0, 4.0, np.array([1.0 / radius])))
        ends = CORNERS.copy()
        ends[:3, 0] -= outward
        ends[3:, 0] += inward
        polygon = shapely.Polygon(ends)
        points = np.column_stack([rng.uniform(0.0, 10.0, 20000), rng.uniform(-3, 3, 20000), rng.uniform(-0.5, 6.0, 20000)])
        found = clearance(
            points, np.full(20000, PointClass.LINING, np.uint8), np.arange(10.0), [widened(halved(BOX), outward, inward)] * 10
        ).margin  # fmt: skip
        away = shapely.distance(polygon.exterior, shapely.points(points[:, 1:]))
        away = np.where(shapely.contains_xy(polygon, *points[:, 1:].T), -away, away)
        rows.append((radius, round(1e3 * inward, 2), round(1e3 * outward, 2), f"{1e6 * np.abs(found - away).max():.3g}"))
    return rows


def tracks() -> list[tuple[object, ...]]:
    """Errors of tracks fitted to rails that are known, mm: 20 points a metre and rail."""
    rows: list[tuple[object, ...]] = []
    for cant, bend in ((0.0, 0.0), (0.1, 0.0), (0.06, 1 / 2e5)):
        rng = np.random.default_rng(4)
        points = rails(0.1, cant, rng, bend, 1000.0)
        track = fit_track(points, follow(rail_pairs(points))[0], 0.0, 1000.0)
        errors = np.stack([track.right - 0.1 - bend * track.chainage**2 / 2, track.up + 2.5, track.cant - cant])
        stated = 1e3 * np.array([track.right_se.mean(), track.up_se.mean(), track.cant_se.mean()])
        rms, most = 1e3 * np.sqrt((errors**2).mean(axis=1)), 1e3 * np.abs(errors).max(axis=1)
        rows.append((1e3 * cant, bend, round(100 * float(track.seen.mean())), *np.round([*rms, *most, *stated], 2).tolist()))
    return rows


def simulated(name: str, truth: Path) -> list[tuple[object, ...]]:
    """Errors of the track found in a simulated survey, mm, against the rails of the simulation."""
    told = json.loads(truth.read_text("utf-8"))["parameters"]
    known = {field.name for field in fields(Parameters)}
    line = Parameters(**{key: value for key, value in told.items() if key in known}).tunnel().line
    with connect(None) as conn:
        survey = get_survey(conn, name)
        axis = load_alignment(conn, survey, 1.0)
        rough = next(iter(find_tracks(conn, survey).rough.values()))
        km = int(rough.chainage[0] // 1000)
        xyz, _ = load_classed(conn, survey, km, -np.inf, np.inf, rails=True)
    points = axis.across(xyz)
    track = fit_track(points[np.isfinite(points[:, 0])], rough, -np.inf, np.inf)
    base = axis.plan_points(track.chainage, track.right)
    frame = line.frame(track.chainage)
    for _ in range(3):  # the true place beside the one found
        along = ((base - frame.position[:, :2]) * frame.t[:, :2]).sum(axis=1)
        frame = line.frame(track.chainage + along)
    right = ((base - frame.position[:, :2]) * frame.u[:, :2]).sum(axis=1)
    errors = np.stack([right, track.cant])
    rms, most = 1e3 * np.sqrt((errors**2).mean(axis=1)), 1e3 * np.abs(errors).max(axis=1)
    stated = 1e3 * np.array([track.right_se.mean(), track.cant_se.mean()])
    return [(name, len(errors[0]), round(100 * float(track.seen.mean())), *np.round([*rms, *most, *stated], 2).tolist())]


def timed(kilometres: int, points: int, folder: Path) -> list[tuple[object, ...]]:
    """Seconds and most memory of a synthetic tunnel whose track is given."""
    lane = folder / "lane.csv"
    lane.write_text(f"chainage,right,up\n0,0.1,-2.3\n{1000 * kilometres},0.1,-2.3\n")

    with scratch_database(None) as dsn, connect(dsn) as conn:
        make(conn, "demo-2024", Size(kilometres, 100, points, 10, 10))
        conn.commit()
        survey = get_survey(conn, "demo-2024")
        axis = load_alignment(conn, survey, 1.0)
        tracks = read_track(lane, axis)
        save_gauge(conn, survey, "example", BOX, "example")
        began = time.perf_counter()
        for km in range(kilometres):
            measure_kilometre(
                conn, survey, km, axis, tracks, "given", "example", BOX, Options(widening=Widening(14.0, 4.0)), (0.0, 1e9)
            )  # fmt: skip
            conn.commit()
        taken = time.perf_counter() - began
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return [(kilometres, round(points / 1e6, 1), round(taken, 1), round(memory))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--km", type=int, default=0, help="length of the synthetic tunnel")
    parser.add_argument("--points", type=int, default=0)
    parser.add_argument("--survey", help="a simulated survey with its stages run")
    parser.add_argument("--truth", type=Path, help="its .json")
    options = parser.parse_args()
    results = {"margins": margins(), "tracks": tracks()}
    print_table(
        "margins against shapely's", ("radius m", "inside mm", "outside mm", "greatest difference µm"), results["margins"]
    )
    header = (
        "cant mm",
        "bend 1/m",
        "seen %",
        *(f"{k} {n}" for k in ("rms", "most", "stated") for n in ("right", "up", "cant")),
    )
    print_table("tracks against known rails, mm", header, results["tracks"])
    if options.survey:
        results["simulated"] = simulated(options.survey, options.truth)
        header = ("survey", "stations", "seen %", *(f"{k} {n}" for k in ("rms", "most", "stated") for n in ("right", "cant")))
        print_table("a simulated survey's track, mm", header, results["simulated"])
    if options.km:
        with tempfile.TemporaryDirectory() as folder:
            results["timed"] = timed(options.km, options.points, Path(folder))
        print_table("a tunnel", ("km", "million points", "seconds", "most memory MB"), results["timed"])
    save("clearance", results)


if __name__ == "__main__":
    main()
