"""A hub of databases on the tests' server, and commands on it."""

from __future__ import annotations

from dataclasses import dataclass

from psycopg.conninfo import make_conninfo

from support.command import command

READER = "vera"
"""Login with the role tunnel_viewer: of the hub on its servers, and of a user on the hub."""


@dataclass(frozen=True)
class Federation:
    """DSNs of a hub and of its servers, as their owner."""

    hub: str
    north: str
    south: str

    def federate(self, *words: object, code: int = 0) -> str:
        """Run the command on the hub, and return what it prints."""
        return command("--dsn", self.hub, "federate", *words, code=code).output

    def add(self, name: str, dsn: str | None = None) -> str:
        return self.federate("add", name, "--dsn", reader(dsn or getattr(self, name)))


def reader(dsn: str) -> str:
    """DSN of a database for READER."""
    return make_conninfo(dsn, user=READER)
