"""What viewers, inspectors and operators may do, and may not: tried as people who log in with just that role."""

from __future__ import annotations

from collections.abc import Iterator

import psycopg
import pytest
from psycopg import sql
from psycopg.conninfo import make_conninfo

from tunneldb.database import install, open_connection

PEOPLE = {
    "vera": "tunnel_viewer",
    "ines": "tunnel_inspector",
    "otto": "tunnel_operator",
    "olga": "tunnel_operator",
    "nobody": None,
}

REVIEW = "UPDATE tunnel_api.leak_unrolled SET review = 'confirmed'"
JUDGE = "UPDATE tunnel_api.anomaly_map SET kind = 'leak' WHERE kind = 'joint'"
MOVE = "UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0, 0, 0.1) WHERE n = 1240"
DRAW = "INSERT INTO tunnel_api.region (survey, kind, geom) VALUES ('demo-2024', 'dry', ST_MakeEnvelope(12400, 0, 12410, 2, 0))"
READ = "SELECT count(*) FROM tunnel_api.leak"
TABLE = "SELECT count(*) FROM tunnel.anomaly"


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


@pytest.fixture(scope="session")
def people(server_dsn: str, example_template: str) -> None:
    """Make the people; roles belong to the whole server."""
    with psycopg.connect(server_dsn, autocommit=True) as connection:
        for name, role in PEOPLE.items():
            connection.execute(sql.SQL("CREATE ROLE {} LOGIN").format(sql.Identifier(name)))
            if role is not None:
                connection.execute(sql.SQL("GRANT {} TO {}").format(sql.Identifier(role), sql.Identifier(name)))


@pytest.fixture
def person(request: pytest.FixtureRequest, people: None, dsn: str) -> Iterator[psycopg.Connection]:
    with psycopg.connect(make_conninfo(dsn, user=request.param), autocommit=True) as connection:
        yield connection


def refused(person: psycopg.Connection, statement: str) -> None:
    # the second: a view through which nobody can do it
    with pytest.raises((psycopg.errors.InsufficientPrivilege, psycopg.errors.ObjectNotInPrerequisiteState)):
        person.execute(statement)  # type: ignore[arg-type]


@pytest.mark.parametrize("person", ["vera", "ines", "otto"], indirect=True)
def test_everyone_reads_every_view(person: psycopg.Connection) -> None:
    names = person.execute("SELECT viewname FROM pg_views WHERE schemaname = 'tunnel_api'").fetchall()
    assert len(names) > 15
    for (name,) in names:
        person.execute(sql.SQL("SELECT * FROM tunnel_api.{}").format(sql.Identifier(name))).fetchall()


@pytest.mark.parametrize("person", ["vera", "ines"], indirect=True)
def test_readers_unroll_and_sum_without_rights_on_tables(person: psycopg.Connection) -> None:
    survey = person.execute("SELECT id FROM tunnel_api.survey").fetchone()[0]
    chainage, arc, offset = person.execute(
        "SELECT u.* FROM tunnel_api.unroll(%(s)s, tunnel_api.roll(%(s)s, 12345.0, 2.0, 0.1)) u", {"s": survey}
    ).fetchone()
    assert (chainage, arc, offset) == pytest.approx((12345, 2, 0.1), abs=1e-3)
    assert person.execute("SELECT tunnel_api.wet_area('demo-2024', 12300, 12500)").fetchone()[0] > 10
    for function in ("leak_statistics", "waterproof_class", "coverage"):
        query = sql.SQL("SELECT * FROM tunnel_api.{}('demo-2024', 12300, 12500)").format(sql.Identifier(function))
        assert person.execute(query).fetchone()[0] is not None
    assert len(person.execute("SELECT * FROM tunnel_api.ring_statistics('demo-2024', 10, 12300)").fetchall()) == 20


@pytest.mark.parametrize("person", ["vera", "ines"], indirect=True)
def test_readers_see_no_table_and_run_no_stage(person: psycopg.Connection) -> None:
    refused(person, TABLE)
    refused(person, "UPDATE tunnel.anomaly SET review = 'confirmed'")
    refused(person, "DELETE FROM tunnel.point")
    refused(person, "DROP TABLE tunnel.anomaly")
    refused(person, "CREATE TABLE tunnel.mine (x int)")
    refused(person, "CREATE VIEW tunnel_api.mine AS SELECT 1")
    refused(person, "SELECT tunnel_api.axis_refine(1, 12)")
    refused(person, "SELECT tunnel_api.segment_build(1, 12)")
    refused(person, "DROP VIEW tunnel_api.leak")


@pytest.mark.parametrize("person", ["vera"], indirect=True)
def test_viewer_changes_nothing(person: psycopg.Connection) -> None:
    for statement in (REVIEW, JUDGE, MOVE, DRAW, "DELETE FROM tunnel_api.region", "DELETE FROM tunnel_api.leak"):
        refused(person, statement)


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_inspector_reviews_moves_and_draws_under_her_own_name(person: psycopg.Connection) -> None:
    for statement in (REVIEW, JUDGE, MOVE, DRAW):
        person.execute(statement)  # type: ignore[arg-type]
    assert person.execute("SELECT DISTINCT reviewed_by FROM tunnel_api.leak WHERE reviewed_by IS NOT NULL").fetchall() == [
        ("ines",)
    ]
    assert person.execute("SELECT reviewed_by FROM tunnel_api.anomaly WHERE kind <> found").fetchall() == [("ines",)]
    assert person.execute("SELECT edited_by FROM tunnel_api.axis_vertex WHERE source = 'edited'").fetchall() == [("ines",)]
    assert person.execute("SELECT count(*) FROM tunnel_api.region WHERE drawn_by = 'ines'").fetchone() == (1,)


@pytest.mark.parametrize("person", ["ines"], indirect=True)
@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE tunnel_api.leak_map SET geom = NULL",
        "UPDATE tunnel_api.leak SET reviewed_by = 'vera'",
        "UPDATE tunnel_api.leak SET area = 0",
        "UPDATE tunnel_api.anomaly SET found = 'leak'",
        "UPDATE tunnel_api.anomaly_3d SET reasons = '{}'",
        "DELETE FROM tunnel_api.leak",
        "UPDATE tunnel_api.axis_vertex SET source = 'measured'",
        "UPDATE tunnel_api.axis_vertex SET edited_by = 'vera'",
        "DELETE FROM tunnel_api.axis_vertex",
        "UPDATE tunnel_api.region SET drawn_by = 'vera'",
        "UPDATE tunnel_api.tunnel SET name = 'mine'",
        "INSERT INTO tunnel_api.run (id) VALUES (1)",
        "INSERT INTO public.layer_styles (stylename) VALUES ('mine')",
    ],
)
def test_inspector_may_change_nothing_else(person: psycopg.Connection, statement: str) -> None:
    refused(person, statement)


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_operator_works_on_the_tables_and_swaps_partitions(person: psycopg.Connection, dsn: str) -> None:
    person.execute(REVIEW)  # type: ignore[arg-type]
    survey = person.execute("SELECT id FROM tunnel.survey").fetchone()[0]
    person.execute(
        sql.SQL("CREATE TABLE tunnel.point_s1 PARTITION OF tunnel.point FOR VALUES IN ({}) PARTITION BY LIST (km)").format(
            survey
        )
    )
    person.execute("CREATE TABLE tunnel.point_s1_km12 PARTITION OF tunnel.point_s1 FOR VALUES IN (12)")
    person.execute("UPDATE tunnel.axis_vertex SET points = 1")
    # another operator replaces what the first one made
    with psycopg.connect(make_conninfo(dsn, user="olga"), autocommit=True) as other:
        other.execute("CREATE TABLE tunnel.point_s1_km12_new (LIKE tunnel.point)")
        other.execute("ALTER TABLE tunnel.point DETACH PARTITION tunnel.point_s1")
        other.execute("DROP TABLE tunnel.point_s1")


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_operator_leaves_the_functions_alone(person: psycopg.Connection) -> None:
    refused(person, "DROP SCHEMA tunnel_api CASCADE")
    refused(person, "CREATE FUNCTION tunnel_api.mine() RETURNS int LANGUAGE sql AS 'SELECT 1'")
    refused(person, "CREATE ROLE another")


@pytest.mark.parametrize("person", ["nobody"], indirect=True)
def test_someone_without_a_role_sees_nothing(person: psycopg.Connection) -> None:
    for statement in (READ, TABLE, "SELECT tunnel_api.chainage_label(1.0)", REVIEW):
        refused(person, statement)


def test_security_definers_fix_their_search_path(conn: psycopg.Connection) -> None:
    assert (
        conn.execute(
            "SELECT oid::regprocedure::text FROM pg_proc WHERE pronamespace = 'tunnel_api'::regnamespace AND prosecdef "
            "AND NOT EXISTS (SELECT FROM unnest(proconfig) c WHERE c LIKE 'search_path=%pg_temp')"
        ).fetchall()
        == []
    )


def test_roles_need_a_superuser_where_the_owner_may_not_make_them(server_dsn: str) -> None:
    """An owner without CREATEROLE can install; what is missing is said as a warning."""
    with psycopg.connect(server_dsn, autocommit=True) as connection:
        connection.execute("CREATE ROLE landlord LOGIN")
        connection.execute("CREATE DATABASE landlords OWNER landlord")
    with psycopg.connect(make_conninfo(server_dsn, dbname="landlords"), autocommit=True) as connection:
        connection.execute("CREATE EXTENSION postgis")
    said: list[str] = []
    with open_connection(make_conninfo(server_dsn, dbname="landlords", user="landlord")) as owner:
        owner.add_notice_handler(lambda notice: said.append(notice.message_primary or ""))
        install(owner)
        assert owner.execute("SELECT count(*) FROM tunnel_api.leak").fetchone() == (0,)
    # here the roles exist already, made for the other databases, so only the membership is lacking
    assert any("GRANT tunnel_operator TO landlord" in message for message in said)
    with psycopg.connect(make_conninfo(server_dsn, dbname="postgres"), autocommit=True) as connection:
        connection.execute("DROP DATABASE landlords WITH (FORCE)")


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_operators_serve_the_queue(person: psycopg.Connection) -> None:
    def one(query: str) -> object:
        row = person.execute(query).fetchone()  # type: ignore[arg-type]
        assert row is not None
        return row[0]

    person.execute("INSERT INTO tunnel.incoming (survey_id, name, path, bytes, points, km_from, km_to)"
                   " SELECT id, 'a.laz', '/a.laz', 1, 1, 12, 12 FROM tunnel.survey")  # fmt: skip
    assert one("SELECT tunnel_api.queue_plan(id) FROM tunnel.survey") == 1
    worker = one("SELECT tunnel_queue.procrastinate_register_worker_v1()")
    one(f"SELECT tunnel_api.queue_register({worker}, 'h', 1)")
    job = one(f"SELECT id FROM tunnel_queue.procrastinate_fetch_job_v2(ARRAY['tunneldb'], {worker})")
    one(f"SELECT tunnel_queue.procrastinate_update_heartbeat_v1({worker})")
    assert one("SELECT tunnel_api.queue_rescue()") == 0
    assert one(f"SELECT tunnel_api.queue_hold({job}, {worker})") is True
    one(f"SELECT tunnel_api.queue_done({job}, clock_timestamp())")
    assert one("SELECT count(*) FROM tunnel.incoming") == 0


@pytest.mark.parametrize("person", ["vera", "ines"], indirect=True)
def test_readers_leave_the_queue_alone(person: psycopg.Connection) -> None:
    refused(person, "SELECT tunnel_api.queue_plan(1)")
    refused(person, "SELECT tunnel_api.queue_rescue()")
    refused(person, "SELECT count(*) FROM tunnel_queue.procrastinate_jobs")
    refused(person, "SELECT tunnel_queue.procrastinate_register_worker_v1()")
