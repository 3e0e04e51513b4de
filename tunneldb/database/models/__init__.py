"""Tables of schemas `tunnel` and `tunnel_audit`, as SQLAlchemy models.

Alembic compares these with the database; `migrations/baseline/tables.sql` is written from them. Units: metres,
decibels, seconds, square metres, unless a comment says otherwise.
"""

from importlib import import_module
from pkgutil import iter_modules

from tunneldb.database.models.base import AUDIT_SCHEMA, SCHEMA, Base

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")

__all__ = ["AUDIT_SCHEMA", "SCHEMA", "Base"]
