"""Scenes of which all results are captured by compare_results.py.

Each uses the command line alone, so that any version of the program can be captured, and has a folder and a database of its
own: ``scan`` (simulated scans), ``out`` (files written), ``said`` (what was printed), ``tables`` (all tables and views).
"""

from __future__ import annotations

import csv
import gzip
import json
import os
import shutil
import struct
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from psycopg import sql

csv.field_size_limit(sys.maxsize)


QUERIES = {
    "waterproof": "SELECT w.* FROM tunnel_api.survey s, tunnel_api.waterproof_class('s', s.chainage_from, s.chainage_to) w",
    "sections": "SELECT c, a.* FROM tunnel_api.survey s, generate_series(ceil(s.chainage_from)::int, s.chainage_to::int, 7) c, "
    "tunnel_api.section_at(s.id, c) a",
    "unroll": "SELECT v.n, u.* FROM tunnel_api.axis_vertex v, "
    "tunnel_api.unroll(v.survey_id, ST_Translate(v.geom, 1, -2, 0.5)) u ORDER BY v.n",
    "roll": "SELECT v.n, ST_AsEWKT(r) FROM tunnel_api.axis_vertex v, "
    "tunnel_api.roll(v.survey_id, v.chainage + 3, 2.5, 0.1) r ORDER BY v.n",
    "rings": "SELECT r.* FROM tunnel_api.survey s, tunnel_api.ring_statistics('s', 10, s.chainage_from) r",
}
"""Functions at places of the survey, with all digits."""


class Scene:
    """A folder with a database of its own, in which commands are run.

    Parameters
    ----------
    folder : Path
        Folder of the scene; emptied.
    tunneldb : Path
        The program.
    scans : Path or None
        Folder of another capture, whose simulated scans are taken in place of new ones.
    """

    def __init__(self, folder: Path, tunneldb: Path, scans: Path | None = None) -> None:
        self.folder, self.tunneldb, self.former = folder, tunneldb, scans and scans / folder.name
        shutil.rmtree(folder, ignore_errors=True)
        for name in ("scan", "out", "said", "tables"):
            (folder / name).mkdir(parents=True)
        self.environment = {name: value for name, value in os.environ.items() if name != "TUNNELDB_DSN"}
        self.environment |= {"TUNNELDB_HOME": str(folder / "home"), "COLUMNS": "160", "TZ": "UTC"}

    def run(self, *words: object, said: str = "", codes: Sequence[int] = (0,)) -> str:
        """Run a command in the scene's folder; keep what it prints under the name `said`."""
        command = [str(self.tunneldb), *map(str, words)]
        done = subprocess.run(command, cwd=self.folder, env=self.environment, capture_output=True, text=True, check=False)
        if done.returncode not in codes:
            raise SystemExit(f"{self.folder.name}: {' '.join(command)}\n{done.stdout}{done.stderr}")
        if said:
            rest = "" if said.endswith("json") else (done.stderr if done.returncode else "") + f"exit {done.returncode}\n"
            (self.folder / "said" / said).write_text(done.stdout + rest)
        return done.stdout

    def simulate(self, *words: object, command: str = "simulate") -> None:
        """Make the scan in the folder ``scan``, or copy it from the other capture."""
        if self.former is None:
            self.run(command, "scan", *words, said="simulate.txt")
        else:
            shutil.copytree(self.former / "scan", self.folder / "scan", dirs_exist_ok=True)
            shutil.copyfile(self.former / "said" / "simulate.txt", self.folder / "said" / "simulate.txt")

    def query(self, said: str, statement: str) -> None:
        """Run an SQL statement; keep its rows."""
        self.run("psql", "-X", "-A", "-q", "-v", "ON_ERROR_STOP=1", "-c", statement, said=said)

    def register(self, srid: int, start: float, *survey: object) -> None:
        """Make the database, with the tunnel ``t`` and the survey ``s`` of the files in ``scan``."""
        axis = next((self.folder / "scan").glob("*.axis.csv"))
        self.run("init")
        self.run("tunnel", "add", "t", "--srid", srid, "--axis", axis, "--start-chainage", start, said="tunnel-add.txt")
        self.run("survey", "add", "s", "--tunnel", "t", "--date", "2024-05-04", *survey, said="survey-add.txt")
        rows = list(csv.DictReader(axis.open()))
        with (self.folder / "scan" / "points.csv").open("w") as file:
            file.write("name,x,y,z\n")
            for n, row in enumerate(rows):
                for east, north, up in ((0, 0, 1), (1.5, -0.5, 0.5), (-1, 2, -0.2), (40, 0, 0)):
                    file.write(f"p{n},{float(row['x']) + east},{float(row['y']) + north},{float(row['z']) + up}\n")

    def scans(self) -> list[str]:
        """Return the scan files, from the scene's folder."""
        return sorted(str(path.relative_to(self.folder)) for path in (self.folder / "scan").glob("*.laz"))

    def look(self) -> None:
        """Print what is known of the survey, in all ways."""
        for name, words in {
            "status.txt": ["status", "s"], "status.json": ["status", "s", "--json"], "overview.txt": ["status"],
            "leaks.txt": ["leaks", "s"], "leaks.json": ["leaks", "s", "--kind", "all", "--geometry", "3d", "--json"],
            "by-km.txt": ["leaks", "s", "--by-km"], "by-km.json": ["leaks", "s", "--by-km", "--json"],
            "surveys.json": ["survey", "list", "--json"], "tunnels.json": ["tunnel", "list", "--json"],
            "axis.txt": ["axis", "s"],
            "axis.json": ["axis", "s", "-o", "out/axis.csv", "--json"],
            "unroll.json": ["unroll", "s", "scan/points.csv", "-o", "out/unrolled.csv", "--json"],
        }.items():  # fmt: skip
            self.run(*words, said=name, codes=(0, 1))  # 1: leaks were not searched for
        rows = list(csv.DictReader((self.folder / "out" / "unrolled.csv").open()))
        inside = [f"{row['chainage']},{row['arc']},{row['offset']}\n" for row in rows if row["chainage"]]
        (self.folder / "out" / "inside.csv").write_text("chainage,arc,offset\n" + "".join(inside))
        self.run("unroll", "s", "out/inside.csv", "--inverse", "-o", "out/rolled.csv", said="rolled.txt")
        for name, query in QUERIES.items():
            self.query(f"{name}.txt", query)

    def export(self) -> None:
        """Write all kinds of files."""
        for kind, place, ending in (("leak", "map", "gpkg"), ("all", "3d", "geojson"), ("all", "unrolled", "csv")):
            self.run("leaks", "s", "--kind", kind, "--geometry", place, "-o", f"out/leaks-{place}.{ending}", codes=(0, 1))
        self.run("image", "s", "-o", "out/images", said="image.txt")
        self.run("qgis", "s", "-o", "out/s.qgz", said="qgis.txt")
        self.run("report", "s", "-o", "out/report.html", said="report.txt")
        self.run("axis", "s", "-o", "out/axis.png")
        for ending in ("gpkg", "dxf"):
            self.run("export", "s", "-o", f"out/s.{ending}", said=f"export-{ending}.txt")
        self.run("export", "s", "--classified", "-o", "out/classed", said="classified.txt")


def demo(scene: Scene) -> None:
    """Take the scan of scripts/demo.sh through all stages."""
    scene.simulate("--preset", "demo", "--name", "demo", "--lining", "segments", "--soot", 2, "--paint", 4,
                   "--patches", 4, "--joint-leaks", 2, "--drips")  # fmt: skip
    scene.register(25830, 12300, "--trajectory", "scan/demo.trajectory.csv", "--reference", "scan/demo.reference.csv",
                   "--intensity", "Amplitude", "--intensity-kind", "amplitude")  # fmt: skip
    scene.run("load", "s", *scene.scans(), "--json", said="load.json")
    scene.run("run", "s", said="run.txt")
    scene.look()
    scene.export()
    scene.run("evaluate", "s", "scan/demo.truth.gpkg", "-o", "out/evaluate.json", said="evaluate.txt")
    scene.run("intensity", "s", "-o", "out/intensity.png", said="intensity.txt")
    scene.run("intensity", *scene.scans(), "--intensity", "Amplitude", "--intensity-kind", "amplitude", "--scanner", 272000,
              4765000, 642, said="intensity-file.txt")  # fmt: skip
    scene.run("leaks", "s", "--from", "12+330", "--to", "12+400", "--clock", "10-2", said="leaks-crown.txt")


DESIGNS = {"j-landxml.xml": 6676, "indot-twin-branch.xml": 6458, "indot-twin-branch.ifc": 6458, "aplitop-3.ifc": 25830}
"""Design alignments among the data of the tests, with the coordinate system in which each is read."""

EDITS = """
UPDATE tunnel_api.leak SET review = 'confirmed', remark = 'drips' WHERE id = (SELECT min(id) FROM tunnel_api.leak);
UPDATE tunnel_api.leak SET review = 'rejected' WHERE id = (SELECT max(id) FROM tunnel_api.leak);
UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0.03, -0.02, 0.04) WHERE n = 1299;
INSERT INTO tunnel_api.region (survey_id, kind, geom)
SELECT s.id, 'dry', ST_MakeEnvelope(12975, -2, 12979, 2) FROM tunnel_api.survey s;
"""


def static(scene: Scene) -> None:
    """Take a dirty tunnel, scanned from stations, through all stages; edit by hand and run again what is stale."""
    scene.simulate("--name", "dirty", "--length", 60, "--section", "horseshoe", "--scanner", "static",
              "--station-spacing", 12, "--angular-step", 0.18, "--start-chainage", 12970, "--slope", 2, "--radius", 300,
              "--lining", "cast", "--ring", 8, "--ring-step", 0.003, "--roughness", 10, "--relief", 0.002, "--beam", 0.3,
              "--leaks", 8, "--leak-area", 0.1, 2.5, "--leak-drop", 1.5, 8, "--leak-edge", 0.03, "--joint-leaks", 3,
              "--niche-leaks", 1, "--drips", "--soot", 2, "--grime", 2, "--patches", 5, "--paint", 5, "--clutter", 3,
              "--people", 2, "--equipment", 3, "--bollards", 1, "--globes", 2, "--spheres", 6, "--free-cables", 1,
              "--ballast", 0.02, "--sleepers", "--catenary", "--seed", 5)  # fmt: skip
    scene.register(25830, 12970, "--stations", "scan/dirty.stations.csv", "--reference", "auto", "--intensity", "Amplitude",
                   "--intensity-kind", "amplitude")  # fmt: skip
    scene.run("load", "s", *scene.scans(), "--json", said="load.json")
    scene.run("run", "s", said="run.txt")
    scene.run("spheres", "s", "--radius", 0.0725, "--control", "scan/dirty.spheres.csv", "--report", "out/spheres.md",
              said="spheres.txt")  # fmt: skip
    scene.run("run", "s", "--from", "ground", said="run-ground.txt")
    scene.run("evaluate", "s", "scan/dirty.truth.gpkg", "-o", "out/evaluate-1.json", said="evaluate-1.txt")
    scene.run("leaks", "s", "--kind", "all", said="leaks-1.txt")
    scene.query("edits.txt", EDITS)
    scene.run("status", "s", said="status-edited.txt")
    scene.run("run", "s", "--stale", said="run-stale.txt")
    scene.look()
    scene.export()
    scene.run("evaluate", "s", "scan/dirty.truth.gpkg", "-o", "out/evaluate.json", said="evaluate.txt")
    scene.run("intensity", "s", "-o", "out/intensity.png", said="intensity.txt")
    scene.run("ground", *scene.scans(), "-o", "out/ground.laz", said="ground.txt")


def ringo(scene: Scene, source: Path) -> None:
    """Take a real scan without intensity through all stages."""
    for name in ("ringo.laz", "ringo.axis.csv", "ringo.trajectory.csv"):
        shutil.copyfile(source / name, scene.folder / "scan" / name)
    scene.register(3794, 511746.75, "--trajectory", "scan/ringo.trajectory.csv", "--intensity-kind", "none")
    scene.run("load", "s", *scene.scans(), "--json", said="load.json")
    scene.run("run", "s", said="run.txt")
    scene.look()
    scene.export()
    scene.run("ground", *scene.scans(), "-o", "out/ground.laz", said="ground.txt")


def batch(scene: Scene) -> None:
    """Take three kilometres through a batch of two workers, at low density; then give them a stationing of their own."""
    scene.simulate("--name", "long", "--length", 3000, "--radius", 4000, "--s-curve", "--slope", 1.7,
              "--scanner", "profiler", "--density", 25, "--no-truth", "--leaks", 120, "--leak-area", 2, 20)  # fmt: skip
    scene.register(25830, 0, "--trajectory", "scan/long.trajectory.csv", "--reference", "scan/long.reference.csv",
                   "--intensity", "Amplitude", "--intensity-kind", "amplitude")  # fmt: skip
    scene.run("batch", "s", *scene.scans(), "--workers", 2, "--density", "all", "--set", "image.pixel=0.25")
    equations = scene.folder / "scan" / "equations.csv"
    equations.write_text("chainage,station,direction\n0,12000,1\n400,12350,1\n1700,14000,1\n2900,20000,-1\n")
    scene.run("tunnel", "stationing", "t", "scan/equations.csv", said="stationing.txt")
    scene.look()
    scene.run("evaluate", "s", "scan/long.truth.gpkg", "-o", "out/evaluate.json", said="evaluate.txt")
    scene.run("leaks", "s", "--geometry", "3d", "-o", "out/leaks.gpkg")
    scene.run("image", "s", "--km", "1", "-o", "out/images")
    scene.run("export", "s", "-o", "out/s.gpkg")


OUTLINE = "right,up\n-1.6,0.4\n-1.6,3.2\n-1.1,4.2\n1.1,4.2\n1.6,3.2\n1.6,0.4\n-1.6,0.4\n"
"""Clearance outline about a lane, m."""

PROFILE = "right,up\n" + "".join(
    f"{4.05 * np.sin(angle):.4f},{4.05 * np.cos(angle):.4f}\n" for angle in np.radians(np.arange(-120, 121, 5))
)
"""Design profile of a round lining, m from the given axis."""

MOVED_VERTEX = """
UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0.03, -0.02, 0.04)
 WHERE survey_id = (SELECT id FROM tunnel_api.survey WHERE name = 's') AND chainage BETWEEN 12325 AND 12335;
"""


def structure(scene: Scene) -> None:
    """Take the scan of scripts/demo-structure.sh through its stages."""
    scene.simulate("--name", "hall", "--width", 4, "--angular-step", 0.12, "--anomalies", 12, "--seed", 5,
                   command="simulate-structure")  # fmt: skip
    scene.run("init")
    scene.run("tunnel", "add", "t", "--srid", 25830, "--site", said="tunnel-add.txt")
    scene.run("survey", "add", "s", "--tunnel", "t", "--date", "2024-05-04", "--stations", "scan/hall.stations.csv",
              "--reference", "scan/hall.reference.csv", "--intensity", "Amplitude",
              "--intensity-kind", "amplitude")  # fmt: skip
    scene.run("load", "s", *scene.scans(), "--json", said="load.json")
    scene.run("members", "s", said="members.txt")
    scene.run("spots", "s", said="spots.txt")
    scene.run("spots", "s", "--geometry", "3d", "-o", "out/spots.gpkg")
    scene.run("evaluate", "s", "scan/hall.truth.json", said="evaluate.txt")
    scene.run("status", "s", said="status.txt")
    scene.run("qgis", "s", "-o", "out/s.qgz", said="qgis.txt")
    scene.run("report", "s", "-o", "out/report.html", said="report.txt")


def canal(scene: Scene) -> None:
    """Take the scans of scripts/demo-canal.sh through their stages."""
    scene.simulate("--name", "canal", "--batter", 2, "--towpath", "right", "--objects", 4, "--niches", 2, "--seed", 5,
                   command="simulate-canal")  # fmt: skip
    sonar = sorted(str(path.relative_to(scene.folder)) for path in (scene.folder / "scan").glob("canal.sonar-*.xyz"))
    scene.register(25832, 0, "--stations", "scan/canal.stations.csv", "--intensity-kind", "none")
    scene.run("load", "s", *scene.scans(), "--json", said="load.json")
    scene.run("register", "s", *sonar, "--ladders", "scan/canal.ladders.csv", "--up", "+z", "--water-level", 265.0,
              "--report", "out/registration.md", said="register.txt")  # fmt: skip
    scene.run("load", "s", *sonar, "--json", said="load-sonar.json")
    scene.run("run", "s", said="run.txt")
    scene.query("bed.txt", "SELECT * FROM tunnel_api.bed_volume('s', 10, 30, 262.5)")
    scene.run("status", "s", said="status.txt")
    scene.run("qgis", "s", "-o", "out/s.qgz", said="qgis.txt")
    scene.run("report", "s", "-o", "out/report.html", said="report.txt")


def epochs(scene: Scene) -> None:
    """Take two epochs of a tunnel through all stages and all measures; change one, and run again what is stale."""
    common = ("--preset", "demo", "--length", 60, "--lining", "segments", "--name")
    scene.simulate(*common, "first")
    scene.simulate(*common, "second", "--epoch", 1, "--grown-leaks", 2, "--dried-leaks", 2, "--new-leaks", 2,
                   "--moved-wall", 0.005, "--squeezed-ring", 0.004, "--bulges", 3, "--pose-error", 0.02,
                   "--pose-turn", 0.02)  # fmt: skip
    scene.run("init")
    scene.run("tunnel", "add", "t", "--srid", 25830, "--axis", "scan/first.axis.csv", "--start-chainage", 12300)
    for survey, name, date in (("s", "first", "2024-05-04"), ("later", "second", "2026-05-04")):
        scene.run("survey", "add", survey, "--tunnel", "t", "--date", date, "--trajectory", f"scan/{name}.trajectory.csv",
                  "--reference", f"scan/{name}.reference.csv", "--intensity", "Amplitude",
                  "--intensity-kind", "amplitude")  # fmt: skip
        scene.run("load", survey, f"scan/{name}.laz", "--json", said=f"load-{name}.json")
        scene.run("run", survey, said=f"run-{name}.txt")
    for name, text in {"lane": OUTLINE, "design": PROFILE}.items():
        (scene.folder / "scan" / f"{name}.csv").write_text(text)
    (scene.folder / "scan" / "track.csv").write_text("chainage,right,up\n12300,0,-3.2\n12360,0,-3.2\n")
    scene.run("profile", "add", "t", "scan/design.csv", said="profile.txt")
    measures = {
        "rings": ["rings", "s", "--find", "--diameter", 8, "--chord", "9:00-3:00"],
        "deviation": ["deviation", "s", "--axis-sigma", 0.01, "--every", 20],
        "evenness": ["evenness", "s"],
        "thickness": ["thickness", "s", "later", "--layer", "lining", "--axis-sigma", 0.005],
        "clearance": ["clearance", "s", "--gauge", "scan/lane.csv", "--track-axis", "scan/track.csv"],
        "compare": ["compare", "s", "later"],
    }
    for name, words in measures.items():
        scene.run(*words, "--json", said=f"{name}.json")
        scene.run(*words, said=f"{name}.txt")
        scene.run(*words, "-o", f"out/{name}.csv")
    scene.run("compare", "s", "later", "-o", "out/change.gpkg")
    scene.run("deviation", "s", "-o", "out/deviation.dxf")
    scene.query("edits.txt", MOVED_VERTEX)
    scene.run("status", "s", said="status-edited.txt")
    scene.run("deviation", "s", said="deviation-stale.txt", codes=(0, 2))
    scene.run("run", "s", "--stale", said="run-stale.txt")
    for name, words in measures.items():
        scene.run(*words, "--json", said=f"{name}-again.json")
    scene.run("status", "s", "--json", said="status.json")
    scene.run("export", "s", "-o", "out/s.gpkg", said="export.txt")
    scene.run("image", "s", "-o", "out/images")
    scene.run("qgis", "s", "-o", "out/s.qgz", said="qgis.txt")
    scene.run("report", "later", "-o", "out/report.html", said="report.txt")
    scene.run("survey", "export", "s", "-o", "out/s.tunneldb", said="archive.txt", codes=(0, 2))
    (scene.folder / "out" / "s.tunneldb").unlink(missing_ok=True)  # its rows are compared in the tables
    scene.run("prune", said="prune.txt")


def files(scene: Scene, real: Path | None) -> None:
    """Read the design alignments of the tests, and the real scan files each by itself."""
    scene.run("init")
    tests = Path(__file__).resolve().parent.parent / "tests"
    for name, srid in DESIGNS.items():
        shutil.copyfile(next(tests.rglob(name)), scene.folder / "scan" / name)
        scene.run("tunnel", "add", name, "--srid", srid, "--axis", f"scan/{name}", said=f"add-{name}.txt", codes=(0, 2))
    scene.run("tunnel", "stationing", "j-landxml.xml", "--show", said="stationing.txt")
    scene.run("tunnel", "list", said="tunnels.txt")
    for name in ("pump.e57", "lone-star.laz", "extra-bytes.laz"):
        if real is not None and (real / name).exists():
            shutil.copyfile(real / name, scene.folder / "scan" / name)
            scene.run("ground", f"scan/{name}", "-o", f"out/{name}.laz", said=f"ground-{name}.txt")
            scene.run("intensity", f"scan/{name}", "--intensity", "intensity", "--intensity-kind", "linear",
                      "--scanner", 0, 0, 1.5, "-o", f"out/{name}.png", said=f"intensity-{name}.txt",
                      codes=(0, 1, 2))  # fmt: skip


RELATIONS = """
SELECT n.nspname, c.relname,
       array_agg(a.attname::text ORDER BY a.attnum), array_agg(format_type(a.atttypid, NULL) ORDER BY a.attnum),
       coalesce((SELECT array_agg(k.attname::text ORDER BY k.attnum) FROM pg_index i
                   JOIN pg_attribute k ON k.attrelid = c.oid AND k.attnum = ANY (i.indkey)
                  WHERE i.indrelid = c.oid AND i.indisprimary), '{}')
  FROM pg_class c JOIN pg_namespace n ON n.oid = c.relnamespace
  JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0 AND NOT a.attisdropped
 WHERE n.nspname IN ('tunnel', 'tunnel_audit', 'tunnel_api', 'public') AND c.relkind IN ('r', 'p', 'v', 'm')
   AND NOT c.relispartition AND NOT EXISTS (SELECT FROM pg_depend d WHERE d.objid = c.oid AND d.deptype = 'e')
 GROUP BY n.nspname, c.relname, c.oid ORDER BY 1, 2
"""

CATALOG = """
WITH own AS (SELECT oid, nspname FROM pg_namespace WHERE nspname IN ('tunnel', 'tunnel_audit', 'tunnel_api', 'tunnel_queue'))
SELECT 'column' AS kind, a.attrelid::regclass || '.' || a.attname AS name,
       concat_ws(' ', format_type(a.atttypid, a.atttypmod), a.attnotnull, pg_get_expr(d.adbin, d.adrelid)) AS what,
       col_description(a.attrelid, a.attnum) AS comment
  FROM pg_attribute a JOIN pg_class c ON c.oid = a.attrelid JOIN own ON own.oid = c.relnamespace
  LEFT JOIN pg_attrdef d ON d.adrelid = a.attrelid AND d.adnum = a.attnum
 WHERE a.attnum > 0 AND c.relkind IN ('r', 'p', 'v')
UNION ALL SELECT 'view', c.oid::regclass::text, concat_ws(' ', pg_get_viewdef(c.oid), c.relacl),
       obj_description(c.oid, 'pg_class') FROM pg_class c JOIN own ON own.oid = c.relnamespace WHERE c.relkind = 'v'
UNION ALL SELECT 'constraint', k.conrelid::regclass || '.' || k.conname, pg_get_constraintdef(k.oid), NULL
  FROM pg_constraint k JOIN own ON own.oid = k.connamespace
UNION ALL SELECT 'index', indexrelid::regclass::text, pg_get_indexdef(indexrelid), NULL
  FROM pg_index i JOIN pg_class c ON c.oid = i.indexrelid JOIN own ON own.oid = c.relnamespace
UNION ALL SELECT 'trigger', t.tgrelid::regclass || '.' || t.tgname, pg_get_triggerdef(t.oid),
       obj_description(t.oid, 'pg_trigger')
  FROM pg_trigger t JOIN pg_class c ON c.oid = t.tgrelid JOIN own ON own.oid = c.relnamespace WHERE NOT t.tgisinternal
UNION ALL SELECT 'function', p.oid::regprocedure::text, concat_ws(' ', pg_get_function_arguments(p.oid), '->',
       pg_get_function_result(p.oid), p.provolatile, p.proparallel, p.prosecdef, p.proisstrict, p.proacl),
       obj_description(p.oid, 'pg_proc') FROM pg_proc p JOIN own ON own.oid = p.pronamespace
"""


def dump(scene: Scene) -> None:
    """Write all tables and views of the scene's database, and what the database says of them."""
    kinds: dict[str, Any] = {}
    with psycopg.connect(scene.run("server", "start").strip(), autocommit=True) as connection:
        connection.execute("SET timezone = 'UTC'")
        for schema, name, columns, types, key in connection.execute(RELATIONS).fetchall():
            full, target = sql.Identifier(schema, name), scene.folder / "tables" / f"{schema}.{name}"
            if name == "point":
                dump_points(connection, full, dict(zip(columns, types, strict=True)), target.with_name(target.name + ".npz"))
                continue
            order = sql.SQL("ORDER BY {}").format(sql.SQL(", ").join(map(sql.Identifier, key))) if key else sql.SQL("")
            rows = copy_rows(connection, sql.SQL("SELECT * FROM {} {}").format(full, order))
            write_rows(target, columns, rows if key else sorted(rows))
            kinds[target.name] = {"types": dict(zip(columns, types, strict=True)), "key": key}
        write_rows(scene.folder / "tables" / "catalog", ["kind", "name", "what", "comment"],
                   sorted(copy_rows(connection, sql.SQL(CATALOG))))  # fmt: skip
    kinds["catalog"] = {"types": {}, "key": ["kind", "name"]}
    (scene.folder / "tables" / "types.txt").write_text(json.dumps(kinds, indent=1))


def copy_rows(connection: psycopg.Connection[Any], query: sql.Composable) -> list[list[str]]:
    r"""Return the rows of a query as text, NULL as \N."""
    with connection.cursor().copy(sql.SQL("COPY ({}) TO STDOUT (FORMAT csv, NULL '\\N')").format(query)) as copy:
        return list(csv.reader(StringIO(b"".join(bytes(part) for part in copy).decode(), newline="")))


def write_rows(target: Path, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Write rows as a compressed CSV file."""
    with gzip.open(target.with_name(target.name + ".csv.gz"), "wt", compresslevel=3, newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([columns, *rows])


def dump_points(connection: psycopg.Connection[Any], table: sql.Identifier, types: Mapping[str, str], target: Path) -> None:
    """Write a table of points as arrays, ordered by time and place; texts as their hashes."""
    terms: dict[str, tuple[str, str]] = {}
    for name, kind in types.items():
        column = f'"{name}"'
        if kind == "geometry":
            terms |= {axis: (f"ST_{axis.upper()}({column})", ">f8") for axis in "xyz"}
        elif kind in ("double precision", "real"):
            terms[name] = (f"coalesce({column}::float8, 'NaN')", ">f8")
        elif kind in ("smallint", "integer", "bigint"):
            terms[name] = (f"coalesce({column}::int8, -9e18::int8)", ">i8")
        else:
            terms[name] = (f"coalesce(hashtextextended({column}::text, 0), 0)", ">i8")
    query = "SELECT " + ", ".join(term for term, _ in terms.values()) + " FROM {}"
    with connection.cursor().copy(sql.SQL("COPY (" + query + ") TO STDOUT (FORMAT binary)").format(table)) as copy:
        data = b"".join(bytes(part) for part in copy)
    record = [("", ">i2"), *(item for name, (_, kind) in terms.items() for item in ((f"size of {name}", ">i4"), (name, kind)))]
    (extension,) = struct.unpack_from(">i", data, 15)
    dtype = np.dtype([("fields", ">i2"), *record[1:]])
    rows = np.frombuffer(data, dtype, (len(data) - 19 - extension - 2) // dtype.itemsize, 19 + extension)
    order = np.lexsort([rows[name] for name in ("scan_id", "z", "y", "x", "gps_time") if name in terms])
    arrays: dict[str, Any] = {name: rows[name][order].astype(kind[1:]) for name, (_, kind) in terms.items()}
    np.savez_compressed(target, **arrays)
