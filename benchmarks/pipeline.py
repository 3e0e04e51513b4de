"""Our own way at survey density, by the commands that a user gives, and the bare COPY to compare it with."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import laspy
import psycopg
from psycopg import sql

from benchmarks.scene import Scene
from tunneldb.database import connect
from tunneldb.pointcloud.thinning import thin, voxel_edge
from tunneldb.store.survey import get_survey

SURVEY_DENSITY = 100.0  # points/m²
STAGES = ("axis", "segments", "sections")


def measure(dsn: str, folder: Path, scene: Scene) -> dict[str, Any]:
    """Load the scene and run it to its sections; seconds by the clock, of the stages by the ledger."""
    compile_ahead(dsn, folder)
    scene.register(dsn)
    load = scene.load(dsn)
    run = scene.run(dsn, "axis", "sections")
    with connect(dsn) as connection:
        survey = get_survey(connection, scene.name).id
        stages = dict(
            connection.execute(
                "SELECT stage, sum(extract(epoch FROM finished_at - started_at))::float8 FROM tunnel.run"
                " WHERE survey_id = %s AND outcome = 'done' GROUP BY stage",
                (survey,),
            ).fetchall()
        )
        counted = connection.execute(
            "SELECT sum(points)::int8, sum(noise)::int8, sum(thinned)::int8, sum(kept)::int8"
            " FROM tunnel.scan_file WHERE survey_id = %s",
            (survey,),
        ).fetchone()
        axis = connection.execute(
            "SELECT parameters, counts FROM tunnel.run WHERE survey_id = %s AND stage = 'axis' ORDER BY id DESC",
            (survey,),
        ).fetchone()
    assert counted is not None
    assert axis is not None
    seconds = {"load": load} | {stage: stages[stage] for stage in STAGES}
    seconds |= {"start-up of run": run - sum(seconds[stage] for stage in STAGES), "total": load + run}
    counts = dict(zip(("points", "noise", "thinned", "kept"), counted, strict=True))
    return {"seconds": seconds, "axis_parameters": axis[0], "axis_passes": axis[1]["iterations"]} | counts


def survey_density(folder: Path, length: float, seed: int) -> Scene:
    """Simulate a tunnel and decimate its file to survey density, as the paper's authors did beforehand.

    Decimation by our own rule leaves nothing to thin, so that we and the peer load the same rows.
    """
    scene = Scene.simulate(folder, "survey", "--length", length, "--density", 4 * SURVEY_DENSITY, "--seed", seed)
    for file in scene.scans:
        las = laspy.read(file)
        las.points = las.points[thin(las.xyz, voxel_edge(SURVEY_DENSITY))]
        las.write(file)
    return scene


def compile_ahead(dsn: str, folder: Path) -> None:
    """Run a short tunnel first, so that Numba's cache is filled, as it is on any but the very first use."""
    scene = Scene.simulate(folder, "warm", "--length", 40, "--density", SURVEY_DENSITY)
    scene.register(dsn)
    scene.load(dsn)
    scene.run(dsn, "axis", "sections")


def bare_copy(dsn: str, survey: str) -> dict[str, Any]:
    """Seconds of a binary COPY of the survey's rows into a table with the same columns and no index.

    The table is made in the same transaction, as the pipeline does, which spares the embedded server the WAL.
    """
    with psycopg.connect(dsn) as connection, connection.cursor() as cursor:
        cursor.execute(
            "SELECT column_name FROM information_schema.columns"
            " WHERE table_schema = 'tunnel' AND table_name = 'point' ORDER BY ordinal_position"
        )
        columns = sql.SQL(", ").join(sql.Identifier(row[0]) for row in cursor)
        rows = sql.SQL("SELECT {} FROM tunnel.point WHERE survey_id = {}").format(columns, get_survey(connection, survey).id)
        with cursor.copy(sql.SQL("COPY ({}) TO STDOUT (FORMAT binary)").format(rows)) as source:
            blocks = b"".join(source)
        connection.commit()
        start = time.perf_counter()
        cursor.execute("CREATE TABLE public.bare (LIKE tunnel.point)")
        with cursor.copy(sql.SQL("COPY public.bare ({}) FROM STDIN (FORMAT binary)").format(columns)) as copy:
            for at in range(0, len(blocks), 1 << 20):
                copy.write(blocks[at : at + (1 << 20)])
        count = cursor.rowcount
        connection.commit()
        seconds = time.perf_counter() - start
        cursor.execute("DROP TABLE public.bare")
    return {"rows": count, "bytes": len(blocks), "seconds": seconds}
