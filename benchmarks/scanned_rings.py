"""Rings of scanned linings against those that scans were simulated from: pitch, joints, radius, ovality, steps, and time.

python -m benchmarks.scanned_rings            # four scans of 60 to 100 rings: some ten minutes on two cores
python -m benchmarks.scanned_rings --rings 30 --kinds plain
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
from psycopg.rows import dict_row

from benchmarks.common import print_table, save, scratch_database, tunneldb
from tunneldb.arrays import Float

KINDS: dict[str, tuple[float, list[str]]] = {
    "plain": (1.0, ["--leaks", "0"]),
    "dirty": (1.3, ["--leaks", "4", "--soot", "4", "--grime", "3", "--salts", "3", "--paint", "4", "--patches", "6"]),
    "leaking": (2.0, ["--leaks", "20", "--joint-leaks", "10", "--ring-leaks", "2", "--drips"]),
    "unlike rings": (1.5, ["--leaks", "4", "--ring-step", "0.002"]),
}
"""Ring length, m, and options of the simulator."""

_RADIUS = 4.0
_SCAN = [
    "--scanner", "profiler", "--profile-spacing", "0.02", "--profile-points", "1250", "--lining", "segments",
]  # fmt: skip


def scanned(dsn: str, kind: str, rings: int, folder: Path) -> dict[str, object]:
    """Simulate, load, run and measure; figures of one kind of lining."""
    pitch, options = KINDS[kind]
    name = kind.replace(" ", "-")
    length = round(pitch * rings)
    tunneldb("simulate", folder, "--name", name, "--length", length, "--ring", pitch, *_SCAN, *options, dsn=dsn)
    made = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    start, srid = made["chainage"][0], made["parameters"]["srid"]
    tunneldb("tunnel", "add", name, "--srid", srid, "--axis", folder / f"{name}.axis.csv", "--start-chainage", start, dsn=dsn)
    tunneldb(
        "survey", "add", name, "--tunnel", name, "--date", "2024-05-04", "--trajectory", folder / f"{name}.trajectory.csv",
        "--reference", folder / f"{name}.reference.csv", "--intensity", "Amplitude", "--intensity-kind", "amplitude", dsn=dsn,
    )  # fmt: skip
    tunneldb("load", name, *sorted(folder.glob(f"{name}*.laz")), dsn=dsn)
    tunneldb("run", name, dsn=dsn)
    began = time.perf_counter()
    tunneldb("rings", name, "--find", "--diameter", 2 * _RADIUS, dsn=dsn)
    seconds = time.perf_counter() - began
    with psycopg.connect(dsn, row_factory=dict_row) as conn:
        rows = conn.execute("SELECT * FROM tunnel_api.ring WHERE survey = %s ORDER BY chainage_from", [name]).fetchall()
    with psycopg.connect(dsn) as conn:
        steps = np.array(
            conn.execute(
                "SELECT number, step, step_se FROM tunnel_api.ring_step WHERE survey = %s AND step IS NOT NULL", [name]
            ).fetchall()
        ).reshape(-1, 3)
    found = (rows[-1]["chainage_to"] - rows[0]["chainage_from"]) / len(rows)
    return {"kind": kind, "true": pitch, "pitch": found, "seconds": seconds, **_errors(rows, made, steps)}


def _errors(rows: list[dict[str, Any]], made: dict[str, Any], steps: Float) -> dict[str, object]:
    """What 95 % of the errors are below, mm and %."""
    truth = made["rings"]
    middle = np.array([(row["chainage_from"] + row["chainage_to"]) / 2 for row in rows])
    which = np.floor((middle - truth["first"]) / truth["length"]).astype(int)
    out = np.array(truth["step"])[which]
    radius = np.array([row["radius"] or np.nan for row in rows])
    ovality = np.array([np.nan if row["ovality"] is None else row["ovality"] for row in rows])
    joints = np.array([row["chainage_from"] for row in rows])
    off = (joints - truth["first"]) / truth["length"]
    by_number = {int(row["number"]): k for k, row in enumerate(rows)}
    at = np.array([by_number[int(number)] for number in steps[:, 0]])
    true = np.where(at > 0, out[at - 1] - out[at], np.nan)  # the ring behind stands in where its radius is less
    wrong = np.abs(steps[:, 1] - true)
    return {
        "rings": len(rows),
        "joints": 1e3 * float(np.quantile(np.abs(off - np.rint(off)) * truth["length"], 0.95)),
        "radius": 1e3 * float(np.nanquantile(np.abs(radius - _RADIUS - out), 0.95)),
        "ovality": 100.0 * float(np.nanquantile(ovality, 0.95)),
        "step": 1e3 * float(np.nanquantile(wrong, 0.95)),
        "within": 100.0 * float(np.nanmean(wrong <= 1.96 * steps[:, 2])),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rings", type=int, default=100, help="rings of each scan")
    parser.add_argument("--kinds", nargs="*", default=list(KINDS), choices=list(KINDS), help="kinds of lining")
    parser.add_argument("--dsn", default=os.environ.get("TUNNELDB_DSN"), help="server to use")
    options = parser.parse_args()
    with scratch_database(options.dsn) as dsn, tempfile.TemporaryDirectory() as folder:
        found = [scanned(dsn, kind, options.rings, Path(folder)) for kind in options.kinds]
    header = (
        "lining", "rings", "pitch m", "found less true mm", "joints mm", "radius mm", "ovality %", "steps mm",
        "within 1.96 se %",
        "s",
    )  # fmt: skip
    rows = [
        (
            one["kind"], one["rings"], one["true"], round(1e3 * (one["pitch"] - one["true"]), 2), round(one["joints"], 1),
            round(one["radius"], 2), round(one["ovality"], 3), round(one["step"], 2), round(one["within"], 1),
            round(one["seconds"], 1),
        )
        for one in found
    ]  # fmt: skip
    print_table("scanned rings of 3 mm range noise: 95 % of errors are below", header, rows)
    save("scanned_rings", {"rings": found})


if __name__ == "__main__":
    main()
