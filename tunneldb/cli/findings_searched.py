"""The command ``findings searched``."""

from __future__ import annotations

import click
import shapely

from tunneldb.cli.main import Settings
from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.param_types import WholeRange
from tunneldb.cli.stretch import parse_stretch, stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.database import connect
from tunneldb.errors import UserError
from tunneldb.store.survey import get_survey


@command(
    "searched",
    examples=[
        "tunneldb findings searched ringo-2024",
        "tunneldb findings searched ringo-2024 --from 511+700 --to 511+800 --source 'photos of March'",
        "tunneldb findings searched ringo-2024 --remove 3",
    ],
)
@click.argument("survey")
@stretch_options
@click.option("--source", metavar="TEXT", help="What was searched, such as photos; records the stretch.")
@click.option("--remove", type=WholeRange(1, 2**31 - 1), metavar="ID", help="Remove a record, by its number in the list.")
@click.pass_obj
def searched(
    settings: Settings, survey: str, start: str | None, end: str | None, source: str | None, remove: int | None
) -> None:
    """Record or list the parts of SURVEY that were searched for cracks.

    Without a crack, an element has a crack density of 0 only where somebody searched. findings trace records the area
    of its masks; after findings import, record the stretch by --source with --from and --to: all round, by default the
    whole survey.
    """
    from tunneldb.store.crack_search import add_crack_search, read_crack_searches, remove_crack_search
    from tunneldb.store.imported_images import section_extent

    if source is None and not (start is None and end is None):
        raise UserError("--from and --to need --source TEXT: what was searched, such as 'photos of March'")
    if source is not None and remove is not None:
        raise UserError("--source and --remove exclude each other")
    with connect(settings.dsn) as conn:
        found = get_survey(conn, survey)
        if source is not None:
            extent, stretch = section_extent(conn, found), parse_stretch(conn, found, start, end)
            low, high = max(stretch.low, extent.chainage_from), min(stretch.high, extent.chainage_to)
            if low >= high:
                raise UserError(
                    f"survey {survey} lies beside this stretch: from {extent.chainage_from:.2f} to {extent.chainage_to:.2f} m"
                )
            add_crack_search(conn, found, shapely.box(low, extent.arc_from, high, extent.arc_to), source)
        elif remove is not None:
            if remove not in {row.id for row in read_crack_searches(conn, found)}:
                raise UserError(f"survey {survey} has no search with number {remove}: tunneldb findings searched {survey}")
            remove_crack_search(conn, remove)
        rows = read_crack_searches(conn, found)
    add_to_json(survey=survey, searches=rows)
    if not rows:
        click.echo(f"{survey}: it is not recorded that any part was searched for cracks")
        return
    print_table(
        ["id", "from m", "to m", "arc from m", "arc to m", "source", "by", "at"],
        [
            [
                row.id, f"{row.chainage_from:.2f}", f"{row.chainage_to:.2f}", f"{row.arc_from:.2f}", f"{row.arc_to:.2f}",
                row.source, row.recorded_by, f"{row.recorded_at:%Y-%m-%d %H:%M}",
            ]
            for row in rows
        ],
        right=range(5),
    )  # fmt: skip
