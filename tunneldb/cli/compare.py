"""The command ``compare``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import psycopg

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import output_option, require_ending, say_written, surveys_in, with_progress, write_text
from tunneldb.cli.output import add_to_json, command
from tunneldb.cli.param_types import FiniteRange
from tunneldb.cli.stretch import Stretch, stretch_options
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.files import by_kilometre, replacing
from tunneldb.store.survey import Survey

if TYPE_CHECKING:
    from tunneldb.measures.change.tables import Row

_WORDS = {
    "new": "new", "grown": "grown", "shrunk": "shrunk", "same": "the same", "dry": "dry again", "kind": "of another kind",
    "unseen": "unseen",
}  # fmt: skip


@command(
    examples=[
        "tunneldb compare demo-2024 demo-2026",
        "tunneldb compare demo-2024 demo-2026 --from 12+300 --to 12+400 -o leaks.csv",
        "tunneldb compare demo-2024 demo-2026 -o change.gpkg",
        "tunneldb compare demo-2024 demo-2026 -o change.tif",
    ]
)
@click.argument("old")
@click.argument("new")
@stretch_options
@click.option(
    "--cell", type=FiniteRange(0.05, 1.0), default=0.1, show_default=True, metavar="M", help="Side of the cells, m.",
)  # fmt: skip
@click.option(
    "--length", type=FiniteRange(0.5, 50.0), default=1.5, show_default=True, metavar="M",
    help="Length of the sections whose rigid motion is removed, m.",
)  # fmt: skip
@output_option(
    "File to write: .csv of changes of leaks; .gpkg or .xlsx of leaks, regions and sections; .tif of "
    "the change of each cell, one a kilometre."
)
@click.pass_obj
def compare(
    settings: Settings,
    old: str,
    new: str,
    start: str | None,
    end: str | None,
    cell: float,
    length: float,
    output: Path | None,
) -> None:
    """Compare two surveys of a tunnel: changes of the leaks of OLD, and of the lining.

    Missing or outdated kilometres are computed first. The rigid motion of each section of the lining is removed and
    stated; only control points can separate registration error from movement. The rest is stated with its level of
    detection, and as regions where it is significant. Lining not inspected by one survey is neither changed nor
    unchanged, and its leaks are neither new nor dry. See docs/howto-compare.md.
    """
    from tunneldb.measures.change.measure import compare as bring_up_to_date
    from tunneldb.measures.change.tables import change_rows, summary

    require_ending(output, "compare", (".csv", ".gpkg", ".xlsx", ".tif"))
    with surveys_in(settings, [old, new], start, end) as (conn, [first, second], part):
        made = with_progress(lambda begin: bring_up_to_date(conn, first, second, part.low, part.high, cell, length, begin))
        rows = {
            view: change_rows(conn, view, first, second, part.low, part.high)
            for view in ("change_section", "change_region", "leak_change")
        }
        whole = summary(rows["change_section"], rows["change_region"], rows["leak_change"])
        files = [] if output is None else _write(conn, first, second, part, rows, output)
    add_to_json(
        old=old, new=new, made=made, summary=whole, sections=rows["change_section"], regions=rows["change_region"],
        leaks=rows["leak_change"],
    )  # fmt: skip
    _print(rows, whole)
    say_written(files)


def _write(
    conn: psycopg.Connection[Any], old: Survey, new: Survey, part: Stretch, rows: dict[str, list[Row]], output: Path
) -> list[Path]:
    if output.suffix.lower() == ".csv":
        from tunneldb.measures.change.tables import change_csv

        return write_text(output, change_csv(rows["leak_change"], "leak_change"))
    if output.suffix.lower() == ".tif":
        from tunneldb.export.images.change import write_change
        from tunneldb.measures.change.measure import change_between
        from tunneldb.stages.stale import result_states

        there = result_states(conn, change_between(old, new), part.low, part.high)
        paths = by_kilometre(output, list(there))
        written = (write_change(conn, old, new, km, path) for km, path in zip(there, paths, strict=True))
        return [path for path in written if path is not None]
    from tunneldb.export.exchange.change import write_change_gpkg, write_change_xlsx

    with replacing(output) as temporary:
        if output.suffix.lower() == ".gpkg":
            write_change_gpkg(conn, old, new, part.low, part.high, temporary)
        else:
            write_change_xlsx(rows, temporary)
    return [output]


def _print(rows: dict[str, list[Row]], whole: Row) -> None:
    leaks = [row for row in rows["leak_change"] if row["state"] != "same"]
    print_table(
        ["leak", "at", "clock", "before m²", "±", "after m²", "±", "seen %"],
        [
            (
                _WORDS[row["state"]], row["label"], f"{row['clock']:.1f}",
                f"{row['area_old']:.3f}", f"{row['area_old_se']:.3f}",
                f"{row['area_new']:.3f}", f"{row['area_new_se']:.3f}",
                f"{100.0 * min(row['seen_old'], row['seen_new']):.0f}",
            )
            for row in leaks
        ],
        right=(2, 3, 4, 5, 6, 7),
    )  # fmt: skip
    print_table(
        ["changed", "at", "clock", "area m²", "mean mm", "detected from mm", "greatest mm"],
        [
            (
                "inwards" if row["change_mean"] > 0.0 else "outwards", row["label"], f"{row['clock']:.1f}",
                f"{row['area']:.2f}",
                *(f"{1e3 * row[name]:.1f}" for name in ("change_mean", "lod", "change_extreme")),
            )
            for row in rows["change_region"]
        ],
        right=(2, 3, 4, 5, 6),
    )  # fmt: skip
    told = ", ".join(f"{count} {_WORDS[state]}" for state, count in sorted(whole["leaks"].items())) or "none"
    click.echo(f"leaks: {told}")
    click.echo(
        f"lining: {whole['compared']:.1f} m² compared, {whole['changed']:.2f} m² of it changed in"
        f" {counted(whole['regions'], 'region')};"
        f" {whole['unseen']:.1f} m² could be measured in the older survey only: their change is unknown"
    )
    if whole["shift_greatest"] is not None:
        click.echo(
            f"sections were shifted as a whole by up to {1e3 * whole['shift_greatest']:.1f} mm, which is removed: only"
            " control points can separate registration error from movement"
        )
    if whole["sections_without_motion"]:
        click.echo(
            f"{counted(whole['sections_without_motion'], 'section')} without a computed motion: both surveys measured too"
            " little of the same lining"
        )
