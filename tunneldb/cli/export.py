"""The command ``export``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np
import psycopg

from tunneldb.cli.coverage import say_coverage, say_remarks
from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FilePath
from tunneldb.cli.progress import bar, say, step
from tunneldb.cli.stretch import Stretch, parse_stretch, stretch_options
from tunneldb.cli.tables import print_classes
from tunneldb.counted import counted
from tunneldb.database import connect
from tunneldb.errors import NotReadyError, UserError
from tunneldb.files import exit_on_sigterm, made_folder, replacing
from tunneldb.stages.run import loaded_kilometres, parse_km
from tunneldb.store.coverage import read_coverage
from tunneldb.store.remarks import read_remarks
from tunneldb.store.survey import Survey, get_survey

_PLAIN = (".gpkg", ".dxf")


@command(
    examples=[
        "tunneldb export ringo-2024 -o ringo.gpkg",
        "tunneldb export ringo-2024 -o ringo.dxf --from 511+700 --to 511+800",
        "tunneldb export ringo-2024 --classified -o classed --km 511",
        "tunneldb export ringo-2024 --classified --copc -o clouds",
    ]
)
@click.argument("survey")
@click.option(
    "-o",
    "--output",
    required=True,
    type=FilePath(),
    help="File to write, .gpkg or .dxf; with --classified a folder, created if missing.",
)
@stretch_options
@click.option("--classified", is_flag=True, help="Scan files at full density, each point with its class.")
@click.option("--copc", is_flag=True, help="With --classified: a Cloud Optimized Point Cloud for each kilometre.")
@click.option("--km", metavar="A-B", help="With --classified: only files that touch these kilometres, 12 or 12-14.")
@click.pass_obj
def export(
    settings: Settings,
    survey: str,
    output: Path,
    start: str | None,
    end: str | None,
    classified: bool,
    copc: bool,
    km: str | None,
) -> None:
    """Write SURVEY as GeoPackage or DXF drawing, or its classified scan files.

    A GeoPackage has the layers of the QGIS project for axis, lining, leaks and ground with their styles, and chainage
    ticks and the lining unrolled on the map. Layers of the unrolled plane (x is the chainage, y the arc, m) have an
    undefined Cartesian system, all others the tunnel's.

    A DXF drawing (2010, metres) has axis, sections and findings in true coordinates, with chainage ticks; below the map
    the unrolled lining and the profiles of the sections with their leaks. Rejected findings are not drawn.

    Both have findings of all kinds. The layer of coverage gaps shows where leaks could be missed: lining not searched,
    outdated or hardly inspected. The table or layer of remarks has notes and limitations of the results.

    With --classified the scan files are written as LAZ 1.4 with the class of each point, from stage ground, which
    must be up to date in every kilometre of a file: 2 ground, 64 lining, 65 niche, 66 fixture, 67 rail, 68 object, 69
    target sphere, 70 noise, 1 outside the surveyed tunnel. All other data are kept. A file across several kilometres
    is written once, whole; it appears when it is complete, and never overwrites a file of the survey. Coordinates keep
    the unit of the scan file, also where it was converted on loading.

    With --classified --copc the points are written by kilometres, each as SURVEY-kmNNN.copc.laz, a Cloud Optimized
    Point Cloud (LAZ 1.4 in octree order), with SURVEY.vpc, a virtual point cloud of all for QGIS 3.32 and later and
    PDAL. With --km only these kilometres are written; others in the folder stay in SURVEY.vpc.
    """
    if copc and not classified:
        raise UserError("--copc goes with --classified: it writes the points of the scan files with their classes")
    if classified and (start is not None or end is not None):
        raise UserError("--classified writes whole scan files: choose them by --km, not by --from and --to")
    if not classified and km is not None:
        raise UserError("--km goes with --classified: a stretch of a GeoPackage or DXF is chosen by --from and --to")
    if not classified and output.suffix.lower() not in _PLAIN:
        raise UserError(f"{output}: say by the ending what to write, .gpkg or .dxf; scan files by --classified")
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        if classified:
            _write_classified(conn, found, output, km, copc)
        else:
            _write_plain(conn, found, output, parse_stretch(conn, found, start, end))


def _write_plain(conn: psycopg.Connection[Any], survey: Survey, output: Path, stretch: Stretch) -> None:
    from tunneldb.export.exchange import write_survey

    coverage = read_coverage(conn, survey, stretch.low, stretch.high)
    with exit_on_sigterm(), replacing(output) as temporary, bar("parts") as progress:
        counts = write_survey(conn, survey, stretch.low, stretch.high, temporary, step(progress))
    add_to_json(survey=survey.name, file=output, layers=counts)
    say_coverage(coverage, survey)
    say_remarks(read_remarks(conn, survey, stretch.low, stretch.high), survey)
    notify(f"{output}: " + ", ".join(f"{name} {count}" for name, count in counts.items() if count))


def _write_classified(conn: psycopg.Connection[Any], survey: Survey, output: Path, km: str | None, copc: bool) -> None:
    from tunneldb.export.pointcloud.copc import export_copc
    from tunneldb.export.pointcloud.survey import export_classified

    if output.exists() and not output.is_dir():
        raise UserError(f"{output}: --classified writes several files: name a folder")
    total = np.zeros(256, np.int64)
    there = loaded_kilometres(conn, survey)
    if not there:
        raise NotReadyError(f"survey {survey.name} holds no points yet: tunneldb load {survey.name} FILE...")
    wanted = parse_km(km, there)
    conn.rollback()
    files: list[dict[str, Any]] = []
    add_to_json(survey=survey.name, files=files)
    with exit_on_sigterm(), made_folder(output), bar("points") as progress:
        for file in (export_copc if copc else export_classified)(conn, survey, output, wanted, step(progress)):
            points = int(file.counts.sum())
            rate = points / file.seconds / 1e6
            unit, height_unit = file.units.plan, file.units.height
            units = "" if file.units.metric else f", x and y in {unit}, z in {height_unit}, as in the scan file"
            say(f"{file.path}: {counted(points, 'point')}{units}, {rate:.1f} million/s", err=True)
            files.append(
                {"file": file.path, "points": points, "seconds": file.seconds, "unit": unit, "height_unit": height_unit}
            )
            total += file.counts
    print_classes(total)
