"""Functions and operators that somebody plants in schema public, to have others run them."""

from __future__ import annotations

import psycopg
import pytest
from click.testing import CliRunner
from psycopg import sql

from tests.database.test_roles import DRAW, MOVE, REVIEW
from tunneldb.cli.main import main
from tunneldb.database import install
from tunneldb.errors import UserError
from tunneldb.stages.registry import REGISTRY

# Each fits a call that tunnel_api makes better than PostgreSQL's own, which take "any", anyelement or another type.
OVERLOADS = (
    "FUNCTION public.format(a text, b text) RETURNS text",
    "FUNCTION public.format(a text, b text, c text) RETURNS text",
    "FUNCTION public.concat_ws(a text, b text, c text) RETURNS text",
    "FUNCTION public.jsonb_build_object(a text, b text) RETURNS jsonb",
    "FUNCTION public.jsonb_build_object(a text, b text, c text, d text) RETURNS jsonb",
    "FUNCTION public.array_append(a float8[], b float8) RETURNS float8[]",
    "FUNCTION public.array_length(a float8[], b int) RETURNS int",
    "FUNCTION public.cardinality(a float8[]) RETURNS int",
    "FUNCTION public.upper(a varchar) RETURNS text",
    "FUNCTION public.round(a float8, b int) RETURNS numeric",
)
CALLS = (
    "SELECT u.* FROM tunnel_api.survey s, tunnel_api.unroll(s.id, tunnel_api.roll(s.id, 12345.0, 2.0, 0.1)) u",
    "SELECT tunnel_api.wet_area('demo-2024', 12300, 12500)",
    "SELECT * FROM tunnel_api.waterproof_class('demo-2024', 12300, 12500)",
    "SELECT * FROM tunnel_api.coverage('demo-2024', 12300, 12500)",
    "SELECT * FROM tunnel_api.leak_statistics('demo-2024', 12300, 12500)",
    "SELECT * FROM tunnel_api.stage_status",
    "SELECT tunnel_api.station_label(id, 12345.678) FROM tunnel_api.tunnel",
    REVIEW,
    MOVE,
    DRAW,
    "INSERT INTO tunnel_api.finding_unrolled (survey, kind, geom)"
    " VALUES ('demo-2024', 'spall', ST_MakeEnvelope(12400, 0, 12401, 1, 0))",
    "UPDATE tunnel_api.finding_unrolled SET geom = ST_MakeEnvelope(12400, 0, 12401, 2, 0) WHERE kind = 'spall'",
    "SELECT tunnel_api.finding_split(id, ST_MakeLine(ST_MakePoint(12399, 1), ST_MakePoint(12402, 1)))"
    " FROM tunnel_api.finding_unrolled WHERE kind = 'spall'",
)


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def plant(owner: psycopg.Connection, person: psycopg.Connection) -> None:
    """Open schema public to everybody, as before PostgreSQL 15, and let a person write functions that tell who ran them."""
    owner.execute("GRANT CREATE ON SCHEMA public TO PUBLIC")
    owner.execute("CREATE TABLE public.sprung (who text, what text)")
    owner.execute("GRANT SELECT, INSERT ON public.sprung TO PUBLIC")
    owner.commit()
    for head in OVERLOADS:
        name, result = head.split("(")[0].split(".")[1], head.split("RETURNS ")[1]
        person.execute(
            f"CREATE {head} LANGUAGE plpgsql AS $$ BEGIN INSERT INTO public.sprung VALUES (current_user, '{name}');"
            f" RETURN NULL::{result}; END $$"  # type: ignore[arg-type]
        )


@pytest.mark.parametrize("person", ["vera", "ines", "otto"], indirect=True)
def test_nobody_but_the_owner_creates_in_public(person: psycopg.Connection) -> None:
    for head in OVERLOADS:
        with pytest.raises(psycopg.errors.InsufficientPrivilege):
            person.execute(f"CREATE {head} LANGUAGE sql AS 'SELECT NULL'")  # type: ignore[arg-type]


@pytest.mark.parametrize("person", ["vera", "ines", "otto"], indirect=True)
def test_functions_run_nothing_that_was_planted(conn: psycopg.Connection, person: psycopg.Connection, dsn: str) -> None:
    """Also where everybody may create in public, and with the owner's rights; check names what was planted, init ends it."""
    plant(conn, person)
    for call in CALLS:
        conn.execute(call)  # type: ignore[arg-type]
    assert conn.execute("SELECT * FROM public.sprung").fetchall() == []
    conn.execute("SELECT format('%s', 'text'::text)")
    assert conn.execute("SELECT what FROM public.sprung").fetchall() == [("format",)]  # what is planted does run
    conn.rollback()

    said = CliRunner().invoke(main, ["--dsn", dsn, "check"]).output
    assert "PUBLIC may create functions in it" in said
    assert "function public.format(text,text) is not tunneldb's" in said
    with pytest.raises(UserError, match=r"function public\..* DROP ROUTINE public\..* more: tunneldb check"):
        install(conn, REGISTRY)
    conn.rollback()
    conn.execute(sql.SQL("DROP OWNED BY {}").format(sql.Identifier(person.info.user)))
    conn.commit()
    install(conn, REGISTRY)
    conn.commit()
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        person.execute("CREATE FUNCTION public.format(a int, b int) RETURNS text LANGUAGE sql AS 'SELECT NULL'")
    assert "may create functions in it" not in CliRunner().invoke(main, ["--dsn", dsn, "check"]).output


@pytest.mark.parametrize("person", ["otto"], indirect=True)
@pytest.mark.parametrize("types", [("oid", "regnamespace"), ("oid", "regclass"), ("regclass", "oid"), ("name", "text")])
def test_who_looks_for_what_was_planted_does_not_run_it(
    conn: psycopg.Connection, person: psycopg.Connection, dsn: str, types: tuple[str, str]
) -> None:
    """An operator of types that PostgreSQL itself compares by casts would be run by the search, and could hide itself."""
    conn.execute("GRANT CREATE ON SCHEMA public TO PUBLIC")
    conn.execute("CREATE TABLE public.sprung (who text)")
    conn.execute("GRANT SELECT, INSERT ON public.sprung TO PUBLIC")
    conn.commit()
    person.execute(
        f"CREATE FUNCTION public.spy(a {types[0]}, b {types[1]}) RETURNS bool LANGUAGE plpgsql AS"
        " $$ BEGIN INSERT INTO public.sprung VALUES (current_user); RETURN false; END $$"  # type: ignore[arg-type]
    )
    person.execute(f"CREATE OPERATOR public.= (leftarg = {types[0]}, rightarg = {types[1]}, function = public.spy)")  # type: ignore[arg-type]
    for verb in ("check", "init"):
        done = CliRunner().invoke(main, ["--dsn", dsn, verb])
        assert done.exit_code in (1, 2)
        assert f"operator public.=({types[0]},{types[1]}) is not tunneldb's" in done.output
        conn.rollback()
        assert conn.execute("SELECT who FROM public.sprung").fetchall() == []
