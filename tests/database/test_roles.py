"""What viewers, inspectors and operators may do, and may not: tried as people who log in with just that role."""

from __future__ import annotations

import psycopg
import pytest
from psycopg import sql
from psycopg.conninfo import make_conninfo

from tunneldb.database import install, open_connection
from tunneldb.stages.registry import REGISTRY

REVIEW = "UPDATE tunnel_api.leak_unrolled SET review = 'confirmed'"
JUDGE = "UPDATE tunnel_api.finding_map SET kind = 'leak' WHERE kind = 'joint'"
MOVE = "UPDATE tunnel_api.axis_vertex SET geom = ST_Translate(geom, 0, 0, 0.1) WHERE n = 1240"
DRAW = "INSERT INTO tunnel_api.region (survey, kind, geom) VALUES ('demo-2024', 'dry', ST_MakeEnvelope(12400, 0, 12410, 2, 0))"
KEEP = {"review", "remark", "kind"}
EDITABLE = {
    "axis_vertex": {"geom"},
    "region": {"kind", "geom", "reason", "INSERT", "DELETE"},
    **{
        "finding" + part: {"kind", "severity", "width_mm", "review", "remark", "geom", "INSERT", "DELETE"}
        for part in ("_unrolled", "_map", "_3d")
    },
    "finding_photo": {"path", "caption", "INSERT", "DELETE"},
    **dict.fromkeys(("finding", "leak", "leak_3d"), KEEP),
    **dict.fromkeys(("leak_unrolled", "leak_map"), KEEP | {"geom", "INSERT", "DELETE"}),
    **{
        "action" + part: {
            "finding_id",
            "element",
            "chainage_from",
            "chainage_to",
            "arc",
            "measure",
            "urgency",
            "responsible",
            "due",
            "cost",
            "currency",
            "state",
            "remark",
            "INSERT",
            "DELETE",
        }
        for part in ("", "_map", "_unrolled")
    },
    **{"spot" + part: {"review", "remark"} for part in ("", "_face", "_map", "_3d", "_sheet")},
}
"""What inspectors and operators may change of the views, and nobody else of any: columns, new rows, rows deleted."""

CATALOGUE = {
    "finding_kind": {"code", "label", "geometries", "wet", "position", "active", "INSERT", "DELETE"},
    "severity": {"label", "text"},
}
"""What operators alone may."""

READ = "SELECT count(*) FROM tunnel_api.leak"
TABLE = "SELECT count(*) FROM tunnel.finding"


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


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
    refused(person, "UPDATE tunnel.finding SET review = 'confirmed'")
    refused(person, "DELETE FROM tunnel.point")
    refused(person, "DROP TABLE tunnel.finding")
    refused(person, "CREATE TABLE tunnel.mine (x int)")
    refused(person, "CREATE VIEW tunnel_api.mine AS SELECT 1")
    refused(person, "SELECT tunnel_internal.axis_refine(1, 12)")
    refused(person, "SELECT tunnel_internal.segment_build(1, 12)")
    refused(person, "DROP VIEW tunnel_api.leak")


@pytest.mark.parametrize("person", ["vera"], indirect=True)
def test_viewer_changes_nothing(person: psycopg.Connection) -> None:
    for statement in (REVIEW, JUDGE, MOVE, DRAW, "DELETE FROM tunnel_api.region", "DELETE FROM tunnel_api.leak"):
        refused(person, statement)


def may(person: psycopg.Connection, statement: sql.Composed) -> bool:
    """Try a statement that touches no row."""
    try:
        with person.transaction(force_rollback=True):
            person.execute(statement)
    except (
        psycopg.errors.InsufficientPrivilege,
        psycopg.errors.ObjectNotInPrerequisiteState,  # a view through which nobody can
        psycopg.errors.FeatureNotSupported,  # a column that is computed
        psycopg.errors.GeneratedAlways,
    ):
        return False
    return True


@pytest.mark.parametrize(
    ("person", "allowed"),
    [("vera", {}), ("ines", EDITABLE), ("otto", EDITABLE | CATALOGUE), ("nobody", {})],
    indirect=["person"],
)
def test_every_view_and_column_is_closed_but_for_what_is_to_be_edited(
    person: psycopg.Connection, allowed: dict[str, set[str]], conn: psycopg.Connection
) -> None:
    columns = conn.execute(
        "SELECT c.relname, array_agg(a.attname::text) FROM pg_class c"
        "  JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0"
        " WHERE c.relnamespace = 'tunnel_api'::regnamespace AND c.relkind = 'v' GROUP BY 1"
    ).fetchall()
    conn.rollback()
    assert len(columns) > 30
    found: dict[str, set[str]] = {}
    for name, names in columns:
        view = sql.Identifier("tunnel_api", name)
        tried = {
            "INSERT": sql.SQL("INSERT INTO {0} SELECT * FROM {0} WHERE false").format(view),
            "DELETE": sql.SQL("DELETE FROM {} WHERE false").format(view),
        } | {column: sql.SQL("UPDATE {0} SET {1} = {1} WHERE false").format(view, sql.Identifier(column)) for column in names}
        found[name] = {what for what, statement in tried.items() if may(person, statement)}
    assert {name: whats for name, whats in found.items() if whats} == allowed


@pytest.mark.parametrize("person", ["vera", "ines"], indirect=True)
def test_readers_call_no_function_that_could_write(person: psycopg.Connection, conn: psycopg.Connection) -> None:
    """PostgreSQL itself keeps functions that are not volatile from writing, so volatile ones are those to be refused."""
    functions = conn.execute(
        "SELECT p.oid::regprocedure::text, p.pronamespace::regnamespace::text, p.proname, p.proargtypes::regtype[]::text[],"
        "       p.provolatile = 'v' FROM pg_proc p"
        " WHERE p.pronamespace = ANY (ARRAY['tunnel_api', 'tunnel_internal']::regnamespace[])"
        "   AND p.prorettype <> 'trigger'::regtype AND p.prokind = 'f'"
    ).fetchall()
    conn.rollback()
    refused_ones = set()
    for signature, schema, name, types, _ in functions:
        columns = [sql.Identifier(f"c{number}") for number in range(len(types))]
        nulls = [sql.SQL("NULL::{} AS {}").format(sql.SQL(kind), column) for kind, column in zip(types, columns, strict=True)]
        # OFFSET keeps the nulls out of the planner's sight, which else would not call a STRICT function
        call = sql.SQL("SELECT {}({}) FROM (SELECT {} OFFSET 0) n").format(
            sql.Identifier(schema, name), sql.SQL(", ").join(columns), sql.SQL(", ").join(nulls)
        )
        try:
            with person.transaction(force_rollback=True):
                person.execute(call)
        except psycopg.errors.InsufficientPrivilege:
            refused_ones.add(signature)
        except psycopg.Error:  # it ran, and did not like its arguments
            pass
    assert len(refused_ones) > 10
    written = {
        "finding_split",
        "finding_merge",
        "finding_undo",
        "finding_photo_add",
        "show_as_of",
        "crack_search_add",
        "crack_search_remove",
    }
    own = written if person.info.user == "ines" else set()
    writing = {signature for signature, _, name, _, writes in functions if writes and name not in own}
    assert writing <= refused_ones
    assert [name for name in refused_ones - writing if name.startswith("tunnel_api.")] == []


def test_viewers_call_of_tunnel_internal_only_what_views_and_functions_need(conn: psycopg.Connection) -> None:
    rows = conn.execute(
        "SELECT p.proname, p.provolatile = 'v' OR p.prokind <> 'f', has_function_privilege('tunnel_viewer', p.oid, 'EXECUTE')"
        "  FROM pg_proc p WHERE p.pronamespace = 'tunnel_internal'::regnamespace"
    ).fetchall()
    viewers = {name for name, _, allowed in rows if allowed}
    assert {"in_order", "scanner_chainage", "remark_statements"} <= viewers, viewers
    assert not viewers & {"queue_state", "superseded_runs", "segment_plan", "last_step"}
    assert [name for name, writes, allowed in rows if writes and allowed] == []
    assert conn.execute(
        "SELECT count(*) FROM pg_class c WHERE c.relnamespace = 'tunnel_internal'::regnamespace AND c.relkind = 'v'"
        " AND has_table_privilege('tunnel_viewer', c.oid, 'SELECT')"
    ).fetchone() == (0,)


@pytest.mark.parametrize(
    ("person", "writes"), [("vera", False), ("ines", False), ("otto", True), ("nobody", False)], indirect=["person"]
)
def test_what_qgis_keeps_in_the_database_is_the_operators_to_write(
    person: psycopg.Connection, writes: bool, conn: psycopg.Connection
) -> None:
    tables = [
        row[0]
        for row in conn.execute(
            "SELECT relname FROM pg_class c WHERE relnamespace = 'public'::regnamespace AND relkind = 'r'"
            " AND NOT EXISTS (SELECT FROM pg_depend d WHERE d.objid = c.oid AND d.deptype = 'e')"
        )
    ]
    conn.rollback()
    assert "layer_styles" in tables
    for name in tables:
        table = sql.Identifier("public", name)
        assert may(person, sql.SQL("DELETE FROM {} WHERE false").format(table)) is writes, name
        assert may(person, sql.SQL("INSERT INTO {0} SELECT * FROM {0} WHERE false").format(table)) is writes, name
        refused(person, sql.SQL("DROP TABLE {}").format(table).as_string())


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_inspector_reviews_moves_and_draws_under_her_own_name(person: psycopg.Connection) -> None:
    for statement in (REVIEW, JUDGE, MOVE, DRAW):
        person.execute(statement)  # type: ignore[arg-type]
    assert person.execute("SELECT DISTINCT reviewed_by FROM tunnel_api.leak WHERE reviewed_by IS NOT NULL").fetchall() == [
        ("ines",)
    ]
    assert person.execute("SELECT reviewed_by FROM tunnel_api.finding WHERE kind <> kind_detected").fetchall() == [("ines",)]
    assert person.execute("SELECT edited_by FROM tunnel_api.axis_vertex WHERE source = 'edited'").fetchall() == [("ines",)]
    assert person.execute("SELECT count(*) FROM tunnel_api.region WHERE drawn_by = 'ines'").fetchone() == (1,)


@pytest.mark.parametrize("person", ["ines"], indirect=True)
def test_inspector_may_change_nothing_else(person: psycopg.Connection) -> None:
    for statement in (
        "UPDATE tunnel_api.leak_3d SET geom = NULL",
        "SELECT tunnel_api.dry_region_approve(1)",
        "UPDATE tunnel_api.leak SET reviewed_by = 'vera'",
        "UPDATE tunnel_api.leak SET area = 0",
        "UPDATE tunnel_api.finding SET kind_detected = 'leak'",
        "UPDATE tunnel_api.finding_3d SET reasons = '{}'",
        "DELETE FROM tunnel_api.leak",
        "UPDATE tunnel_api.axis_vertex SET source = 'measured'",
        "UPDATE tunnel_api.axis_vertex SET edited_by = 'vera'",
        "DELETE FROM tunnel_api.axis_vertex",
        "UPDATE tunnel_api.region SET drawn_by = 'vera'",
        "UPDATE tunnel_api.tunnel SET name = 'mine'",
        "INSERT INTO tunnel_api.run (id) VALUES (1)",
        "INSERT INTO public.layer_styles (stylename) VALUES ('mine')",
    ):
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
    refused(person, "DROP SCHEMA tunnel_internal CASCADE")
    for schema in ("tunnel_api", "tunnel_internal"):
        refused(person, f"CREATE FUNCTION {schema}.mine() RETURNS int LANGUAGE sql AS 'SELECT 1'")
    refused(person, "CREATE ROLE another")


@pytest.mark.parametrize("person", ["otto"], indirect=True)
def test_operator_forges_no_entry_of_the_audit(person: psycopg.Connection, conn: psycopg.Connection) -> None:
    """Neither a view of his own with old and new values and the audit trigger, nor the function itself, forges an entry."""
    install(conn, REGISTRY)  # once more, over what was granted before
    conn.commit()
    person.execute("CREATE TEMP VIEW mine AS SELECT * FROM tunnel_api.leak")
    for function in ("review_finding", "edit_axis_vertex", "edit_region"):
        refused(
            person, f"CREATE TRIGGER edit INSTEAD OF UPDATE ON mine FOR EACH ROW EXECUTE FUNCTION tunnel_internal.{function}()"
        )
    with pytest.raises(psycopg.errors.InsufficientPrivilege, match="permission denied for function note_edit"):
        person.execute("SELECT tunnel_internal.note_edit('demo-2024', 'finding', 1, '{}', '{\"review\": \"confirmed\"}')")
    assert conn.execute(
        "SELECT count(*) FROM pg_proc p WHERE p.pronamespace = ANY (ARRAY['tunnel_api', 'tunnel_internal']::regnamespace[])"
        " AND p.prorettype = 'trigger'::regtype AND has_function_privilege('tunnel_operator', p.oid, 'EXECUTE')"
    ).fetchone() == (0,)
    person.execute(REVIEW)  # type: ignore[arg-type]


@pytest.mark.parametrize("person", ["nobody"], indirect=True)
def test_someone_without_a_role_sees_nothing(person: psycopg.Connection) -> None:
    for statement in (READ, TABLE, "SELECT tunnel_api.chainage_label(1.0)", REVIEW):
        refused(person, statement)


def test_security_definers_fix_their_search_path(conn: psycopg.Connection) -> None:
    assert (
        conn.execute(
            "SELECT oid::regprocedure::text FROM pg_proc "
            "WHERE pronamespace = ANY (ARRAY['tunnel_api', 'tunnel_internal']::regnamespace[]) "
            "AND prosecdef AND NOT EXISTS (SELECT FROM unnest(proconfig) c WHERE c LIKE 'search_path=%pg_temp')"
        ).fetchall()
        == []
    )


def test_functions_name_postgis_by_its_schema(conn: psycopg.Connection) -> None:
    """So that they run under a search path that holds nothing which others may write."""
    assert (
        conn.execute(
            "SELECT p.oid::regprocedure::text, m[1]"
            "  FROM pg_proc p, regexp_matches(p.prosrc, '(?<![.[:alnum:]_])(st_\\w+)\\(', 'gi') m"
            " WHERE p.pronamespace = ANY (ARRAY['tunnel_api', 'tunnel_internal']::regnamespace[])"
            " AND m[1] NOT IN ('ST_Transform', 'ST_Dump')"  # in hints
        ).fetchall()
        == []
    )
    assert conn.execute("SELECT FROM pg_proc, unnest(proconfig) c WHERE c LIKE 'search_path=%public%'").fetchall() == []


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
        install(owner, REGISTRY)
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
    assert one("SELECT tunnel_internal.queue_plan(id) FROM tunnel.survey") == 1
    worker = one("SELECT tunnel_queue.procrastinate_register_worker_v1()")
    one(f"SELECT tunnel_internal.queue_register({worker}, 'h', 1)")
    job = one(f"SELECT id FROM tunnel_queue.procrastinate_fetch_job_v2(ARRAY['tunneldb'], {worker})")
    one(f"SELECT tunnel_queue.procrastinate_update_heartbeat_v1({worker})")
    assert one("SELECT tunnel_internal.queue_rescue()") == 0
    assert one(f"SELECT tunnel_internal.queue_hold({job}, {worker})") is True
    one(f"SELECT tunnel_internal.queue_done({job}, clock_timestamp())")
    assert one("SELECT count(*) FROM tunnel.incoming") == 0


@pytest.mark.parametrize("person", ["vera", "ines"], indirect=True)
def test_readers_leave_the_queue_alone(person: psycopg.Connection) -> None:
    refused(person, "SELECT tunnel_internal.queue_plan(1)")
    refused(person, "SELECT tunnel_internal.queue_rescue()")
    refused(person, "SELECT count(*) FROM tunnel_queue.procrastinate_jobs")
    refused(person, "SELECT tunnel_queue.procrastinate_register_worker_v1()")


@pytest.mark.parametrize("person", ["vera", "ines", "otto"], indirect=True)
def test_where_files_lie_is_for_operators(conn: psycopg.Connection, person: psycopg.Connection) -> None:
    conn.execute(
        "INSERT INTO tunnel.scan_file (survey_id, name, path, checksum, bytes, points, noise, outside, thinned, kept)"
        " SELECT id, 'a.laz', '/home/otto/scans/a.laz', '', 1, 1, 0, 0, 0, 1 FROM tunnel.survey"
    )
    conn.commit()
    (path,) = person.execute("SELECT path FROM tunnel_api.file WHERE name = 'a.laz'").fetchone()
    assert path == ("/home/otto/scans/a.laz" if person.info.user == "otto" else None)
