"""The views over all servers: their columns, and how each server takes part. Nothing here knows a database."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from tunneldb.federation.names import SERVER


class Column(NamedTuple):
    """Column of a view: name and type."""

    name: str
    type: str


Tables = Mapping[str, tuple[Column, ...]]
"""Columns of each view or table of a schema."""


@dataclass(frozen=True)
class HubView:
    """View over all servers.

    Attributes
    ----------
    name
        Name, that of the view of tunnel_api.
    columns
        Columns, ``server`` first.
    partitions
        Servers that have exactly these columns: partitions, to which joins and aggregates can be sent.
    incomplete
        Servers that lack columns, or have them of another type, with the columns that they have; the others are NULL.
    away, lacking
        Servers in whose place a branch warns: they do not answer, or are of a version without this view.
    """

    name: str
    columns: tuple[Column, ...]
    partitions: tuple[str, ...]
    incomplete: Mapping[str, frozenset[str]]
    away: tuple[str, ...]
    lacking: tuple[str, ...]


def plan_views(servers: Mapping[str, Tables], away: Collection[str] = ()) -> list[HubView]:
    """Return the views over all servers.

    Parameters
    ----------
    servers
        Columns of the views of each server. The first one that has a view gives the order of its columns and their types;
        further columns of others follow.
    away
        Servers that do not answer. Their columns count, so that views keep their form.
    """
    names = sorted({view for tables in servers.values() for view in tables})
    return [_plan(name, servers, away) for name in names]


def _plan(name: str, servers: Mapping[str, Tables], away: Collection[str]) -> HubView:
    having = {server: tables[name] for server, tables in servers.items() if name in tables}
    types: dict[str, str] = {}
    for columns in having.values():
        for column in columns:
            types.setdefault(*column)
    wanted = sorted((Column(*item) for item in types.items()), key=lambda column: column.name != SERVER)
    partitions, incomplete = [], {}
    for server, columns in having.items():
        if server in away:
            continue
        if set(columns) == set(wanted):
            partitions.append(server)
        else:
            incomplete[server] = frozenset(column.name for column in columns if column in wanted)
    lacking = tuple(server for server in servers if server not in having and server not in away)
    absent = tuple(server for server in servers if server in away)
    return HubView(name, tuple(wanted), tuple(partitions), incomplete, absent, lacking)


def find_gaps(servers: Mapping[str, Tables]) -> dict[str, list[str]]:
    """Return for each server the views and columns that others have and it lacks, as ``leak`` and ``leak.area``."""
    gaps: dict[str, list[str]] = {server: [] for server in servers}
    for view in plan_views(servers):
        for server, tables in servers.items():
            if view.name not in tables:
                gaps[server].append(view.name)
            elif server in view.incomplete:
                gaps[server] += [f"{view.name}.{c.name}" for c in view.columns if c.name not in view.incomplete[server]]
    return gaps
