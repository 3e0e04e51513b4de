"""The views over all servers: their form by the columns of the servers, their rows, and what is sent to the servers."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import psycopg
import pytest
from psycopg import sql
from support.federation import Federation, reader

from tunneldb.federation.views import Column, find_gaps, plan_views

SERVER, AREA, WIDTH = Column("server", "text"), Column("area", "double precision"), Column("width", "real")


def test_servers_with_the_same_columns_are_partitions() -> None:
    (view,) = plan_views({"north": {"leak": (SERVER, AREA)}, "south": {"leak": (AREA, SERVER)}})
    assert (view.columns, view.partitions, view.incomplete, view.away) == ((SERVER, AREA), ("north", "south"), {}, ())


def test_a_column_that_one_server_lacks_is_null_there() -> None:
    servers = {"north": {"leak": (SERVER, AREA)}, "south": {"leak": (SERVER, AREA, WIDTH), "ring": (SERVER,)}}
    leak, ring = plan_views(servers)
    assert leak.columns == (SERVER, AREA, WIDTH)
    assert (leak.partitions, leak.incomplete) == (("south",), {"north": {"server", "area"}})
    assert (ring.partitions, ring.lacking) == (("south",), ("north",))
    assert find_gaps(servers) == {"north": ["leak.width", "ring"], "south": []}


def test_a_column_of_another_type_is_null_there() -> None:
    (view,) = plan_views({"north": {"leak": (SERVER, AREA)}, "south": {"leak": (SERVER, Column("area", "text"))}})
    assert (view.columns, view.incomplete) == ((SERVER, AREA), {"south": {"server"}})


def test_a_server_that_is_away_keeps_the_form_of_the_view() -> None:
    servers = {"north": {"leak": (SERVER, AREA)}, "south": {"leak": (SERVER, AREA, WIDTH)}}
    (view,) = plan_views(servers, ["south"])
    assert (view.columns, view.partitions, view.away) == ((SERVER, AREA, WIDTH), (), ("south",))


@pytest.fixture
def viewer(shared_federation: Federation) -> psycopg.Connection:
    with psycopg.connect(reader(shared_federation.hub), autocommit=True) as connection:
        yield connection


def test_each_view_has_the_rows_of_all_servers(shared_federation: Federation, viewer: psycopg.Connection) -> None:
    views = [name for (name,) in viewer.execute("SELECT viewname FROM pg_views WHERE schemaname = 'tunnel_hub' ORDER BY 1")]
    expected: dict[str, Counter[str]] = {name: Counter() for name in views}
    for name, dsn in (("north", shared_federation.north), ("south", shared_federation.south)):
        with psycopg.connect(reader(dsn)) as connection:
            there = connection.execute("SELECT viewname FROM pg_views WHERE schemaname = 'tunnel_api' ORDER BY 1").fetchall()
            assert [view for (view,) in there] == views
            for view in views:
                query = sql.SQL("SELECT {}, v.* FROM tunnel_api.{} v").format(sql.Literal(name), sql.Identifier(view))
                expected[view].update(map(repr, connection.execute(query)))
    for view in views:
        found = Counter(map(repr, viewer.execute(sql.SQL("SELECT * FROM tunnel_hub.{}").format(sql.Identifier(view)))))
        assert found == expected[view], view
    assert sum(bool(rows) for rows in expected.values()) > 70


def test_views_have_the_comments_of_tunnel_api(shared_federation: Federation, viewer: psycopg.Connection) -> None:
    query = (
        "SELECT c.relname, a.attname, d.description FROM pg_description d JOIN pg_class c ON d.objoid = c.oid"
        " LEFT JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum = d.objsubid AND d.objsubid > 0"
        " WHERE d.classoid = 'pg_class'::regclass AND c.relnamespace = '{}'::regnamespace AND c.relkind = 'v'"
        " AND a.attname IS DISTINCT FROM 'server'"
    )
    with psycopg.connect(shared_federation.north) as connection:
        comments = set(connection.execute(query.format("tunnel_api").encode()))
    assert len(comments) > 2000
    assert set(viewer.execute(query.format("tunnel_hub").encode())) == comments


def plan(connection: psycopg.Connection, query: str) -> list[str]:
    """Lines of the plan of a query, from a session that has the settings of the database."""
    return [line for (line,) in connection.execute(b"EXPLAIN (VERBOSE, COSTS OFF) " + query.encode())]


def statements(lines: list[str]) -> list[str]:
    """Statements that the servers get."""
    return [line.partition("Remote SQL: ")[2] for line in lines if "Remote SQL: " in line]


def test_conditions_are_sent_to_the_servers(viewer: psycopg.Connection) -> None:
    lines = plan(viewer, "SELECT id FROM tunnel_hub.leak WHERE survey = 'demo-2024' AND area > 0.2 AND chainage_from < 12400")
    assert len(statements(lines)) == 2
    for text in statements(lines):
        assert "survey = 'demo-2024'" in text
        assert "area > 0.2" in text
        assert "chainage_from < 12400" in text
    assert not [line for line in lines if "Filter:" in line]
    (text,) = statements(
        plan(viewer, "SELECT id FROM tunnel_hub.leak WHERE map && ST_MakeEnvelope(0, 0, 9, 9, 25830) AND server = 'north'")
    )
    assert "&&" in text


def test_only_the_servers_of_a_condition_are_asked(viewer: psycopg.Connection) -> None:
    lines = plan(viewer, "SELECT id FROM tunnel_hub.leak WHERE server = 'north'")
    assert any("tunnel_server_north" in line for line in lines)
    assert not any("tunnel_server_south" in line for line in lines)


def test_joins_and_aggregates_by_server_are_sent(viewer: psycopg.Connection) -> None:
    grouped = statements(plan(viewer, "SELECT server, kind, count(*), sum(area) FROM tunnel_hub.finding GROUP BY server, kind"))
    assert len(grouped) == 2
    assert all("GROUP BY" in text and "sum(area)" in text for text in grouped)
    joined = statements(
        plan(
            viewer,
            "SELECT l.id, s.label_from FROM tunnel_hub.leak l JOIN tunnel_hub.segment s"
            " ON s.server = l.server AND s.survey_id = l.survey_id AND s.n = l.segment"
            " WHERE l.survey = 'demo-2024' AND l.area > 1",
        )
    )
    assert len(joined) == 2
    assert all("INNER JOIN" in text for text in joined)


def test_aggregates_over_all_servers_are_computed_by_the_hub(viewer: psycopg.Connection) -> None:
    assert not any(
        "count(" in text for text in statements(plan(viewer, "SELECT kind, count(*) FROM tunnel_hub.finding GROUP BY kind"))
    )


def test_a_viewer_reads_and_does_nothing_else(shared_federation: Federation, viewer: psycopg.Connection) -> None:
    servers = viewer.execute("SELECT name, state, tunnels, surveys FROM tunnel_hub.server ORDER BY name").fetchall()
    assert servers == [("north", "present", 1, 1), ("south", "present", 1, 1)]
    for statement in (
        "UPDATE tunnel_hub.leak SET review = 'confirmed'",
        "DELETE FROM tunnel_hub.leak",
        "UPDATE tunnel_hub.server SET state = 'away'",
        "SELECT * FROM tunnel_server_north.leak",
        "SELECT * FROM tunnel_hub_internal.leak",
        "CREATE TABLE tunnel_hub.mine ()",
        "DROP VIEW tunnel_hub.leak",
        "CREATE USER MAPPING FOR CURRENT_USER SERVER tunnel_server_north OPTIONS (user 'postgres')",
        "ALTER SERVER tunnel_server_north OPTIONS (SET host 'elsewhere')",
    ):
        with pytest.raises(psycopg.errors.InsufficientPrivilege):
            viewer.execute(statement.encode())
    assert viewer.execute("SELECT DISTINCT umoptions FROM pg_user_mappings").fetchall() == [(None,)]


def test_the_servers_cannot_be_written_by_the_hub_either(shared_federation: Federation) -> None:
    with (
        psycopg.connect(shared_federation.hub, autocommit=True) as owner,
        pytest.raises(psycopg.errors.ObjectNotInPrerequisiteState),
    ):
        owner.execute("UPDATE tunnel_server_north.leak SET review = 'confirmed'")


PAGE = Path(__file__).parents[2] / "docs" / "howto-federate.md"


def test_the_queries_of_the_documentation_run(viewer: psycopg.Connection) -> None:
    queries = re.findall(r"^```psql\n(SELECT.*?)^```$", PAGE.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    assert len(queries) == 2
    for query in queries:
        assert {row[0] for row in viewer.execute(query.encode())} == {"north", "south"}
