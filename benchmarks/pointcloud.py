"""A kilometre of points as rows (tunneldb) and as patches (pgPointcloud): loading, size on disk, and five questions.

    python -m benchmarks.pointcloud
    python -m benchmarks.pointcloud --length 200 --repeat 3

Both read the same LAZ file, keep every point, compute its chainage along the same axis and store the points in its order. The
patches are what pgPointcloud is at its best with: 400 to 600 points each, cut where segments end, so that no question about a
segment opens one; packed by NumPy, written by one COPY; chainage as a dimension of its own, its bounds beside the patch with an
index, GiST on the envelopes. Each question is put to each in the way that suits it best; the answers are compared.
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import psycopg
from numpy.typing import NDArray
from psycopg import sql

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from benchmarks.pipeline import compile_ahead
from benchmarks.scene import Scene
from tunneldb.geometry.alignment import Alignment

SRID = 25830  # the simulator's
SEGMENT = 10.0  # m
PATCH = 500  # points: pgPointcloud advises 400 to 600
COMPRESSIONS = ("none", "dimensional")  # laz is not built into the package of apt
SCALE = 0.00025  # m, of the coordinates, as in the file
CHAINAGE_SCALE = 0.0001  # m
MISSING = "pgPointcloud is not on this server: sudo scripts/system-packages.sh bench   (postgresql-15-pointcloud of apt)"

# Name, type of the schema, type of NumPy, scale, whether it has the file's offset.
DIMENSIONS = (
    ("X", "int32_t", "<i4", SCALE),
    ("Y", "int32_t", "<i4", SCALE),
    ("Z", "int32_t", "<i4", SCALE),
    ("Chainage", "int32_t", "<i4", CHAINAGE_SCALE),
    ("Intensity", "float", "<f4", 1.0),
    ("GpsTime", "double", "<f8", 1.0),
    ("ScanId", "uint16_t", "<u2", 1.0),
    ("Classification", "uint8_t", "u1", 1.0),
)


def schema(offsets: Sequence[float], compression: str) -> str:
    """Return the XML that describes a patch; `offsets` of X, Y and Z, m."""
    shift = dict(zip("XYZ", offsets, strict=True))
    dimensions = "".join(
        f"<pc:dimension><pc:position>{position}</pc:position><pc:size>{np.dtype(kind).itemsize}</pc:size>"
        f"<pc:name>{name}</pc:name><pc:interpretation>{interpretation}</pc:interpretation>"
        f"<pc:scale>{scale}</pc:scale><pc:offset>{shift.get(name, 0)}</pc:offset></pc:dimension>"
        for position, (name, interpretation, kind, scale) in enumerate(DIMENSIONS, start=1)
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?><pc:PointCloudSchema xmlns:pc="http://pointcloud.org/schemas/PC/1.1">'
        f'{dimensions}<pc:metadata><Metadata name="compression">{compression}</Metadata></pc:metadata></pc:PointCloudSchema>'
    )


def patches(segment: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return where patches begin, and the end: as even as they can be at about PATCH points, none over two segments."""
    ends = np.flatnonzero(np.diff(segment)) + 1
    bounds = np.concatenate([[0], ends, [len(segment)]])
    cuts = [np.linspace(a, b, max(1, round((b - a) / PATCH)) + 1)[:-1] for a, b in itertools.pairwise(bounds)]
    return np.append(np.concatenate(cuts).astype(np.int64), len(segment))


def load_patches(dsn: str, scan: Path, axis: Path, compression: str) -> None:
    """Load a LAZ file into the table `patch_<compression>`, with indexes and statistics."""
    las = laspy.read(scan)
    offsets = np.asarray(las.header.offsets).tolist()
    alignment = Alignment.from_polyline(np.loadtxt(axis, delimiter=",", skiprows=1), 0.0)
    chainage = alignment.chainage(np.ascontiguousarray(las.xyz))
    order = np.argsort(chainage, kind="stable")
    order = order[: np.count_nonzero(np.isfinite(chainage))]  # those beyond the ends come last; tunneldb drops them too
    chainage = chainage[order]
    record = np.empty(len(order), [(name, kind) for name, _, kind, _ in DIMENSIONS])
    columns = (las.X, las.Y, las.Z, None, las["Amplitude"], las.gps_time, las.point_source_id, las.classification)
    for (name, *_), column in zip(DIMENSIONS, columns, strict=True):
        record[name] = np.rint(chainage / CHAINAGE_SCALE) if column is None else np.asarray(column)[order]
    segment = np.floor(chainage / SEGMENT).astype(np.int64)
    starts = patches(segment)
    table = sql.Identifier(f"patch_{compression}")
    with psycopg.connect(dsn) as connection, connection.cursor() as cursor:
        pcid = 1 + COMPRESSIONS.index(compression)
        cursor.execute("INSERT INTO pointcloud_formats VALUES (%s, %s, %s)", (pcid, SRID, schema(offsets, compression)))
        cursor.execute(
            sql.SQL(
                "CREATE TABLE {} (id serial PRIMARY KEY, segment int NOT NULL, chainage_from float8 NOT NULL,"
                " chainage_to float8 NOT NULL, pa pcpatch({}) NOT NULL)"
            ).format(table, sql.Literal(pcid))
        )
        head = np.array([(1, pcid, 0)], [("order", "u1"), ("pcid", "<u4"), ("compression", "<u4")]).tobytes()
        with cursor.copy(sql.SQL("COPY {} (segment, chainage_from, chainage_to, pa) FROM STDIN").format(table)) as copy:
            for a, b in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True):
                wkb = head + np.uint32(b - a).tobytes() + record[a:b].tobytes()
                first, last = record["Chainage"][[a, b - 1]] * CHAINAGE_SCALE
                copy.write(f"{segment[a]}\t{first}\t{last}\t{wkb.hex()}\n")
        for index in ("btree (segment)", "btree (chainage_from, chainage_to)", "gist (PC_EnvelopeGeometry(pa))"):
            cursor.execute(sql.SQL("CREATE INDEX ON {} USING " + index).format(table))
        cursor.execute(sql.SQL("ANALYZE {}").format(table))


def questions(length: float, box: Sequence[float], survey: int) -> dict[str, tuple[str, str]]:
    """Return each question's SQL for rows and for patches (of table {patch}); both give the same columns.

    `box`: xmin, ymin, zmin, xmax, ymax, zmax, m.
    """
    at = length / 2 + CHAINAGE_SCALE / 2  # between two steps of the chainage as the patches store it
    x0, y0, z0, x1, y1, z1 = box
    own = f"FROM tunnel_api.point WHERE survey_id = {survey} AND km BETWEEN 0 AND {int(length // 1000)}"
    span = "count(*), sum(ST_X(geom)), sum(ST_Z(geom)), sum(intensity::float8)"
    each = "count(*), sum(PC_Get(pt, 'X')), sum(PC_Get(pt, 'Z')), sum(PC_Get(pt, 'Intensity'))"

    def stretch(a: float, b: float) -> tuple[str, str]:
        return (
            f"SELECT {span} {own} AND chainage BETWEEN {a} AND {b}",
            f"SELECT {each} FROM (SELECT PC_Explode(PC_FilterBetween(pa, 'Chainage', {a}, {b})) AS pt"
            f" FROM {{patch}} WHERE chainage_from <= {b} AND chainage_to >= {a}) p",
        )

    # A box's chainage follows from the given axis, whose length in plan it is; the axis bends little within it.
    centre = f"ST_MakePoint({(x0 + x1) / 2}, {(y0 + y1) / 2})"
    reach = 2 + ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5 / 2
    middle = (
        f"(SELECT ST_LineLocatePoint(geom, ST_SetSRID({centre}, {SRID})) * ST_Length(geom) FROM tunnel_api.tunnel"
        " WHERE name = 'survey')"
    )
    in_box = (
        f"SELECT {span} {own} AND chainage BETWEEN {middle} - {reach} AND {middle} + {reach}"
        f" AND ST_X(geom) BETWEEN {x0} AND {x1} AND ST_Y(geom) BETWEEN {y0} AND {y1} AND ST_Z(geom) BETWEEN {z0} AND {z1}",
        f"SELECT {each} FROM (SELECT PC_Explode(PC_FilterBetween(PC_FilterBetween(PC_FilterBetween(pa,"
        f" 'X', {x0}, {x1}), 'Y', {y0}, {y1}), 'Z', {z0}, {z1})) AS pt FROM {{patch}}"
        f" WHERE PC_EnvelopeGeometry(pa) && ST_MakeEnvelope({x0}, {y0}, {x1}, {y1}, {SRID})) p",
    )
    per_segment = (
        f"SELECT floor(chainage / {SEGMENT})::int, count(*) {own} GROUP BY 1 ORDER BY 1",
        "SELECT segment, sum(PC_NumPoints(pa))::bigint FROM {patch} GROUP BY 1 ORDER BY 1",
    )
    per_100 = (
        f"SELECT floor(chainage / 100)::int, round(min(ST_X(geom))::numeric, 2), round(max(ST_X(geom))::numeric, 2),"
        f" round(min(ST_Z(geom))::numeric, 2), round(max(ST_Z(geom))::numeric, 2), round(avg(intensity)::numeric, 2)"
        f" {own} GROUP BY 1 ORDER BY 1",
        f"SELECT (segment / {100 / SEGMENT:g})::int, round(min(PC_PatchMin(pa, 'X')), 2), round(max(PC_PatchMax(pa, 'X')), 2),"
        " round(min(PC_PatchMin(pa, 'Z')), 2), round(max(PC_PatchMax(pa, 'Z')), 2),"
        " round(sum(PC_PatchAvg(pa, 'Intensity') * PC_NumPoints(pa)) / sum(PC_NumPoints(pa)), 2) FROM {patch}"
        " GROUP BY 1 ORDER BY 1",
    )
    return {
        "points of 20 m": stretch(at, at + 20),
        "points per segment of 10 m": per_segment,
        "section, ±0.15 m": stretch(at + 2.35, at + 2.65),
        "points in a box of 4 × 4 × 3 m": in_box,
        "box and mean intensity per 100 m": per_100,
    }


def ask(connection: psycopg.Connection[Any], query: str, repeat: int) -> tuple[float, list[tuple[Any, ...]]]:
    """Return the median seconds of a query whose data are in memory, and its answer."""
    rows = connection.execute(query.encode()).fetchall()
    seconds = []
    for _ in range(repeat):
        start = time.perf_counter()
        rows = connection.execute(query.encode()).fetchall()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds), rows


def same(one: list[tuple[Any, ...]], other: list[tuple[Any, ...]]) -> bool:
    """Compare answers, numbers to one part in a million or a centimetre: coordinates are stored in steps."""
    return len(one) == len(other) and all(
        np.allclose(np.array(a, float), np.array(b, float), rtol=1e-6, atol=0.0101) for a, b in zip(one, other, strict=True)
    )


def measure(dsn: str, folder: Path, length: float, repeat: int) -> dict[str, Any]:
    """Load and ask; seconds and bytes."""
    scene = Scene.simulate(
        folder, "survey", "--length", length, "--radius", 4000, "--slope", 1.7, "--scanner", "profiler", "--density", 100,
        "--no-truth", "--outliers", 0,
    )  # fmt: skip
    (scan,) = scene.scans
    compile_ahead(dsn, folder)
    scene.register(dsn)
    progress("rows")
    seconds = tunneldb("load", scene.name, "--density", "all", "--noise-points", 1, scan, dsn=dsn)
    loads: dict[str, dict[str, float]] = {"tunneldb": {"seconds": seconds}}
    for compression in COMPRESSIONS:
        progress(f"patches, compression {compression}")
        command = [sys.executable, "-m", "benchmarks.pointcloud", "--dsn", dsn, "--load", compression]
        start = time.perf_counter()
        subprocess.run([*command, str(scan), str(scene.file("axis.csv"))], check=True)
        loads[compression] = {"seconds": time.perf_counter() - start}
    with psycopg.connect(dsn) as connection:
        survey = int(_one(connection, "SELECT tunnel_api.survey_id('survey')"))
        loads["tunneldb"]["bytes"] = _one(
            connection, f"SELECT sum(pg_total_relation_size(relid)) FROM pg_partition_tree('tunnel.point_s{survey}')"
        )
        points = int(_one(connection, f"SELECT count(*) FROM tunnel.point WHERE survey_id = {survey}"))
        for compression in COMPRESSIONS:
            loads[compression]["bytes"] = _one(connection, f"SELECT pg_total_relation_size('patch_{compression}')")
            stored = _one(connection, f"SELECT sum(PC_NumPoints(pa)) FROM patch_{compression}")
            if stored != points:
                raise SystemExit(f"{stored} points in patches of {compression}, {points} rows")
        asked = {}
        for name, (rows, patched) in questions(length, _box(connection, survey, length), survey).items():
            progress(name)
            took, answer = ask(connection, rows, repeat)
            asked[name] = {"tunneldb": took}
            for compression in COMPRESSIONS:
                asked[name][compression], other = ask(connection, patched.format(patch=f"patch_{compression}"), repeat)
                if not answer or not same(answer, other):
                    raise SystemExit(f"{name}: {answer[:3]} of the rows, {other[:3]} of the patches ({compression})")
    return {"points": points, "load": loads, "seconds": asked}


def _one(connection: psycopg.Connection[Any], query: str) -> float:
    row = connection.execute(query.encode()).fetchone()
    assert row is not None
    return float(row[0])


def _box(connection: psycopg.Connection[Any], survey: int, length: float) -> list[float]:
    """Return a box of 4 × 4 × 3 m about a point of the lining, its faces between the steps of stored coordinates."""
    row = connection.execute(
        "SELECT ST_X(geom), ST_Y(geom), ST_Z(geom) FROM tunnel.point WHERE survey_id = %s AND chainage > %s"
        " ORDER BY chainage LIMIT 1",
        (survey, 0.3 * length),
    ).fetchone()
    assert row is not None
    half = np.array([2.0, 2.0, 1.5]) + SCALE / 2
    return [*np.round(np.array(row) - half, 6).tolist(), *np.round(np.array(row) + half, 6).tolist()]


def report(figures: dict[str, Any]) -> None:
    """Print the tables."""
    ways = ("tunneldb", *COMPRESSIONS)
    load, seconds, points = figures["load"], figures["seconds"], figures["points"]
    rows: list[tuple[object, ...]] = [
        ("loading, s", *(load[way]["seconds"] for way in ways)),
        ("size, MB", *(load[way]["bytes"] / 1e6 for way in ways)),
        ("bytes a point", *(load[way]["bytes"] / points for way in ways)),
    ]
    rows += [(f"{name}, ms", *(1000 * took[way] for way in ways)) for name, took in seconds.items()]
    header = ("", "tunneldb", *(f"patches, {way}" for way in COMPRESSIONS))
    print_table(f"{points:,} points: rows and patches", header, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--length", type=float, default=1000.0, help="tunnel, m")
    parser.add_argument("--repeat", type=int, default=5, help="times that each question is put")
    parser.add_argument("--load", nargs=3, metavar=("COMPRESSION", "LAZ", "AXIS"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.load:  # the loader, in a process of its own
        compression, scan, axis = arguments.load
        load_patches(arguments.dsn, Path(scan), Path(axis), compression)
        return
    with tempfile.TemporaryDirectory() as temporary, scratch_database(arguments.dsn) as dsn:
        try:
            with psycopg.connect(dsn) as connection:
                connection.execute("CREATE EXTENSION pointcloud")
                connection.execute("CREATE EXTENSION pointcloud_postgis")
        except (psycopg.errors.UndefinedFile, psycopg.errors.FeatureNotSupported):
            raise SystemExit(MISSING) from None
        figures = measure(dsn, Path(temporary), arguments.length, arguments.repeat)
    report(figures)
    print(f"\n{save('pointcloud', figures)}")


if __name__ == "__main__":
    main()
