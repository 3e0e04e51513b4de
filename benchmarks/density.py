"""Full density: LAZ decoding, unrolling and detection, points per second."""

from __future__ import annotations

import time
from pathlib import Path

import laspy

from benchmarks.common import print_table
from benchmarks.scene import Scene
from tunneldb.database import connect
from tunneldb.pointcloud.reader import read_chunks
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import get_survey

CHUNK = 1_000_000


def measure(dsn: str, folder: Path, length: float, seed: int) -> dict[str, float]:
    """Simulate a profiler's tunnel at full density and time what is done per point."""
    scene = Scene.simulate(folder, "dense", "--length", length, "--scanner", "profiler", "--seed", seed)
    points = len(scene.xyz)
    scene.register(dsn)
    load = scene.load(dsn)
    scene.run(dsn, "axis", "ground")
    detect = scene.run(dsn, "detect", "detect")
    with connect(dsn) as connection:
        surface = load_surface(connection, get_survey(connection, scene.name))
    surface.unroll(scene.xyz[:1000])
    start = time.perf_counter()
    surface.unroll(scene.xyz)
    unroll = time.perf_counter() - start
    return {
        "points": points,
        "laspy": points / laspy_seconds(scene.scans),
        "read_chunks": points / reader_seconds(scene.scans),
        "load": points / load,
        "unroll": points / unroll,
        "detect": points / detect,
    }


def laspy_seconds(files: list[Path]) -> float:
    """Decode files with laspy, all dimensions."""
    start = time.perf_counter()
    for file in files:
        with laspy.open(file) as reader:
            for chunk in reader.chunk_iterator(CHUNK):
                _ = chunk.X[-1]
    return time.perf_counter() - start


def reader_seconds(files: list[Path]) -> float:
    """Read files as the pipeline does: decoded, scaled, with one dimension of intensity."""
    start = time.perf_counter()
    for file in files:
        for _ in read_chunks(file, "Amplitude"):
            pass
    return time.perf_counter() - start


def report(figures: dict[str, float]) -> None:
    """Print the rates."""
    names = {
        "laspy": "LAZ decoding (laspy)",
        "read_chunks": "reading (decoded, scaled, one intensity)",
        "load": "load (noise filter, thinning, COPY)",
        "unroll": "unrolling in Python",
        "detect": "detection (reading to polygons)",
    }
    rows = [(text, f"{figures[name] / 1e6:.2f}") for name, text in names.items()]
    print_table(f"Full density, {figures['points']:,} points", ("step", "million points/s"), rows)
