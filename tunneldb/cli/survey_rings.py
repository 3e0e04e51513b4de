"""Rings of a survey for the command ``rings``: define, measure, list. Rings of total-station points are in ``cli/rings.py``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import psycopg

from tunneldb.cli.main import Settings
from tunneldb.cli.measure import number, surveys_in, with_progress
from tunneldb.cli.output import add_to_json, notify
from tunneldb.cli.progress import bar, step
from tunneldb.cli.tables import print_table
from tunneldb.counted import counted
from tunneldb.errors import UserError
from tunneldb.files import exit_on_sigterm, replacing
from tunneldb.store.survey import Survey

if TYPE_CHECKING:
    from rich.progress import Progress

    from tunneldb.measures.rings.tables import Row

_FILES = (".csv", ".gpkg", ".xlsx")


@dataclass(frozen=True)
class Definition:
    """Given positions of rings: their length and a joint (m), a file, or a search for them."""

    length: float | None
    start: float | None
    file: Path | None
    find: bool

    def require_one(self) -> None:
        """Refuse more than one of them."""
        said = [self.length is not None, self.file is not None, self.find]
        if sum(said) > 1:
            raise UserError("rings are given by one of --length, --rings and --find")
        if self.start is not None and self.length is None:
            raise UserError("--start is a joint of rings of one length: give --length, too")


def survey_rings(
    settings: Settings,
    name: str,
    definition: Definition,
    ends: tuple[str | None, str | None],
    diameter: float | None,
    chords: tuple[tuple[float, float], ...],
    output: Path | None,
) -> None:
    """Define the rings of a survey if a definition is given, measure those out of date, and list them."""
    from tunneldb.export.tables.survey_rings import write_rings
    from tunneldb.measures.rings.measure import RingOptions, measure_survey_rings
    from tunneldb.measures.rings.tables import ring_rows

    definition.require_one()
    if output is not None and output.suffix.lower() not in _FILES:
        raise UserError(f"{output}: rings of a survey are written as {', '.join(_FILES[:-1])} or {_FILES[-1]}")
    options = RingOptions(diameter, chords) if diameter is not None or chords else None
    with surveys_in(settings, [name], *ends) as (conn, [survey], part):
        with exit_on_sigterm(), bar("blocks") as progress:
            _define(conn, survey, definition, progress)
        made = with_progress(lambda begin: measure_survey_rings(conn, survey, part.low, part.high, options, begin))
        rows = ring_rows(conn, survey, part.low, part.high)
        if not rows:
            raise UserError(f"survey {name} has no rings there: say where they lie, by --length, --rings or --find")
        add_to_json(survey=name, made=made, rings=len(rows), file=output)
        if output is None:
            add_to_json(rows=rows)
        else:
            with replacing(output) as temporary:
                if output.suffix.lower() == ".gpkg":
                    from tunneldb.export.exchange.rings_gpkg import write_rings_gpkg

                    write_rings_gpkg(conn, survey, rows, temporary)
                else:
                    write_rings(rows, temporary, output.suffix.lower(), f"Rings of {name}")
    _print(rows, output)


def _define(conn: psycopg.Connection[Any], survey: Survey, definition: Definition, progress: Progress) -> None:
    from tunneldb.measures.rings.measure import define_rings, find_rings, rings_by_length, rings_of_file

    if definition.find:
        rings, joints = find_rings(conn, survey, step(progress))
        conn.rollback()
        define_rings(conn, survey, rings, "found")
        missing = int((~joints.seen).sum())
        add_to_json(pitch=joints.pitch, pitch_se=joints.pitch_se, joints=len(joints.seen), joints_missing=missing)
        notify(
            f"rings of {joints.pitch:.4f} m (± {1e3 * joints.pitch_se:.1f} mm);"
            f" {counted(len(joints.seen), 'joint')}, {missing} of them not seen"
        )
    elif definition.length is not None:
        rings = rings_by_length(conn, survey, definition.length, definition.start)
        conn.rollback()
        define_rings(conn, survey, rings, "length")
    elif definition.file is not None:
        rings = rings_of_file(conn, survey, definition.file)
        conn.rollback()
        define_rings(conn, survey, rings, "file")


_SHOWN = 20


def _print(rows: list[Row], output: Path | None) -> None:
    from tunneldb.measures.rings.tables import CIRCLE_COLUMNS

    told = sorted((row for row in rows if row["ovality"] is not None), key=lambda row: -row["ovality"])
    shown = told[:_SHOWN] if len(rows) > _SHOWN else rows
    table = [
        (
            row["number"], row["label"], number(row["seen_share"], 0, 100.0), number(row["centre_right"], 1, 1e3),
            number(row["centre_up"], 1, 1e3), number(row["radius"], 4), number(row["ovality"], 2, 1e3),
            number(row["ovality_se"], 2, 1e3), number(row["step_greatest"], 1, 1e3), number(row["lip"], 1, 1e3),
            row["remark"] or "", *(number(row[name], 3 + (name == "circle_radius")) for name in CIRCLE_COLUMNS),
        )
        for row in shown
    ]  # fmt: skip
    header = ["ring", "middle", "seen %", "right mm", "up mm", "radius m", "ovality ‰", "±", "step mm", "lip mm", "remark"]
    header += ["circle x", "circle y", "circle z", "circle radius m"]
    print_table(header, table, right=(*range(2, 10), *range(11, 15)))
    steps = [abs(row["step_greatest"]) for row in rows if row["step_greatest"] is not None]
    said = f"{counted(len(rows), 'ring')}, {len(told)} with an ellipse"
    if len(rows) > len(shown):
        said += f"; shown: the {len(shown)} with the largest ovality"
    if steps:
        said += f"; greatest step {1e3 * max(steps):.1f} mm"
    unseen = sum(not row["seen_share"] for row in rows)
    if unseen:
        said += f"; {unseen} without inspected lining"
    click.echo(said)
    if told:
        sources = {
            "option": "--diameter",
            "profile": "the diameter of the design profile",
            "ring": "the mean diameter of each ring",
        }
        kinds = sorted({sources[row["diameter_from"]] for row in told})
        click.echo(f"ovality is relative to {' and '.join(kinds)}")
    if output is not None:
        notify(f"written to {output}")
