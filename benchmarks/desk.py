"""A day of an inspector, done in QGIS Desktop by mouse and keys, and what the database has of it.

    python -m benchmarks.desk                        # simulates and detects a tunnel first: some minutes
    python -m benchmarks.desk --folder DIR           # keeps all there, and begins with what is there
    python -m benchmarks.desk --folder DIR --pictures docs/images

A person who is nothing but inspector draws 20 findings of eight kinds, redraws, splits, merges, deletes, photographs and takes
back (``desk_in_qgis.py``). Each step must be in the audit under her name; then all stages run again, and nothing may be lost or
doubled. What is not as it should be is printed, and the exit code is 1. Needs QGIS Desktop and Xvfb (packages ``qgis``,
``xvfb``).
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import psycopg
from PIL import Image, ImageDraw
from psycopg.conninfo import conninfo_to_dict

from benchmarks.common import print_table, progress, save, tunneldb
from tunneldb.database import connect, resolve_dsn

SURVEY, INSPECTOR, SCREEN = "demo-2024", "ines", "1500x950x24"
SCRIPT = Path(__file__).with_name("desk_in_qgis.py")
KINDS = {
    "leak": 2, "spall": 4, "delamination": 3, "efflorescence": 2, "crack": 4, "damaged_joint": 1, "drip": 2, "missing_bolt": 2,
}  # fmt: skip
"""What she draws."""

STATE = (
    "SELECT id, kind, origin, review, severity, remark, merged_into, parent_id, photos, round(area::numeric, 6),"
    " ST_AsText(unrolled, 6) FROM tunnel_api.finding WHERE survey = %s AND origin <> 'detected' ORDER BY id"
)


def prepare(folder: Path) -> None:
    """Simulate, load and detect a tunnel; make a person who is an inspector."""
    scan = folder / "scan"
    if (folder / "ready").exists():
        return
    progress("simulates a tunnel, loads it and finds its leaks")
    tunneldb("simulate", scan, "--preset", "demo", "--lining", "segments", "--drips")
    tunneldb("init")
    place = ("--srid", 25830, "--axis", scan / "demo.axis.csv", "--start-chainage", 12300)
    tunneldb("tunnel", "add", "demo", *place)
    tunneldb(
        "survey", "add", SURVEY, "--tunnel", "demo", "--date", "2024-05-04", "--trajectory", scan / "demo.trajectory.csv",
        "--reference", scan / "demo.reference.csv", "--intensity", "Amplitude", "--intensity-kind", "amplitude",
    )  # fmt: skip
    tunneldb("load", SURVEY, scan / "demo.laz")
    tunneldb("run", SURVEY)
    with connect(resolve_dsn(None)) as conn:
        conn.execute(f"CREATE ROLE {INSPECTOR} LOGIN IN ROLE tunnel_inspector".encode())
    (folder / "ready").touch()


def photographs(folder: Path) -> None:
    """Two pictures, as of a camera."""
    for name, colour in (("photo-1.jpg", (96, 88, 80)), ("photo-2.jpg", (120, 112, 96))):
        picture = Image.new("RGB", (640, 480), colour)
        ImageDraw.Draw(picture).line([(60, 420), (220, 260), (330, 240), (600, 40)], fill=(30, 26, 22), width=9)
        picture.save(folder / name)


def in_qgis(step: str, folder: Path, pictures: Path) -> list[dict[str, Any]]:
    """Have the inspector's day done in QGIS Desktop, or look at it after that; what was done, step by step."""
    done = folder / f"{step}.json"
    done.unlink(missing_ok=True)
    (folder / "profile").mkdir(exist_ok=True)
    environment = {
        "PATH": "/usr/bin:/bin", "HOME": str(folder / "profile"), "LC_ALL": "C.UTF-8",
        "DESK_STEP": step, "DESK_FOLDER": str(folder),
        "DESK_PICTURES": str(pictures), "PGSERVICEFILE": str(folder / "pg_service.conf"),
    }  # fmt: skip
    screen = ["xvfb-run", "--auto-servernum", f"--server-args=-screen 0 {SCREEN} -nolisten tcp"]
    command = ["qgis", "--nologo", "--noversioncheck", "--noplugins", "--profiles-path", str(folder / "profile")]
    ran = subprocess.run(
        [*screen, *command, "--project", folder / "desk.qgz", "--code", SCRIPT], env=environment, capture_output=True,
        text=True, timeout=300, check=False,
    )  # fmt: skip
    if ran.returncode or not done.exists():
        raise SystemExit(f"QGIS ended with {ran.returncode}:\n{ran.stderr[-4000:]}")
    steps: list[dict[str, Any]] = json.loads(done.read_text())
    return steps


def wrong_after_the_day(conn: psycopg.Connection, before: int, steps: list[dict[str, Any]]) -> list[str]:
    """Return deviations of findings and audit from the steps."""
    wrong = [f"{step['step']}: {step['said']}" for step in steps if step.get("failed")]
    drawn = Counter(step["kind"] for step in steps if step["step"] == "drawn")
    if drawn != KINDS:
        wrong.append(f"drawn were {dict(drawn)}, not {KINDS}")
    entries = conn.execute(
        "SELECT who, view, action, before ? 'geom', after ->> 'origin', undoes IS NOT NULL, part_of IS NOT NULL"
        " FROM tunnel_api.audit WHERE survey = %s AND id > %s ORDER BY id", [SURVEY, before],
    ).fetchall()  # fmt: skip
    if others := {who for who, *_ in entries if who != INSPECTOR}:
        wrong.append(f"the audit has {others} beside {INSPECTOR}")
    firsts = [entry for entry in entries if not entry[6]]
    found = Counter(
        "undone" if undo else "photographed" if view == "photo" else {"insert": "drawn", "delete": "deleted"}.get(action)
        or (origin if origin in ("split", "merged") else "redrawn" if geom else "reviewed")
        for _, view, action, geom, origin, undo, _ in firsts
    )  # fmt: skip
    wanted = Counter(step["step"] for step in steps)
    if found != wanted:
        wrong.append(f"the audit has {dict(found)}, done was {dict(wanted)}")
    return wrong


def wrong_after_the_rerun(conn: psycopg.Connection, former: list[Any], counted: int) -> list[str]:
    """Return losses and duplicates after all stages were run again."""
    now = conn.execute(STATE, [SURVEY]).fetchall()
    wrong = [f"was {a}\nis  {b}" for a, b in zip(former, now, strict=False) if a[:-2] != b[:-2] or a[-1] != b[-1]]
    if len(now) != len(former):
        wrong.append(f"of {len(former)} findings that people drew there are {len(now)}")
    (again,) = conn.execute(  # type: ignore[misc]
        "SELECT count(*) FROM tunnel_api.finding WHERE survey = %s AND counted AND wet", [SURVEY]
    ).fetchone()
    if again != counted:
        wrong.append(f"{counted} leaks counted, now {again} do")
    (doubled,) = conn.execute(  # type: ignore[misc]
        "SELECT count(*) FROM tunnel_api.leak a JOIN tunnel_api.leak b ON a.id < b.id AND a.survey_id = b.survey_id"
        " AND a.counted AND b.counted AND ST_Area(ST_Intersection(a.unrolled, b.unrolled)) > 0.5 * least(a.area, b.area)"
    ).fetchone()
    return wrong + ([f"{doubled} leaks count twice"] if doubled else [])


def run(folder: Path, pictures: Path) -> int:
    """All of it; the exit code."""
    os.environ["TUNNELDB_HOME"] = str(folder / "home")
    prepare(folder)
    photographs(folder)
    dsn = resolve_dsn(None)
    theirs = conninfo_to_dict(dsn) | {"user": INSPECTOR}
    lines = (f"{key}={value}" for key, value in theirs.items())
    (folder / "pg_service.conf").write_text("\n".join(["[desk]", *lines, ""]))
    tunneldb("qgis", SURVEY, "-o", folder / "desk.qgz", "--service", "desk")
    with connect(dsn) as conn:
        conn.execute("DELETE FROM tunnel.finding WHERE origin <> 'detected'")  # of a day before
        conn.commit()
        (before,) = conn.execute("SELECT coalesce(max(id), 0) FROM tunnel_api.audit").fetchone()  # type: ignore[misc]
        conn.rollback()
        progress("the day in QGIS Desktop")
        start = time.perf_counter()
        steps = in_qgis("day", folder, pictures)
        took = time.perf_counter() - start
        wrong = wrong_after_the_day(conn, before, steps)
        former = conn.execute(STATE, [SURVEY]).fetchall()
        (counted,) = conn.execute(  # type: ignore[misc]
            "SELECT count(*) FROM tunnel_api.finding WHERE survey = %s AND counted AND wet", [SURVEY]
        ).fetchone()
        conn.rollback()
        progress("all stages again")
        tunneldb("run", SURVEY, "--from", "axis")
        wrong += wrong_after_the_rerun(conn, former, counted)
        in_qgis("look", folder, pictures)
    print_table("Done", ("step", "times"), sorted(Counter(step["step"] for step in steps).items()))
    print(
        f"\nin QGIS {took:.0f} s; {len(former)} findings that people drew before and after the rerun, {counted} leaks counted"
    )
    print("\n".join(wrong) if wrong else "all of it is in the audit, nothing lost, nothing doubled")
    save("desk", {"seconds": took, "steps": steps, "wrong": wrong})
    return 1 if wrong else 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, help="kept, and begun with what is there; default: a temporary one")
    parser.add_argument("--pictures", type=Path, help="folder for pictures; default: that folder")
    arguments = parser.parse_args()
    if arguments.folder is not None:
        arguments.folder.mkdir(parents=True, exist_ok=True)
        sys.exit(run(arguments.folder.resolve(), (arguments.pictures or arguments.folder).resolve()))
    with tempfile.TemporaryDirectory(prefix="tunneldb-desk-") as folder:
        code = run(Path(folder), (arguments.pictures or Path(folder)).resolve())
        tunneldb("server", "stop")
    sys.exit(code)


if __name__ == "__main__":
    main()
