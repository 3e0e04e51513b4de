"""Warnings about a server that answers: missing columns, rights of its login, its locale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import psycopg

from tunneldb.federation.servers import DatabaseState

_SHOWN = 5
"""Columns and views that are named."""


def describe_gaps(gaps: Sequence[str]) -> str:
    """Return what a server lacks, and the consequence."""
    more = f" and {len(gaps) - _SHOWN} more" if len(gaps) > _SHOWN else ""
    return f"lacks {', '.join(gaps[:_SHOWN])}{more}, which others have: such columns are NULL, such views have no rows and warn"


def warnings_of(connection: psycopg.Connection[Any], name: str, state: DatabaseState) -> list[str]:
    """Return warnings about a server's login and locale."""
    warnings = []
    if state.may_write:
        warnings.append(f"{name}: the login {state.login} may write there; use one that is a member of tunnel_viewer only")
    row = connection.execute("SELECT datcollate FROM pg_database WHERE datname = current_database()").fetchone()
    if row is not None and row[0] != state.locale:
        warnings.append(
            f"{name}: its locale is {state.locale}, that of the hub {row[0]}: texts may be sorted in another order there"
        )
    return warnings
