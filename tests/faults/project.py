"""A survey in an embedded server of its own, driven by the real commands, and all that a batch leaves in its database."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from click.testing import CliRunner
from faults.scene import NAME, SRID, THIN, Scene
from psycopg import sql
from psycopg.conninfo import make_conninfo
from support.system import memory_disk

from tunneldb.cli.main import main
from tunneldb.database import connect
from tunneldb.database.fetch import fetch_array
from tunneldb.database.server import DATABASE, Server
from tunneldb.queue import batch as job
from tunneldb.store.survey import get_survey

COMMAND = [sys.executable, "-c", "from tunneldb.cli.main import main; main()"]
PREPARED = "prepared"
State = dict[str, Any]


class Project:
    """A folder with an embedded server in which tunnel and survey are made; `fresh` makes its database anew.

    Attributes
    ----------
    home, scratch : Path
        The server's folder, and that of the temporary files of all commands.
    dsn : str
        The server's database.
    """

    def __init__(self, scene: Scene) -> None:
        self.home = Path(tempfile.mkdtemp(prefix="tunneldb-faults-", dir=memory_disk()))
        self.scratch = self.home / "scratch"
        self.scratch.mkdir()
        self._session: psycopg.Connection[Any] | None = None
        kept = {k: v for k, v in os.environ.items() if k not in ("TUNNELDB_DSN", "TUNNELDB_HOME")}
        self.environment = {**kept, "TUNNELDB_HOME": str(self.home), "TMPDIR": str(self.scratch)}
        # What is killed are processes, not the machine: what they have written stays, whether it is on the disk or not.
        unsafe = dict.fromkeys(("fsync", "synchronous_commit", "full_page_writes"), "off")
        self.dsn = Server(self.home, settings=unsafe).start()
        with self._server() as conn:
            for name in unsafe:  # for servers that commands start anew
                conn.execute(sql.SQL("ALTER SYSTEM SET {} = off").format(sql.Identifier(name)))
            conn.execute("SELECT pg_reload_conf()")
        folder = self.home / "poses"
        folder.mkdir()
        poses = scene.write_poses(folder)
        self.call("init")
        self.call("tunnel", "add", NAME, "--srid", SRID, "--axis", folder / "axis.csv", "--start-chainage", scene.start)
        self.call(
            "survey", "add", NAME, "--tunnel", NAME, "--date", "2024-05-04",
            *poses, "--intensity", "Amplitude", "--intensity-kind", "amplitude",
        )  # fmt: skip
        with self._server() as conn:
            conn.execute(sql.SQL("ALTER DATABASE {} RENAME TO {}").format(sql.Identifier(DATABASE), sql.Identifier(PREPARED)))
        self.fresh()

    def fresh(self) -> None:
        """Begin anew with an empty survey."""
        with self._server() as conn:
            name = sql.Identifier(DATABASE)
            conn.execute(sql.SQL("DROP DATABASE IF EXISTS {} WITH (FORCE)").format(name))
            conn.execute(sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(name, sql.Identifier(PREPARED)))

    def close(self) -> None:
        """Stop the server and remove the folder."""
        if self._session is not None:
            self._session.close()
        server = Server(self.home)
        state = server.home().state
        server.stop()
        shutil.rmtree(state, ignore_errors=True)
        shutil.rmtree(self.home, ignore_errors=True)

    def call(self, *arguments: object) -> None:
        """Run a command in this process, whose imports take seconds in one of its own."""
        result = CliRunner().invoke(main, ["--dsn", self.dsn, *map(str, arguments)])
        assert result.exit_code == 0, result.output

    def run(self, *arguments: object, code: int | None = 0) -> str:
        """Run a command to its end; returns what it says."""
        command = [*COMMAND, *map(str, arguments)]
        found = subprocess.run(command, cwd=self.home, env=self.environment, capture_output=True, text=True, check=False)
        assert code is None or found.returncode == code, f"{' '.join(map(str, arguments))}: {found.stdout}{found.stderr}"
        return found.stdout + found.stderr

    def begin(
        self, *arguments: object, log: str = "batch.log", environment: dict[str, str] | None = None
    ) -> subprocess.Popen[bytes]:
        """Start a command; what it says goes to a file of the folder."""
        with (self.home / log).open("ab") as output:
            return subprocess.Popen(
                [*COMMAND, *map(str, arguments)],
                cwd=self.home,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def said(self, log: str = "batch.log") -> str:
        """What commands have said."""
        return (self.home / log).read_text(errors="replace")

    def connect(self) -> psycopg.Connection[Any]:
        """Connect to the database, as a test does; does not start the server."""
        return psycopg.connect(self.dsn, autocommit=True)

    def ask(self, query: str) -> tuple[Any, ...]:
        """The one row of a query that is asked again and again: in one session, for to open one takes more than to answer."""
        for again in (True, False):
            if self._session is None or self._session.closed:
                self._session = self.connect()
            try:
                row = self._session.execute(query).fetchone()
            except psycopg.OperationalError:  # the database was made anew, or its server started
                self._session.close()
                if not again:
                    raise
            else:
                assert row is not None
                return row
        raise AssertionError

    def _server(self) -> psycopg.Connection[Any]:
        return psycopg.connect(make_conninfo(self.dsn, dbname="postgres", user="postgres"), autocommit=True)


def register(project: Project, files: Sequence[Path], kilometres: range | None = None) -> None:
    """Ask for what a batch asks for, without workers of its own."""
    chosen = {name: float(value) for name, value in (text.split("=") for text in THIN)}
    with connect(project.dsn) as conn:
        conn.autocommit = True
        survey = get_survey(conn, NAME)
        job.register(conn, survey, job.plan(conn, survey, files, kilometres=kilometres, parameters=chosen))


def batch(files: Sequence[Path], *more: object, workers: int = 2) -> list[object]:
    """Arguments of a batch of files."""
    values = [text for value in THIN for text in ("--set", value)]
    return ["batch", NAME, *files, "--workers", workers, *values, *more]


_COORDINATES = """ARRAY(SELECT unnest(ARRAY[ST_X(d.geom), ST_Y(d.geom), coalesce(ST_Z(d.geom), 0)])
                          FROM ST_DumpPoints({}) d ORDER BY d.path)"""
_TABLES = {
    "scan_file": "SELECT name, checksum, bytes, points, noise, outside, thinned, kept, chainage_from, chainage_to, extent, "
    "srid FROM tunnel.scan_file ORDER BY name",
    "file_km": "SELECT f.name, k.km, k.rows, k.points::text, k.loaded_at IS NOT NULL "
    "FROM tunnel.file_km k JOIN tunnel.scan_file f ON f.id = k.file_id ORDER BY 1, 2",
    "axis_vertex": f"SELECT n, km, {_COORDINATES.format('geom')}, {_COORDINATES.format('given')}, points, source "
    "FROM tunnel.axis_vertex ORDER BY n",
    "segment": "SELECT n, km, chainage_from, chainage_to, vertex_from, vertex_to, tangent_from, tangent_to, "
    f"{_COORDINATES.format('geom')}, points FROM tunnel.segment ORDER BY n",
    "section": "SELECT segment, half, km, chainage, half_width, angle_step, radius, arc, "
    f"{_COORDINATES.format('geom')}, points, interpolated FROM tunnel.section ORDER BY 1, 2",
    "section_class": "SELECT s.segment, s.half, c.class, c.angle, c.radius, c.slope, c.sigma, c.points, c.state "
    "FROM tunnel.section_class c JOIN tunnel.section s ON s.id = c.section_id ORDER BY 1, 2, 3",
    "ground": "SELECT n, km, across, height, gamma, foot, lean, arc_left, arc_right, "
    f"{_COORDINATES.format('geom')} FROM tunnel.ground ORDER BY n",
    "lining": 'SELECT km, cell, box, "offset", spread FROM tunnel.lining ORDER BY km',
    "cluster": "SELECT km, class, chainage_from, chainage_to, height_from, height_to, points, cell, cells, "
    f"{_COORDINATES.format('geom')} FROM tunnel.cluster ORDER BY 1, 3, 4, 2, 9",
    "radiometry": "SELECT km, roughness, dry_mean, dry_sigma, threshold, sigma_raw, sigma_lambert, sigma_oren_nayar, regions, "
    "pixels, wet_pixels FROM tunnel.radiometry ORDER BY km",
    "image": "SELECT km, kind, block, tiff FROM tunnel.image ORDER BY 1, 2, 3",
    "coverage": "SELECT km, step, lining, seen, wet FROM tunnel.coverage ORDER BY km",
    "dark_band": "SELECT km, n, chainage_from, chainage_to, arc_from, arc_to, darkening, area"
    " FROM tunnel.dark_band ORDER BY km, n",
    "detectability": "SELECT km, chainage_from, chainage_to, arc_from, arc_to, lining_area, trials, probability, "
    "smallest_1_5_db, smallest_3_db, smallest_6_db FROM tunnel.detectability ORDER BY km, chainage_from, arc_from",
    "range_curve": "SELECT km, range_m, intensity_db, sigma_db FROM tunnel.range_curve ORDER BY km",
    "finding": "SELECT km, chainage_from, chainage_to, arc_from, arc_to, clock, area, darkening_mean, darkening_max,"
    " image_share, "
    "kind, reasons, confidence, contrast, kind_override, "
    f"{_COORDINATES.format('unrolled')}, {_COORDINATES.format('map')}, {_COORDINATES.format('surface')}, review, detected "
    "FROM tunnel.finding ORDER BY 2, 4",
    "boundary_region": "SELECT km, pixel, box, mask, filled, darkening_sum, darkening_max, properties"
    " FROM tunnel.boundary_region ORDER BY km, box",
    "waterproof": "SELECT km, chainage_from, chainage_to, lining_area, seen_share, wet_area, patches, largest_area, "
    "window_patches, window_wet_area, class FROM tunnel_api.km_waterproof ORDER BY km",
    "tables": "SELECT relname FROM pg_class WHERE relnamespace = 'tunnel'::regnamespace AND relkind IN ('r', 'p') ORDER BY 1",
    "goal": "SELECT km, stage, parameters::text FROM tunnel.goal ORDER BY km",
    "incoming": "SELECT name, message FROM tunnel.incoming ORDER BY name",
    # The last of each: how many there are is compared by `runs`. Which of two kilometres finds a leak across their boundary
    # first, is chance.
    "run": "SELECT DISTINCT ON (stage, km, 3) km, stage, coalesce(parameters ->> 'file', ''), parameters,"
    " counts - '{leaks_new,leaks_again,leaks_over_ends}'::text[] FROM tunnel.run WHERE outcome = 'done'"
    " ORDER BY stage, km, 3, id DESC",
    "status": "SELECT km, stage, outcome, stale, reason FROM tunnel_api.stage_status ORDER BY km, step",
    "jobs": "SELECT status::text, args::text FROM tunnel_queue.procrastinate_jobs WHERE status IN ('todo', 'doing')",
}
_ROWS = """
    FROM tunnel.point p
    JOIN (SELECT id, row_number() OVER (ORDER BY name) AS number FROM tunnel.scan_file) f ON f.id = p.file_id
"""
_FIELDS = (
    ("survey", "i4", sql.SQL("p.survey_id")),
    ("km", "i4", sql.SQL("p.km")),
    ("chainage", "f8", sql.SQL("p.chainage")),
    ("time", "f8", sql.SQL("p.gps_time")),
    ("x", "f8", sql.SQL("ST_X(p.geom)")),
    ("y", "f8", sql.SQL("ST_Y(p.geom)")),
    ("z", "f8", sql.SQL("ST_Z(p.geom)")),
    ("segment", "i4", sql.SQL("coalesce(p.segment, -1)")),
    ("scan", "i4", sql.SQL("p.scan_id")),
    ("file", "i4", sql.SQL("f.number::int")),
    ("intensity", "f4", sql.SQL("p.intensity")),
    ("classification", "i4", sql.SQL("p.classification::int")),
    ("class", "i4", sql.SQL('coalesce(p."class", 0)::int')),
)


def state(project: Project) -> State:
    """All that a batch leaves, without keys that count up, and times."""
    with project.connect() as conn:
        found: State = {name: conn.execute(query).fetchall() for name, query in _TABLES.items()}
        found["point"] = np.sort(fetch_array(conn, _FIELDS, sql.SQL(_ROWS), {}), order=["km", "time", "x", "y", "z"])
    found["scratch"] = sorted(path.name for path in project.scratch.iterdir())
    return found


def runs(project: Project) -> list[tuple[int | None, str, str, int]]:
    """How many runs of each stage of each kilometre, and of each file, have ended well."""
    with project.connect() as conn:
        return conn.execute(
            "SELECT km, stage, coalesce(parameters ->> 'file', ''), count(*) FROM tunnel.run WHERE outcome = 'done' "
            "GROUP BY 1, 2, 3 ORDER BY 2, 1, 3"
        ).fetchall()


def differences(one: State, other: State) -> list[str]:
    """What is not the same in two states: the first of each table."""
    found = []
    for name in one:
        a, b = one[name], other[name]
        if name == "point":
            found += _points(a, b)
        elif name == "lining" and len(a) == len(b):
            found += _lining(a, b)
        elif len(a) != len(b):
            odd = [row for row in (a if len(a) > len(b) else b) if row not in (b if len(a) > len(b) else a)]
            found.append(f"{name}: {len(a)} rows against {len(b)}, such as {str(odd[:1])[:300]}")
        else:
            unequal = [(x, y) for x, y in zip(a, b, strict=True) if not same(x, y)]
            if unequal:
                found.append(f"{name}: {len(unequal)} of {len(a)} rows, first {_pair(*unequal[0])}")
    return found


def _points(a: np.ndarray, b: np.ndarray) -> list[str]:
    if len(a) != len(b):
        return [f"point: {len(a)} rows against {len(b)}"]
    found = []
    for field in a.dtype.names or ():
        # chainage comes from the axis, whose averages may be summed in another order
        unequal = ~np.isclose(a[field], b[field], 1e-9, 0) if field == "chainage" else a[field] != b[field]
        if unequal.any():
            k = int(np.flatnonzero(unequal)[0])
            found.append(f"point: {field} of {unequal.sum()} of {len(a)} rows, first {a[k]} against {b[k]}")
    return found


def _lining(a: list[Any], b: list[Any]) -> list[str]:
    """Grids are kept in single precision, whose last digit may tip."""
    found = []
    for one, other in zip(a, b, strict=True):
        alike = one[:3] == other[:3] and all(
            np.allclose(np.frombuffer(x, "<f4"), np.frombuffer(y, "<f4"), rtol=0, atol=1e-5, equal_nan=True)
            for x, y in zip(one[3:], other[3:], strict=True)
        )
        if not alike:
            found.append(f"lining: kilometre {one[0]}")
    return found


def same(a: object, b: object) -> bool:
    """Whether values are the same; sums may have been added up in another order."""
    if isinstance(a, float) and isinstance(b, float):
        return math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-9) or (math.isnan(a) and math.isnan(b))
    if isinstance(a, (list, tuple)) and isinstance(b, (list, tuple)):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return a == b


def _pair(a: Sequence[object], b: Sequence[object]) -> str:
    key = " ".join(map(str, a[:3]))
    unequal = [(i, _of(x, y)[:200], _of(y, x)[:200]) for i, (x, y) in enumerate(zip(a, b, strict=True)) if not same(x, y)]
    return f"{key}: (column, one, other) {unequal[:3]}"


def _of(one: object, other: object) -> str:
    """Text of a value; of a dictionary only entries that the other one does not have."""
    if isinstance(one, dict) and isinstance(other, dict):
        return str({key: value for key, value in one.items() if key not in other or not same(value, other[key])})
    return str(one)
