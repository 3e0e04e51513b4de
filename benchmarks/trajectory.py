"""What a kilometre costs in a survey with a long trajectory, against the same with a short one: load, and detect.

    python -m benchmarks.trajectory                       # 1 km of poses and 250 km, 20 poses a metre
    python -m benchmarks.trajectory --km 250 --length 50  # of tunnel that is scanned, m

The scan is the same, and so are the poses of its own time; the others lie before and behind it in time. CPU time is that of the
program and of its backends, the least of some runs; the server must run on this machine. What is found is held against what is
found with the short trajectory.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import psycopg

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from benchmarks.growth.commands import cpu_times, postmaster_of
from benchmarks.scene import Scene

NAME = "long"
PER_METRE = 20
REPEATS = 3

OTHERS = """
INSERT INTO tunnel.pose (survey_id, time, geom)
SELECT o.survey_id, CASE WHEN n %% 2 = 0 THEN o.begin - 1 - n * 0.01 ELSE o.until + 1 + n * 0.01 END, o.geom
FROM (SELECT survey_id, min(time) AS begin, max(time) AS until, min(geom) AS geom FROM tunnel.pose GROUP BY survey_id) o,
    generate_series(1, %s - (SELECT count(*) FROM tunnel.pose)) AS n
"""
FOUND = (
    "SELECT md5(string_agg(md5(tiff), '' ORDER BY kind, block)) FROM tunnel.image",
    "SELECT md5(string_agg(public.ST_AsEWKB(unrolled)::text, '' ORDER BY chainage_from, arc_from)) FROM tunnel.finding",
    "SELECT md5(string_agg(p.*::text, '' ORDER BY chainage, gps_time, scan_id)) FROM tunnel.point p",
)


@dataclass(frozen=True)
class Cost:
    """CPU time of program and backends of two stages, s, and what was found."""

    poses: int
    load: float
    detect: float
    found: list[str]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server on which databases are made and dropped; default: the embedded one")
    parser.add_argument("--km", type=float, default=250.0, help="length of the long trajectory")
    parser.add_argument("--length", type=float, default=50.0, help="tunnel that is scanned, m")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, scratch_database(asked.dsn) as dsn:
        scene = Scene.simulate(Path(folder), NAME, "--length", asked.length, "--scanner", "profiler", "--no-truth")
        scene.register(dsn)
        scene.load(dsn)
        scene.run(dsn)
        costs = [measure(dsn, scene, round(1000 * km * PER_METRE)) for km in (1.0, asked.km)]
    short, long = costs
    if long.found != short.found:
        raise SystemExit("what was found is not the same")
    rows = [[stage, getattr(short, stage), getattr(long, stage), getattr(long, stage) / getattr(short, stage)]
            for stage in ("load", "detect")]  # fmt: skip
    print_table(f"CPU time with {short.poses:,} and {long.poses:,} poses, s", ["stage", "short", "long", "ratio"], rows)
    print(f"\n{save('trajectory', {'short': vars(short), 'long': vars(long)})}")


def measure(dsn: str, scene: Scene, poses: int) -> Cost:
    """Load the scan anew and detect, with a trajectory of so many poses."""
    progress(f"{poses:,} poses")
    with psycopg.connect(dsn, autocommit=True) as connection:
        connection.execute(OTHERS, [poses])
        connection.execute("VACUUM ANALYZE tunnel.pose")
        connection.execute("CHECKPOINT")
    postmaster = postmaster_of(dsn)
    load, detect = [], []
    for _ in range(REPEATS):
        with psycopg.connect(dsn) as connection:
            connection.execute("UPDATE tunnel.scan_file SET checksum = ''")
        load.append(sum(cpu_times(dsn, ["load", scene.name, *map(str, scene.scans)], postmaster)))
        tunneldb("run", scene.name, "--to", "ground", dsn=dsn)
        detect.append(sum(cpu_times(dsn, ["run", scene.name, "--from", "detect"], postmaster)))
    with psycopg.connect(dsn) as connection:
        found = [str(connection.execute(query).fetchone()) for query in FOUND]
    return Cost(poses, min(load), min(detect), found)


if __name__ == "__main__":
    main()
