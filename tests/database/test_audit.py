"""The audit: what people change through the views is noted with before and after, and nobody takes it back."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import psycopg
import pytest
from click.testing import CliRunner
from psycopg.conninfo import make_conninfo

from tunneldb.cli.main import main

SURVEY = "demo-2024"
ENTRIES = "SELECT who, survey, view, row_id, action, before, after FROM tunnel_api.audit WHERE id > 1 ORDER BY id"
"""All but the first, which the example survey brings."""


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def entries(connection: psycopg.Connection) -> list[tuple[Any, ...]]:
    connection.commit()
    return connection.execute(ENTRIES).fetchall()


def first_leak(connection: psycopg.Connection) -> int:
    row = connection.execute("SELECT id FROM tunnel_api.leak WHERE review = 'open' ORDER BY chainage_from").fetchone()
    assert row is not None
    return int(row[0])


def first_of(connection: psycopg.Connection, view: str) -> tuple[int, bytes]:
    """Key of a row of a view, and the query that shows the row."""
    if view in ("leak", "finding"):
        key = first_leak(connection)
    else:
        key = connection.execute(f"SELECT min(id) FROM tunnel_api.{view}".encode()).fetchone()[0]
    connection.rollback()
    return key, f"SELECT * FROM tunnel_api.{view} WHERE id = {key}".encode()


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_a_review_is_noted_with_only_what_changed(person: psycopg.Connection) -> None:
    key = first_leak(person)
    person.execute("UPDATE tunnel_api.leak_map SET review = 'confirmed' WHERE id = %s", (key,))
    person.execute("UPDATE tunnel_api.leak SET remark = 'drips', review = 'confirmed' WHERE id = %s", (key,))
    person.execute("UPDATE tunnel_api.finding_3d SET kind = 'joint' WHERE id = %s", (key,))
    assert entries(person) == [
        ("ines", SURVEY, "finding", key, "update", {"review": "open"}, {"review": "confirmed"}),
        ("ines", SURVEY, "finding", key, "update", {"remark": None}, {"remark": "drips"}),
        ("ines", SURVEY, "finding", key, "update", {"kind": "leak"}, {"kind": "joint"}),
    ]
    assert person.execute(
        "SELECT max(d.at) = a.reviewed_at OR max(d.at) - a.reviewed_at < interval '1 s'"
        "  FROM tunnel_api.finding a JOIN tunnel_api.audit d ON d.view = 'finding' AND d.row_id = a.id"
        " WHERE a.id = %s GROUP BY a.reviewed_at", (key,)
    ).fetchone() == (True,)  # fmt: skip


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_of_many_rows_those_that_changed_are_noted(person: psycopg.Connection) -> None:
    person.execute("UPDATE tunnel_api.leak SET review = 'confirmed'")  # two of the seven are already
    was = [before["review"] for *_, before, _ in entries(person)]
    assert sorted(was) == ["open"] * 4 + ["rejected"]
    person.execute("UPDATE tunnel_api.leak SET review = 'confirmed'")
    assert len(entries(person)) == 5


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_what_was_undone_or_refused_is_not_noted(person: psycopg.Connection) -> None:
    with person.transaction(force_rollback=True):
        person.execute("UPDATE tunnel_api.leak SET review = 'rejected'")
    with pytest.raises(psycopg.errors.CheckViolation):
        person.execute("UPDATE tunnel_api.leak SET review = 'perhaps'")
    assert entries(person) == []


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_a_moved_vertex_can_be_put_back_exactly_by_the_audit(person: psycopg.Connection) -> None:
    position = "SELECT ST_AsBinary(geom), ST_SRID(geom) FROM tunnel_api.axis_vertex WHERE n = 1240"
    first = person.execute(position).fetchone()
    person.execute("UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0.1, 1.0 / 3, -0.2) WHERE n = 1240")
    second = person.execute(position).fetchone()
    ((*_, view, _, action, before, after),) = entries(person)
    assert (view, action, before["source"], after["source"]) == ("axis_vertex", "update", "measured", "edited")
    parsed = "SELECT ST_AsBinary(g), ST_SRID(g) FROM ST_GeomFromEWKT(%s) g"
    assert person.execute(parsed, (before["geom"],)).fetchone() == first
    assert person.execute(parsed, (after["geom"],)).fetchone() == second
    assert first != second
    person.execute(
        "UPDATE tunnel_api.axis_vertex v SET geom = ST_GeomFromEWKT(d.before ->> 'geom')"
        "  FROM tunnel_api.audit d WHERE d.view = 'axis_vertex' AND d.row_id = v.id"
    )
    assert person.execute(position).fetchone() == first
    assert [(sorted(before), sorted(after)) for *_, before, after in entries(person)] == [
        (["geom", "source"], ["geom", "source"]), (["geom"], ["geom"]),
    ]  # fmt: skip


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_a_region_from_its_drawing_to_its_end(person: psycopg.Connection) -> None:
    row = person.execute(
        "INSERT INTO tunnel_api.region (survey, kind, geom) VALUES (%s, 'dry', 'POLYGON((0 0,2 0,2 1,0 0))') RETURNING id",
        [SURVEY],
    ).fetchone()
    assert row is not None
    key = row[0]
    person.execute("UPDATE tunnel_api.region SET kind = 'homogeneous' WHERE id = %s", (key,))
    person.execute("UPDATE tunnel_api.region SET kind = 'homogeneous' WHERE id = %s", (key,))
    person.execute("DELETE FROM tunnel_api.region WHERE id = %s", (key,))
    shape = "POLYGON((0 0,2 0,2 1,0 0))"
    assert entries(person) == [
        ("ines", SURVEY, "region", key, "insert", None, {"kind": "dry", "geom": shape}),
        ("ines", SURVEY, "region", key, "update", {"kind": "dry"}, {"kind": "homogeneous"}),
        ("ines", SURVEY, "region", key, "delete", {"kind": "homogeneous", "geom": shape}, None),
    ]


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_another_role_does_not_hide_the_person(person: psycopg.Connection) -> None:
    person.execute("SET ROLE tunnel_inspector")
    person.execute("UPDATE tunnel_api.leak SET review = 'rejected' WHERE id = %s", (first_leak(person),))
    assert [who for who, *_ in entries(person)] == ["ines"]


@contextmanager
def meanwhile(
    dsn: str, conn: psycopg.Connection, first: psycopg.Connection, statement: str, *values: object
) -> Iterator[Future[psycopg.Cursor]]:
    """Olga's statement begins while what the first one does in the with block has not been committed; ends when it is."""
    with psycopg.connect(make_conninfo(dsn, user="olga"), autocommit=True) as olga, ThreadPoolExecutor(1) as pool:
        olga.execute("SET statement_timeout = '30 s'")
        with first.transaction():
            future: Future[psycopg.Cursor] = Future()
            yield future
            done = pool.submit(olga.execute, statement, values)  # type: ignore[arg-type]
            until = time.monotonic() + 20
            waits = "SELECT 1 FROM pg_stat_activity WHERE pid = %s AND wait_event_type = 'Lock'"
            while not conn.execute(waits, (olga.info.backend_pid,)).fetchone():
                conn.rollback()
                assert not done.done(), done.result()
                assert time.monotonic() < until, "her statement never waited"
                time.sleep(0.01)
            conn.rollback()
        error = done.exception(30)
        if error is not None:
            future.set_exception(error)
        else:
            future.set_result(done.result())


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_two_at_the_same_leak_both_keep_what_they_did(person: psycopg.Connection, dsn: str, conn: psycopg.Connection) -> None:
    """Olga's statement must not take the review back to what she saw."""
    key = first_leak(conn)
    conn.rollback()
    with meanwhile(dsn, conn, person, "UPDATE tunnel_api.leak SET remark = 'crack' WHERE id = %s", key) as olgas:
        person.execute("UPDATE tunnel_api.leak SET review = 'confirmed' WHERE id = %s", (key,))
    assert olgas.result().rowcount == 1
    assert conn.execute("SELECT review, remark FROM tunnel_api.leak WHERE id = %s", (key,)).fetchone() == ("confirmed", "crack")
    assert [(who, before, after) for who, *_, before, after in entries(conn)] == [
        ("ines", {"review": "open"}, {"review": "confirmed"}),
        ("olga", {"remark": None}, {"remark": "crack"}),
    ]


REGION = "'POLYGON((12410 -3,12420 -3,12420 %d,12410 -3))'"


@pytest.mark.parametrize("person", ["ines"], indirect=True)
@pytest.mark.parametrize(
    ("view", "ines", "olga"),
    [
        ("leak", "review = 'confirmed'", "review = 'rejected'"),
        ("leak", "kind = 'joint'", "kind = 'dark'"),
        ("leak", "remark = 'drips'", "remark = 'dry'"),
        ("axis_vertex", "geom = ST_Translate(geom, 0, 0, 0.1)", "geom = ST_Translate(geom, 0, 0, 0.2)"),
        ("region", f"geom = {REGION % 1}", f"geom = {REGION % 2}"),
    ],
)
def test_two_who_judge_otherwise_are_not_both_right(
    person: psycopg.Connection, dsn: str, conn: psycopg.Connection, view: str, ines: str, olga: str
) -> None:
    """The later statement saw what was before, so that its WHERE proves nothing: it is refused, and nothing overwritten."""
    key, look = first_of(conn, view)
    with meanwhile(dsn, conn, person, f"UPDATE tunnel_api.{view} SET {olga} WHERE id = %s", key) as olgas:
        person.execute(f"UPDATE tunnel_api.{view} SET {ines} WHERE id = {key}".encode())
        made = person.execute(look).fetchone()
    with pytest.raises(psycopg.errors.SerializationFailure, match="meanwhile") as refused:
        olgas.result()
    assert refused.value.diag.message_hint == "Reload the row, then edit it again."
    assert conn.execute(look).fetchone() == made
    assert [who for who, *_ in entries(conn)] == ["ines"]
    again = conn.execute(f"UPDATE tunnel_api.{view} SET {olga} WHERE id = {key}".encode())
    assert again.rowcount == (made is not None), "what is no leak any more is not in the view"


@pytest.mark.parametrize("person", ["ines"], indirect=True)
@pytest.mark.parametrize(
    ("view", "change"),
    [("finding", "review = 'confirmed', kind = 'joint'"), ("axis_vertex", "geom = ST_Translate(geom, 0, 0, 0.1)"),
     ("region", f"kind = 'homogeneous', geom = {REGION % 1}")],
)  # fmt: skip
def test_two_of_one_mind_are_the_work_of_the_first(
    person: psycopg.Connection, dsn: str, conn: psycopg.Connection, view: str, change: str
) -> None:
    key, look = first_of(conn, view)
    with meanwhile(dsn, conn, person, f"UPDATE tunnel_api.{view} SET {change} WHERE id = %s", key) as olgas:
        person.execute(f"UPDATE tunnel_api.{view} SET {change} WHERE id = {key}".encode())
        made = person.execute(look).fetchone()
    assert olgas.result().rowcount == 1
    assert conn.execute(look).fetchone() == made
    assert "ines" in made
    assert [who for who, *_ in entries(conn)] == ["ines"]


def test_the_audit_outlives_the_survey(conn: psycopg.Connection) -> None:
    conn.execute("UPDATE tunnel_api.leak SET review = 'rejected' WHERE id = %s", (first_leak(conn),))
    conn.commit()
    assert CliRunner().invoke(main, ["survey", "remove", SURVEY, "--yes"]).exit_code == 0
    assert [(survey, after) for _, survey, *_, after in entries(conn)] == [(SURVEY, {"review": "rejected"})]


@pytest.mark.parametrize("person", ["vera", "ines", "otto"], indirect=True)
def test_no_role_touches_the_audit(person: psycopg.Connection) -> None:
    for statement in (
        "UPDATE tunnel_api.audit SET who = 'nobody'",
        "DELETE FROM tunnel_api.audit",
        "INSERT INTO tunnel_api.audit (who, survey, view, row_id, action) VALUES ('vera', 'demo-2024', 'finding', 1, 'update')",
        "SELECT tunnel_internal.note_edit('demo-2024', 'finding', 1, '{}', '{\"review\": \"confirmed\"}')",
        "SELECT count(*) FROM tunnel_audit.entry",
        "UPDATE tunnel_audit.entry SET who = 'nobody'",
        "DELETE FROM tunnel_audit.entry",
        "TRUNCATE tunnel_audit.entry",
        "DROP TABLE tunnel_audit.entry",
        "DROP SCHEMA tunnel_audit CASCADE",
        "ALTER TABLE tunnel_audit.entry DISABLE TRIGGER ALL",
        "ALTER TABLE tunnel_audit.entry OWNER TO tunnel_operator",
        "DROP TRIGGER edit ON tunnel_api.leak",
        "CREATE OR REPLACE VIEW tunnel_api.audit AS SELECT 1 AS id",
        "ALTER FUNCTION tunnel_internal.review_finding() RENAME TO unwatched",
        "SET SESSION AUTHORIZATION postgres",
    ):
        with pytest.raises(psycopg.errors.InsufficientPrivilege):
            person.execute(statement)  # type: ignore[arg-type]
    assert person.execute("SELECT view, action FROM tunnel_api.audit").fetchall() == [("region", "insert")]


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_an_operator_who_drops_all_data_leaves_the_audit(person: psycopg.Connection, conn: psycopg.Connection) -> None:
    person.execute("UPDATE tunnel_api.leak SET review = 'rejected'")
    before = conn.execute("SELECT * FROM tunnel_audit.entry ORDER BY id").fetchall()
    conn.commit()
    person.execute("DROP SCHEMA tunnel CASCADE")
    assert conn.execute("SELECT * FROM tunnel_audit.entry ORDER BY id").fetchall() == before
    assert len(before) == 7


@pytest.mark.parametrize(
    "statement",
    ["UPDATE tunnel_audit.entry SET who = 'x'", "DELETE FROM tunnel_api.audit", "TRUNCATE tunnel_audit.entry"],
)
def test_even_the_owner_does_not_change_it_by_mistake(conn: psycopg.Connection, statement: str) -> None:
    with pytest.raises(psycopg.errors.InsufficientPrivilege, match="neither changed nor deleted"):
        conn.execute(statement)  # type: ignore[arg-type]


FORGE = """
CREATE FUNCTION tunnel.forge() RETURNS void LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO tunnel_audit.entry (who, survey, view, row_id, action) VALUES ('nobody', 'demo-2024', 'finding', 1, 'update');
EXCEPTION WHEN insufficient_privilege THEN
END $$;
CREATE FUNCTION tunnel.mine(text) RETURNS boolean LANGUAGE plpgsql IMMUTABLE AS $$
BEGIN
    PERFORM tunnel.forge();
    RETURN true;
END $$
"""
"""What forges an entry as soon as it may, in the guise of a harmless function."""


@pytest.mark.parametrize("person", ["otto"], indirect=True)
@pytest.mark.parametrize(
    ("way", "what"),
    [
        ("ALTER TABLE tunnel.finding ADD CONSTRAINT mine CHECK (tunnel.mine(review))", "check mine of tunnel.finding"),
        ("ALTER TABLE tunnel.finding ADD CONSTRAINT mine CHECK (query_to_xml($x$SELECT tunnel.mine('')$x$, true, false, '')"
         " IS NOT NULL)", "check mine of tunnel.finding"),
        ("CREATE DOMAIN tunnel.word AS text CHECK (tunnel.mine(VALUE));"
         "ALTER TABLE tunnel.region ADD mine tunnel.word DEFAULT ''",
         "type of column mine of tunnel.region"),
        ("CREATE OPERATOR tunnel.!! (FUNCTION = tunnel.mine, RIGHTARG = text);"
         "ALTER TABLE tunnel.finding ADD CONSTRAINT mine CHECK (OPERATOR(tunnel.!!) review)", "check mine of tunnel.finding"),
        ("ALTER TABLE tunnel.finding ADD mine boolean GENERATED ALWAYS AS (tunnel.mine(review)) STORED",
         "default of column mine of tunnel.finding"),
        ("ALTER TABLE tunnel.region ADD mine boolean DEFAULT tunnel.mine('')", "default of column mine of tunnel.region"),
        ("CREATE INDEX mine ON tunnel.finding (tunnel.mine(review))", "index tunnel.mine of tunnel.finding"),
        ("CREATE INDEX mine ON tunnel.finding (id) WHERE tunnel.mine(review)", "index tunnel.mine of tunnel.finding"),
        ("CREATE RULE mine AS ON UPDATE TO tunnel.finding DO ALSO UPDATE tunnel.survey SET name = name WHERE tunnel.mine(name)",
         "rule mine on tunnel.finding"),
    ],
    ids=["check", "built-in", "domain", "operator", "generated", "default", "index", "predicate", "rule"],
)  # fmt: skip
def test_what_operators_put_on_the_tables_gets_at_the_audit_and_is_reported(
    person: psycopg.Connection, conn: psycopg.Connection, dsn: str, way: str, what: str
) -> None:
    """It runs with the owner's rights when somebody edits through the views."""
    forged = "SELECT count(*) > 0 FROM tunnel_audit.entry WHERE who = 'nobody'"
    person.execute(FORGE)
    person.execute(way.encode())
    assert conn.execute(forged).fetchone() == (False,)
    conn.commit()
    with psycopg.connect(make_conninfo(dsn, user="ines"), autocommit=True) as ines:
        ines.execute("UPDATE tunnel_api.leak SET review = 'confirmed' WHERE id = %s", (first_leak(conn),))
        ines.execute(
            "INSERT INTO tunnel_api.region (survey, kind, geom) VALUES (%s, 'dry', 'POLYGON((0 0,2 0,2 1,0 0))')", [SURVEY]
        )
    assert conn.execute(forged).fetchone() == (True,)
    conn.commit()
    result = CliRunner().invoke(main, ["check"])
    assert result.exit_code == 1
    assert f"{what} is not tunneldb's: it runs" in result.output
    for mend in [line.strip() for line in result.output.splitlines() if line.strip().startswith(("ALTER ", "DROP "))]:
        person.execute(mend.encode())
    assert "✓ expressions" in CliRunner().invoke(main, ["check"]).output


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_a_condition_on_a_trigger_of_tunneldb_is_reported(person: psycopg.Connection) -> None:
    """Name and function of the trigger are tunneldb's, and the condition runs with the rights of whoever writes."""
    person.execute(FORGE)
    person.execute(
        "CREATE OR REPLACE TRIGGER set_subject BEFORE INSERT OR UPDATE ON tunnel.run FOR EACH ROW"
        " WHEN (tunnel.mine(NEW.stage)) EXECUTE FUNCTION tunnel.set_subject()"
    )
    result = CliRunner().invoke(main, ["check"])
    assert result.exit_code == 1
    assert "condition of trigger set_subject of tunnel.run is not tunneldb's: it runs tunnel.mine(text)" in result.output


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_a_function_in_statistics_is_reported(person: psycopg.Connection) -> None:
    """It runs whenever somebody analyses the table."""
    person.execute(FORGE)
    person.execute("CREATE STATISTICS tunnel.usual ON kind, review FROM tunnel.finding")
    person.execute("CREATE STATISTICS tunnel.mine ON (tunnel.mine(review)) FROM tunnel.finding")
    result = CliRunner().invoke(main, ["check"])
    assert result.exit_code == 1
    assert "statistics tunnel.mine of tunnel.finding is not tunneldb's: it runs tunnel.mine(text)" in result.output
    assert "tunnel.usual" not in result.output
    (mend,) = [line.strip() for line in result.output.splitlines() if "DROP STATISTICS" in line]
    person.execute(mend.encode())
    assert "✓ expressions" in CliRunner().invoke(main, ["check"]).output


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_a_name_cannot_forge_a_line_of_check(person: psycopg.Connection) -> None:
    person.execute(FORGE)
    person.execute('ALTER TABLE tunnel.region ADD CONSTRAINT "x\n✓ forged" CHECK (tunnel.mine(kind))')
    result = CliRunner().invoke(main, ["check"])
    assert result.exit_code == 1
    assert r'check "x\n✓ forged" of tunnel.region' in result.output
    assert not any(line.startswith("✓ forged") for line in result.output.splitlines())


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_a_table_is_not_made_part_of_another_unseen(person: psycopg.Connection, conn: psycopg.Connection) -> None:
    """A partition takes the triggers, checks and indexes of its parent, which may lie anywhere."""
    conn.execute("CREATE SCHEMA elsewhere; GRANT ALL ON SCHEMA elsewhere TO tunnel_operator")
    conn.commit()
    person.execute(FORGE)
    person.execute("""
        CREATE FUNCTION elsewhere.fire() RETURNS trigger LANGUAGE plpgsql AS 'BEGIN RETURN NEW; END';
        ALTER TABLE tunnel.region ADD CONSTRAINT mine CHECK (tunnel.mine(kind));
        CREATE TABLE elsewhere.parent (LIKE tunnel.region, CONSTRAINT mine CHECK (tunnel.mine(kind)))
            PARTITION BY LIST (survey_id);
        CREATE INDEX mine ON elsewhere.parent (tunnel.mine(kind));
        CREATE TRIGGER mine BEFORE INSERT ON elsewhere.parent FOR EACH ROW EXECUTE FUNCTION elsewhere.fire();
        ALTER TABLE elsewhere.parent ATTACH PARTITION tunnel.region DEFAULT;
    """)
    output = CliRunner().invoke(main, ["check"]).output
    for what in ("mine on elsewhere.parent", "check mine of elsewhere.parent", "index elsewhere.mine of elsewhere.parent"):
        assert f"{what} is not tunneldb's: it runs" in output


def test_own_triggers_that_do_not_fire_are_reported(conn: psycopg.Connection) -> None:
    conn.execute("ALTER TABLE tunnel.finding DISABLE TRIGGER note_update; DROP TRIGGER drop_points ON tunnel.survey")
    conn.commit()
    output = CliRunner().invoke(main, ["check"]).output
    assert "note_update on tunnel.finding is switched off" in output
    assert "ALTER TABLE tunnel.finding ENABLE TRIGGER note_update; then tunneldb init" in output
    assert "drop_points on tunnel.survey is missing" in output


def test_without_functions_check_looks_no_further(conn: psycopg.Connection) -> None:
    conn.execute("DROP SCHEMA tunnel_api CASCADE")
    conn.commit()
    result = CliRunner().invoke(main, ["check"])
    assert result.exit_code == 1
    assert "schema tunnel_api: missing" in result.output
    assert "tunneldb init" in result.output


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_a_table_that_goes_with_the_rows_of_another_is_reported(
    person: psycopg.Connection, conn: psycopg.Connection, dsn: str
) -> None:
    """Its triggers run with the rights of whoever deletes there: the owner's, when he removes a survey."""
    conn.execute("CREATE SCHEMA elsewhere; GRANT ALL ON SCHEMA elsewhere TO tunnel_operator")
    conn.commit()
    person.execute("""
        CREATE TABLE elsewhere.sprung (who text);
        GRANT INSERT ON elsewhere.sprung TO PUBLIC;
        CREATE FUNCTION elsewhere.fire() RETURNS trigger LANGUAGE plpgsql AS
            'BEGIN INSERT INTO elsewhere.sprung VALUES (current_user); RETURN NULL; END';
        CREATE TABLE elsewhere.along (id int REFERENCES tunnel.survey (id) ON DELETE CASCADE);
        CREATE TABLE elsewhere.still (id int REFERENCES tunnel.survey (id));
        CREATE CONSTRAINT TRIGGER late AFTER DELETE ON elsewhere.along DEFERRABLE INITIALLY DEFERRED
            FOR EACH ROW EXECUTE FUNCTION elsewhere.fire();
        INSERT INTO elsewhere.along SELECT id FROM tunnel.survey;
    """)
    result = CliRunner().invoke(main, ["check"])
    assert result.exit_code == 1
    assert "foreign key along_id_fkey of elsewhere.along is not tunneldb's: it runs triggers there" in result.output
    assert "elsewhere.still" not in result.output
    (mend,) = [line.strip() for line in result.output.splitlines() if "DROP CONSTRAINT" in line]
    conn.execute("DELETE FROM tunnel.survey")
    conn.execute("SET CONSTRAINTS ALL IMMEDIATE")
    assert conn.execute("SELECT who <> 'otto' FROM elsewhere.sprung").fetchall() == [(True,)]
    conn.rollback()
    person.execute(mend.encode())
    assert "✓ triggers" in CliRunner().invoke(main, ["check"]).output
