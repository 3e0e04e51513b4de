"""Objects of others on the tables of schema tunnel that run with the rights of whoever writes there.

Operators own the tables. A trigger (also on a table that refers to one of them), a rule, a policy, a view in place of a
table, or a function in a check, a default, a generated column or an index runs with the rights of whoever writes: with those
of the database's owner behind the views and in the owner's own runs. A function in extended statistics runs whenever somebody
analyses the table. A function or an operator in schema public that matches a call better than that of PostgreSQL or PostGIS is
called instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import psycopg

SUBJECTS = ("triggers", "expressions", "functions")
"""Subjects of the examination; rules and policies belong to the expressions."""

# Roles whose functions may run with the owner's rights, since they have these rights anyway.
_TRUSTED = """
    SELECT oid FROM pg_roles WHERE rolsuper
    UNION SELECT nspowner FROM pg_namespace WHERE nspname = 'tunnel_api'
    UNION SELECT datdba FROM pg_database WHERE datname = current_database()
"""

# PostGIS may belong to another role, as on managed servers.
_OF_EXTENSION = "EXISTS (SELECT FROM pg_depend e WHERE e.deptype = 'e' AND e.classid = {} AND e.objid = {})"

# Tables of the schema, and tables of any schema that inherit from them or that they inherit from: a table that becomes a
# partition of another one gets its triggers, checks and indexes.
_OWN_TABLES = """
    SELECT c.oid FROM pg_class c
     WHERE c.relnamespace = 'tunnel'::regnamespace AND c.relkind IN ('r', 'p', 'v')
    UNION
    SELECT CASE WHEN i.inhparent = owned.oid THEN i.inhrelid ELSE i.inhparent END
      FROM owned JOIN pg_inherits i ON owned.oid IN (i.inhparent, i.inhrelid)
"""

# Table, trigger, schema and name of its function.
_OWN = (
    *(("survey", name, "tunnel", name) for name in ("drop_points", "make_images")),
    *(("finding", name, "tunnel", "note_finding") for name in ("note_insert", "note_delete")),
    ("finding", "note_update", "tunnel", "note_finding_update"),
    *(
        ("coverage", name, "tunnel", "note_coverage")
        for name in ("note_insert", "note_update_old", "note_update_new", "note_delete")
    ),
    *((table, "note_truncate", "tunnel", "forget_waterproof") for table in ("finding", "coverage")),
    *(("finding", name, "tunnel", name) for name in ("set_wet", "count_insert", "count_update", "count_delete")),
    ("finding", "count_truncate", "tunnel", "forget_findings"),
    ("finding_kind", "wet_of_kind", "tunnel", "wet_of_kind"),
    ("run", "set_subject", "tunnel", "set_subject"),
    ("as_of", "refuse_past", "tunnel", "refuse_past"),
    ("waterproof", "keep", "tunnel_internal", "keep_at_commit"),
)
_OURS = ", ".join(str(each) for each in _OWN)

_TRIGGERS = f"""
WITH RECURSIVE trusted AS ({_TRUSTED}), owned AS ({_OWN_TABLES})
SELECT format('%s on %s is not tunneldb''s: it runs what %s wrote', quote_ident(t.tgname), t.tgrelid::regclass,
              pg_get_userbyid(p.proowner)),
       format('DROP TRIGGER %I ON %s;', t.tgname, t.tgrelid::regclass)
  FROM pg_trigger t JOIN owned ON owned.oid = t.tgrelid JOIN pg_proc p ON p.oid = t.tgfoid
 WHERE NOT t.tgisinternal AND t.tgparentid = 0
   AND NOT (p.proowner IN (SELECT oid FROM trusted)
            AND (t.tgrelid, t.tgname, p.pronamespace, p.proname) IN (
                SELECT to_regclass('tunnel.' || o.relation), o.trigger, o.namespace::regnamespace, o.function
                  FROM (VALUES {_OURS}) AS o (relation, trigger, namespace, function)))
 ORDER BY 1
"""

# Triggers of tunneldb that are missing or disabled.
_SILENT = f"""
SELECT format('%s on tunnel.%s %s', o.trigger, o.relation,
              CASE WHEN t.oid IS NULL THEN 'is missing' ELSE 'is switched off' END),
       CASE WHEN t.oid IS NULL THEN 'restore schema tunnel from a backup, then tunneldb init'
            ELSE format('ALTER TABLE tunnel.%I ENABLE TRIGGER %I; then tunneldb init', o.relation, o.trigger) END
  FROM (VALUES {_OURS}) AS o (relation, trigger, namespace, function)
  LEFT JOIN pg_trigger t ON t.tgrelid = to_regclass('tunnel.' || o.relation) AND t.tgname = o.trigger
 WHERE t.tgenabled IS NULL OR t.tgenabled NOT IN ('O', 'A')
 ORDER BY 1
"""

# Foreign keys of other tables: deleting or renumbering rows here deletes or changes rows there, and runs their triggers.
_REFERENCES = f"""
WITH RECURSIVE owned AS ({_OWN_TABLES})
SELECT format('foreign key %I of %s is not tunneldb''s: it runs triggers there', k.conname, k.conrelid::regclass),
       format('ALTER TABLE %s DROP CONSTRAINT %I;', k.conrelid::regclass, k.conname)
  FROM pg_constraint k JOIN owned ON owned.oid = k.confrelid
 WHERE k.contype = 'f' AND k.conparentid = 0 AND k.conrelid NOT IN (SELECT oid FROM owned)
   AND (k.confdeltype NOT IN ('a', 'r') OR k.confupdtype NOT IN ('a', 'r'))
 ORDER BY 1
"""

# Rules and policies: tunneldb has none; a view in a table's place is one, too.
_RULES = f"""
WITH RECURSIVE owned AS ({_OWN_TABLES})
SELECT format('rule %I on %s is not tunneldb''s: it runs', r.rulename, r.ev_class::regclass),
       CASE WHEN r.rulename = '_RETURN' THEN format('DROP VIEW %s;', r.ev_class::regclass)
            ELSE format('DROP RULE %I ON %s;', r.rulename, r.ev_class::regclass) END
  FROM pg_rewrite r JOIN owned ON owned.oid = r.ev_class
UNION ALL
SELECT format('policy %I on %s is not tunneldb''s: it runs', y.polname, y.polrelid::regclass),
       format('DROP POLICY %I ON %s;', y.polname, y.polrelid::regclass)
  FROM pg_policy y JOIN owned ON owned.oid = y.polrelid
 ORDER BY 1
"""

# Expressions by the functions, operators and types that they call, from the numbers in their trees, since dependences on
# objects of PostgreSQL, such as query_to_xml, are not recorded. Those of tunneldb call only immutable functions, the clock,
# and the id of the session.
_EXPRESSIONS = f"""
WITH RECURSIVE trusted AS ({_TRUSTED}), owned AS ({_OWN_TABLES}),
expression (relation, what, tree, remedy) AS (
    SELECT k.conrelid, format('check %I', k.conname), k.conbin::text,
           format('ALTER TABLE %s DROP CONSTRAINT %I;', k.conrelid::regclass, k.conname)
      FROM pg_constraint k JOIN owned ON owned.oid = k.conrelid WHERE k.contype = 'c' AND k.conislocal
    UNION ALL
    SELECT d.adrelid, format('default of column %I', a.attname), d.adbin::text,
           format('ALTER TABLE %s ALTER COLUMN %I DROP %s;', d.adrelid::regclass, a.attname,
                  CASE a.attgenerated WHEN '' THEN 'DEFAULT' ELSE 'EXPRESSION' END)
      FROM pg_attrdef d JOIN owned ON owned.oid = d.adrelid JOIN pg_attribute a ON a.attrelid = d.adrelid AND a.attnum = d.adnum
    UNION ALL
    SELECT x.indrelid, format('index %s', x.indexrelid::regclass), concat(x.indexprs::text, x.indpred::text),
           format('DROP INDEX %s;', x.indexrelid::regclass)
      FROM pg_index x JOIN owned ON owned.oid = x.indrelid JOIN pg_class i ON i.oid = x.indexrelid AND NOT i.relispartition
    UNION ALL
    SELECT t.tgrelid, format('condition of trigger %I', t.tgname), t.tgqual::text, 'restore the table from a backup'
      FROM pg_trigger t JOIN owned ON owned.oid = t.tgrelid WHERE t.tgparentid = 0 AND t.tgqual IS NOT NULL
    UNION ALL
    SELECT x.stxrelid, format('statistics %I.%I', x.stxnamespace::regnamespace, x.stxname), x.stxexprs::text,
           format('DROP STATISTICS %I.%I;', x.stxnamespace::regnamespace, x.stxname)
      FROM pg_statistic_ext x JOIN owned ON owned.oid = x.stxrelid
    UNION ALL
    SELECT p.partrelid, 'partition key', p.partexprs::text, 'restore the table from a backup'
      FROM pg_partitioned_table p JOIN owned ON owned.oid = p.partrelid
    UNION ALL
    SELECT a.attrelid, format('type of column %I', a.attname), format(':resulttype %s ', a.atttypid),
           format('ALTER TABLE %s ALTER COLUMN %I TYPE %s;', a.attrelid::regclass, a.attname,
                  format_type(coalesce(nullif(t.typbasetype, 0), 'text'::regtype), t.typtypmod))
      FROM pg_attribute a JOIN owned ON owned.oid = a.attrelid JOIN pg_type t ON t.oid = a.atttypid
     WHERE a.attnum > 0 AND NOT a.attisdropped
),
named AS (
    SELECT e.*, m[1] AS kind, m[2]::oid AS number
      FROM expression e CROSS JOIN LATERAL regexp_matches(e.tree, ':(funcid|opno|resulttype) (\\d+)', 'g') AS m
),
called AS (
    SELECT n.relation, n.what, n.remedy, p.oid::regprocedure::text AS name
      FROM named n LEFT JOIN pg_operator o ON n.kind = 'opno' AND o.oid = n.number
      JOIN pg_proc p ON p.oid = CASE n.kind WHEN 'funcid' THEN n.number WHEN 'opno' THEN o.oprcode END
     WHERE (p.proowner NOT IN (SELECT oid FROM trusted) AND NOT {_OF_EXTENSION.format("'pg_proc'::regclass", "p.oid")})
        OR (p.provolatile <> 'i'
            AND p.oid NOT IN ('now()'::regprocedure, 'clock_timestamp()'::regprocedure, 'pg_backend_pid()'::regprocedure,
                              'nextval(regclass)'::regprocedure))
    UNION ALL
    SELECT n.relation, n.what, n.remedy, format_type(t.oid, NULL)
      FROM named n JOIN pg_type t ON n.kind = 'resulttype' AND t.oid = n.number
     WHERE t.typowner NOT IN (SELECT oid FROM trusted) AND NOT {_OF_EXTENSION.format("'pg_type'::regclass", "t.oid")}
)
SELECT format('%s of %s is not tunneldb''s: it runs %s', c.what, c.relation::regclass, string_agg(DISTINCT c.name, ', ')),
       c.remedy
  FROM called c GROUP BY c.relation, c.what, c.remedy ORDER BY 1
"""

# Functions and operators in everybody's search path that share their name with one of PostgreSQL or of an extension.
_OVERLOADS = f"""
WITH trusted AS ({_TRUSTED}),
routine (oid, name, catalog, namespace, owner, what, remedy) AS (
    SELECT p.oid, p.proname, 'pg_proc'::regclass, p.pronamespace, p.proowner, 'function ' || p.oid::regprocedure,
           'DROP ROUTINE ' || p.oid::regprocedure || ' CASCADE;'
      FROM pg_proc p
    UNION ALL
    SELECT o.oid, o.oprname, 'pg_operator'::regclass, o.oprnamespace, o.oprowner, 'operator ' || o.oid::regoperator,
           'DROP OPERATOR ' || o.oid::regoperator || ' CASCADE;'
      FROM pg_operator o
),
given (name, catalog) AS (
    SELECT r.name, r.catalog FROM routine r
     WHERE r.namespace = 'pg_catalog'::regnamespace OR {_OF_EXTENSION.format("r.catalog", "r.oid")}
)
SELECT r.what || ' is not tunneldb''s: it runs in the place of what a call means,'
       || ' with the rights of whoever calls', r.remedy
  FROM routine r
 WHERE r.namespace = 'public'::regnamespace AND r.owner NOT IN (SELECT oid FROM trusted)
   AND NOT {_OF_EXTENSION.format("r.catalog", "r.oid")} AND (r.name, r.catalog) IN (SELECT g.name, g.catalog FROM given g)
 ORDER BY 1
"""


@contextmanager
def catalogue_alone(connection: psycopg.Connection[Any]) -> Iterator[None]:
    """Restrict names and operators to those of PostgreSQL, within a transaction or savepoint, whatever else exists.

    Otherwise an operator for types that PostgreSQL compares only by casts, ``oid = regnamespace``, would be the one in public.
    """
    with connection.transaction():
        before = connection.execute("SELECT pg_catalog.current_setting('search_path')").fetchone()
        connection.execute("SET LOCAL search_path = pg_catalog, pg_temp")
        yield
        assert before is not None
        connection.execute("SELECT pg_catalog.set_config('search_path', %s, true)", before)


def foreign_objects(connection: psycopg.Connection[Any]) -> Iterator[tuple[str, str, str]]:
    """Yield objects that are not tunneldb's and may run code with the rights of others: on tables of tunnel, and in public.

    Yields
    ------
    (str, str, str)
        One of SUBJECTS; the object, and with whose rights it runs; the statement that removes it.
    """
    for subject, query in (
        ("triggers", _TRIGGERS), ("triggers", _REFERENCES), ("expressions", _RULES), ("expressions", _EXPRESSIONS),
    ):  # fmt: skip
        for text, remedy in _rows(connection, query):
            yield subject, f"{text} with the rights of whoever writes there", remedy
    for text, remedy in overloads(connection):
        yield "functions", text, remedy


def overloads(connection: psycopg.Connection[Any]) -> list[tuple[str, str]]:
    """Return functions and operators in schema public that may be called instead of others, with statements to remove them."""
    return _rows(connection, _OVERLOADS)


def silent_triggers(connection: psycopg.Connection[Any]) -> list[tuple[str, str]]:
    """Return tunneldb's own triggers that are missing or disabled, with statements to restore them.

    Without them partitions are not removed, or cached values of a kilometre are used although it has changed.
    """
    return _rows(connection, _SILENT)


def _rows(connection: psycopg.Connection[Any], query: str) -> list[tuple[str, str]]:
    with catalogue_alone(connection):
        return connection.execute(query.encode()).fetchall()
