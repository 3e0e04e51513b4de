"""The command ``spheres``."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command, notify
from tunneldb.cli.param_types import FilePath, FiniteRange
from tunneldb.cli.progress import bar, step
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.store.survey import get_survey


@command(
    examples=[
        "tunneldb spheres ringo-2024 --radius 0.0725",
        "tunneldb spheres ringo-2024 --radius 0.0725 --control control.csv --report spheres.md",
    ]
)
@click.argument("survey")
@click.option(
    "--radius",
    type=FiniteRange(0.02, 0.5),
    required=True,
    metavar="M",
    help="Radius of the spheres, m, such as 0.0725.",
)
@click.option(
    "--tolerance",
    type=FiniteRange(0.0005, 0.05),
    default=0.005,
    show_default=True,
    metavar="M",
    help="Limit of the radius error and of the residuals (rms), m.",
)
@click.option(
    "--control",
    type=FilePath(dir_okay=False),
    metavar="CSV",
    help="Control points, id,x,y,z, in the tunnel's system or another.",
)
@click.option(
    "--within",
    type=FiniteRange(0.001, 10.0),
    default=0.1,
    show_default=True,
    metavar="M",
    help="Greatest distance of a control point from its sphere, m.",
)
@click.option("--report", type=FilePath(dir_okay=False), metavar="FILE", help="Report to write, as Markdown.")
@click.pass_obj
def spheres(
    settings: Settings,
    survey: str,
    radius: float,
    tolerance: float,
    control: Path | None,
    within: float,
    report: Path | None,
) -> None:
    """Find the target spheres in the scan files of SURVEY, and compare them with control points.

    The files are read at full density. Results replace earlier ones (tunnel_api.target_sphere). Residuals and the
    best rigid motion onto the control points are reported, never applied. No stage is required; after sections the
    spheres have a chainage, and after ground the search excludes the ground.
    """
    from tunneldb.export.tables.targets import (
        CONTROL_HEADER,
        HEADER,
        control_rows,
        how_line,
        motion_lines,
        sphere_rows,
        unmatched_lines,
    )
    from tunneldb.export.tables.targets import report as as_report
    from tunneldb.files import replacing
    from tunneldb.pipeline.target_control import compare, read_control
    from tunneldb.pipeline.targets import search
    from tunneldb.store.alignment import load_stationing

    if tolerance >= radius / 4.0:
        raise UserError(f"--tolerance {tolerance:g} is too much for a radius of {radius:g} m: give less than a quarter of it")
    points = read_control(control) if control else None
    if report is not None and not report.parent.is_dir():
        raise UserError(f"{report}: there is no folder {report.parent}")
    with connect(settings.dsn) as conn:
        chosen = get_survey(conn, survey)
        conn.rollback()
        with bar("points") as progress:
            found = search(conn, chosen, radius, tolerance, step(progress))
        stationing = load_stationing(conn, chosen.tunnel_id)
    comparison = compare(found.spheres, points, within) if points else None
    count = len({row.number for row in found.spheres})
    add_to_json(survey=survey, count=count, spheres=found.spheres, others=len(found.refusals), points=found.points)
    add_to_json(comparison=comparison, file=report)
    if found.spheres:
        print_table(HEADER, sphere_rows(found.spheres, stationing), right=(0, 1, 3, 4, 5, 6, 7, 8, 9, 10))
    click.echo(f"{count} target spheres, seen {len(found.spheres)} times; {len(found.refusals)} other round things")
    if comparison is not None:
        click.echo(how_line(comparison))
        if comparison.motion is not None:
            print_table(CONTROL_HEADER, control_rows(comparison), right=(0, 2, 3, 4, 5, 6))
            for line in motion_lines(comparison.motion):
                click.echo(line)
        for line in unmatched_lines(comparison):
            click.echo(line)
    if report is not None:
        with replacing(report) as temporary:
            temporary.write_text(as_report(chosen, stationing, found, radius, tolerance, comparison), encoding="utf-8")
        notify(f"report to {report}")
