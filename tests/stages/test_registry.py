"""Code, command, tables and functions that each row of the registry names exist."""

from __future__ import annotations

from importlib import import_module, resources

import click
import psycopg
import pytest

from tunneldb.cli.main import COMMANDS
from tunneldb.stages.registry import MEASURES, REGISTRY, STAGES
from tunneldb.stages.stage import Holds, Stage

by_name = pytest.mark.parametrize("measure", MEASURES, ids=[measure.name for measure in MEASURES])


def test_names_are_given_once_and_a_stage_reads_those_before_it() -> None:
    names = [stage.name for stage in REGISTRY]
    assert len(set(names)) == len(names)
    for n, measure in enumerate(MEASURES, len(STAGES)):
        assert set(measure.reads) <= set(names[:n])


@by_name
def test_a_measure_has_a_folder_and_a_command(measure: Stage) -> None:
    folder = resources.files("tunneldb.measures") / {"compare": "change"}.get(measure.name, measure.name)
    for name in ("measure.py", "rows.py", "tables.py"):
        assert (folder / name).is_file()
    assert (folder / "compute.py").is_file() or (folder / "compute").is_dir()
    assert COMMANDS[measure.name] == (measure.command, measure.summary)
    module, _, name = measure.command.partition(":")
    assert isinstance(getattr(import_module(module), name), click.Command)


@by_name
def test_the_older_survey_is_the_first_of_a_subject(measure: Stage) -> None:
    surveys = [one.key for one in measure.inputs if one.holds == Holds.SURVEY]
    assert surveys in ([], list(measure.subject[:1]))
    assert all(bool(one.reason) == (one.holds != Holds.SURVEY) for one in measure.inputs)


@by_name
def test_a_measure_has_its_tables_and_functions(measure: Stage, conn: psycopg.Connection) -> None:
    query = (
        "SELECT count(*) FROM information_schema.columns"
        " WHERE table_schema = 'tunnel' AND table_name = %s AND column_name IN ('survey_id', 'km')"
    )
    assert measure.tables
    for table in measure.tables:
        assert conn.execute(query, [table]).fetchone() == (2,), table
    places = conn.execute("SELECT * FROM tunnel_internal.result_state(1, %s)", [measure.name])
    assert [column.name for column in places.description or ()][-2:] == ["blocked_by", "reason"]
    assert places.fetchall() == []
    subject = " ".join("1" if key in ("before", "old") else "lining" for key in measure.subject)
    conn.execute("SELECT tunnel_internal.result_inputs(1, %s, 0, %s)", [measure.name, subject])


def test_all_tables_of_results_are_of_a_stage(conn: psycopg.Connection) -> None:
    """Rows with a survey and a kilometre are results, but for those of work, points and sonar scans."""
    others = {"goal", "run", "point", "waterproof", "bed", "sonar_point", "water_level"}
    rows = conn.execute(
        "SELECT c.table_name FROM information_schema.columns c"
        " JOIN information_schema.tables t USING (table_schema, table_name)"
        " WHERE c.table_schema = 'tunnel' AND c.column_name IN ('survey_id', 'km') AND t.table_type = 'BASE TABLE'"
        " AND c.table_name !~ '_s[0-9]+' GROUP BY 1 HAVING count(*) = 2"
    ).fetchall()
    assert {name for (name,) in rows} - others == {table for stage in REGISTRY for table in stage.tables}
