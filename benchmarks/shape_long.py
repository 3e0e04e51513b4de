"""Each command of shape on a long tunnel scanned twice: its time, its processor time and its memory, from files on.

    python -m benchmarks.shape_long                     # 25 km, two surveys at survey density; two hours
    python -m benchmarks.shape_long --km 2
    python -m benchmarks.shape_long --dsn … --filled    # the verbs again, in a database where both surveys are
    python -m benchmarks.shape_long --only rings        # those whose line begins so

The tunnel is lined with rings of 1.5 m and carries rails; the later survey has leaks that grew, dried and are new, and a wall
that moved by 5 mm. The design is the circle that the simulator's section is of. Joints are too narrow for points at survey
density: rings are found at --density 1000 only. Times are the command's by the clock, start-up included; memory is the
command's own at its greatest, without the server.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from contextlib import nullcontext
from pathlib import Path

from benchmarks.common import print_table, progress, save, scratch_database, tunneldb
from benchmarks.files import watched
from benchmarks.scene import Scene
from tunneldb.database import resolve_dsn

OLD, NEW = "long-2024", "long-2026"
PROFILE = "right,up,radius\n4,0,4\n0,-4,4\n-4,0,4\n0,4,4\n4,0,4\n"
GAUGE = "right,up\n-1.6,0.1\n-1.6,3.5\n-1,4.3\n1,4.3\n1.6,3.5\n1.6,0.1\n-1.6,0.1\n"
TUNNEL = (
    "--radius", 4000, "--s-curve", "--slope", 1.7, "--scanner", "profiler", "--no-truth", "--lining", "segments", "--seed", 3,
)  # fmt: skip
LATER = ("--epoch", 1, "--grown-leaks", 20, "--dried-leaks", 20, "--new-leaks", 20, "--moved-wall", 0.005)


def fill(dsn: str, folder: Path, kilometres: int, density: int) -> None:
    """Two scans of the tunnel, from files through all stages."""
    common = ("--length", 1000 * kilometres, "--leaks", 40 * kilometres, "--density", density, *TUNNEL)
    for survey, later, day in ((OLD, (), "2024-05-04"), (NEW, LATER, "2026-05-04")):
        progress(f"{survey}: {kilometres} km")
        scene = Scene.simulate(folder / survey, "long", *common, *later)
        if survey == OLD:
            tunneldb("tunnel", "add", "long", "--srid", 25830, "--axis", scene.file("axis.csv"), dsn=dsn)
        tunneldb(
            "survey", "add", survey, "--tunnel", "long", "--date", day, "--trajectory", scene.file("trajectory.csv"),
            "--reference", scene.file("reference.csv"), "--intensity", "Amplitude", "--intensity-kind", "amplitude", dsn=dsn,
        )  # fmt: skip
        tunneldb("batch", survey, *scene.scans, "--density", "all", dsn=dsn)
    profile = folder / "profile.csv"
    profile.write_text(PROFILE, "utf-8")
    tunneldb("profile", "add", "long", profile, dsn=dsn)


def verbs(gauge: Path, density: int) -> dict[str, tuple[object, ...]]:
    """Return the measured commands with their arguments, in order."""
    found = {"rings found": ("rings", NEW, "--find", "--diameter", 8)} if density >= 1000 else {}
    return {
        "rings by length": ("rings", OLD, "--length", 1.5, "--diameter", 8),
        **found,
        "deviation": ("deviation", OLD),
        "evenness": ("evenness", OLD),
        "thickness": ("thickness", OLD, NEW),
        "clearance": ("clearance", OLD, "--gauge", gauge),
        "compare": ("compare", OLD, NEW),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--km", type=int, default=25)
    parser.add_argument("--density", type=int, default=100, help="points per m²")
    parser.add_argument("--filled", action="store_true", help="the database of --dsn holds both surveys already")
    parser.add_argument("--only", action="append", default=[], metavar="WORD", help="commands whose line begins so")
    arguments = parser.parse_args()
    load = os.getloadavg()[0]
    with (
        tempfile.TemporaryDirectory() as name,
        nullcontext(resolve_dsn(arguments.dsn)) if arguments.filled else scratch_database(arguments.dsn) as dsn,
    ):
        gauge = Path(name) / "gauge.csv"
        gauge.write_text(GAUGE, "utf-8")
        if not arguments.filled:
            fill(dsn, Path(name), arguments.km, arguments.density)
        found = {}
        for title, command in verbs(gauge, arguments.density).items():
            if not arguments.only or any(title.startswith(word) for word in arguments.only):
                progress(title)
                found[title] = watched(command, dsn)
                progress(f"{title}: {found[title]}")
    print_table(
        f"{arguments.km} km",
        ("command", "seconds", "processor s", "s per km", "peak, MB"),
        [(title, f["seconds"], f["cpu"], f["seconds"] / arguments.km, f["peak"] / 1e6) for title, f in found.items()],
    )
    settings = {"km": arguments.km, "density": arguments.density, "load_average_before": load, "command": sys.argv[1:]}
    print(f"\n{save('shape_long', settings | {'verbs': found})}")


if __name__ == "__main__":
    main()
