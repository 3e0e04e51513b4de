"""The verb ``evaluate``."""

from __future__ import annotations

from pathlib import Path

import click

from tunneldb.cli.main import Settings
from tunneldb.cli.output import tell, verb
from tunneldb.cli.progress import bar, step
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.store.survey import get_survey


@verb(
    examples=[
        "tunneldb evaluate demo-2024 demo/demo.truth.gpkg",
        "tunneldb evaluate demo-2024 truth.geojson --km 12 -o figures.json",
    ]
)
@click.argument("survey")
@click.argument("truth", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--layer", metavar="NAME", help="Layer of the file that holds the true leaks [the only one, or leak].")
@click.option("--km", metavar="A-B", help="Only these kilometres: 12 or 12-14.")
@click.option(
    "--min-area",
    type=click.FloatRange(min=0),
    default=0.1,
    show_default=True,
    metavar="M2",
    help="Smaller true leaks are neither demanded nor do they harm, m².",
)
@click.option(
    "-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="File to write: .json (all) or .csv (figures)."
)
@click.pass_obj
def evaluate(
    settings: Settings, survey: str, truth: Path, layer: str | None, km: str | None, min_area: float, output: Path | None
) -> None:
    """Hold the leaks of SURVEY against true ones, from the file TRUTH.

    TRUTH is a GeoPackage or GeoJSON file with a polygon for each leak: in the unrolled plane (x chainage, y arc; no coordinate
    system), or 3D in the tunnel's. Leaks that an inspector rejected are left out. Nothing is changed.

    \b
    recall      of the leaks: share of which at least half was found; of the area: share that was found
    precision   of the leaks: share of which at least half is true; of the area: share that is true
    false       leaks that touch no true one
    area error  |found - true| / true area, median and 95 % quantile
    edge        distance between found and true outlines, median and 95 % quantile
    """  # noqa: D301 - \b is click's mark for lines to be kept
    from tunneldb.evaluate import report as reports
    from tunneldb.evaluate.measure import compare
    from tunneldb.evaluate.survey import read_findings, scanner_distance
    from tunneldb.evaluate.truth import read_truth
    from tunneldb.files import replacing

    form = output.suffix.lower() if output else ""
    if output and form not in (".json", ".csv"):
        raise UserError(f"{output}: the name must end in .json or .csv")
    with connect(settings.dsn) as conn, bar("leaks") as progress:
        conn.rollback()
        conn.read_only = True
        found = get_survey(conn, survey)
        begin = step(progress)
        begin(f"reading {truth.name}", None)
        true = read_truth(conn, found, truth, layer)
        findings = read_findings(conn, found, km)
        advance = begin(f"comparing with {truth.name}", len(true.shapes) + len(findings.shapes))
        comparison = compare(true.shapes, findings.shapes, min_area, findings.stretch, advance)
        outside = sum(not shape.intersects(findings.stretch) for shape in true.shapes)
        if outside == len(true.shapes):
            kilometres = ", ".join(map(str, findings.kilometres))
            raise UserError(
                f"{truth}: no leak lies where leaks were sought, kilometres {kilometres}; x must be the chainage, m"
            )
        begin("distances from the scanner", None)
        distances = (
            scanner_distance(conn, found, list(comparison.true_shape)),
            scanner_distance(conn, found, list(comparison.found_shape)),
        )
    done = reports.make_report(comparison, true.ids, [str(k) for k in findings.ids], distances, min_area, findings.seen)
    about = {"survey": survey, "truth": str(truth), "kilometres": findings.kilometres, "min_area_m2": min_area}
    tell(**reports.as_values(done, about), outside=outside, file=output)
    if output:
        with replacing(output) as temporary:
            temporary.write_text(reports.as_json(done, about) if form == ".json" else reports.as_csv(done), encoding="utf-8")
    print_table(reports.COUNT_HEADER, reports.count_rows(done), right=range(1, len(reports.COUNT_HEADER)))
    click.echo()
    print_table(reports.AREA_HEADER, reports.area_rows(done), right=range(1, len(reports.AREA_HEADER)))
    if rows := reports.list_rows(done):
        click.echo()
        print_table(reports.LIST_HEADER, rows, right=range(1, len(reports.LIST_HEADER)))
    click.echo(f"\n{reports.false_line(done)}")
    if outside:
        click.echo(f"{outside} true leaks lie where leaks were not sought, and are left out")
