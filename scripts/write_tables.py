"""Write `migrations/baseline/tables.sql` from the models, with every comment, constraint and index.

The file is a part of the first migration. Run this after each change of the models until version 0.1.0 is released. From
then on the file stays as it is, and a change of the models needs a migration.
"""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import Table
from sqlalchemy.dialects import postgresql
from sqlalchemy.schema import CreateIndex, CreateTable, DDLElement, SetColumnComment, SetTableComment

from tunneldb.database.models import Base

TABLES = Path(__file__).parents[1] / "migrations" / "baseline" / "tables.sql"
_HEAD = "-- Written from tunneldb/database/models/ by scripts/write_tables.py; do not edit.\n"


def tables_sql() -> str:
    """Return the statements that create all tables of the models; a table comes after those that it refers to."""
    return "\n".join([_HEAD, *(_table_sql(table) for table in Base.metadata.sorted_tables)])


def _table_sql(table: Table) -> str:
    statements: list[DDLElement] = [CreateTable(table), SetTableComment(table)]
    statements += [SetColumnComment(column) for column in table.columns]
    statements += [CreateIndex(index) for index in sorted(table.indexes, key=lambda index: str(index.name))]
    return "".join(f"{_text(statement)};\n" for statement in statements)


def _text(statement: DDLElement) -> str:
    lines = str(statement.compile(dialect=postgresql.dialect())).strip().replace("\t", "    ").split("\n")
    return "\n".join(line.rstrip() for line in lines if line.strip()).replace("%%", "%")


if __name__ == "__main__":
    TABLES.write_text(tables_sql(), "utf-8")
