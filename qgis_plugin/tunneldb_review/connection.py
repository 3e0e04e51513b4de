"""Connection to a database of tunneldb, for QGIS and for the command ``tunneldb``. Passwords are not stored here."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Dict, List

PROJECT, SERVICE, HOME = "project", "service", "home"
"""Sources of a connection: the open project's layers, an entry of pg_service.conf, the home of an embedded server."""

_WORD = re.compile(r"\s*([a-z_]+)\s*=\s*('(?:[^'\\]|\\.)*'|\S*)")
_KEPT = ("service", "host", "port", "dbname", "user", "sslmode")


@dataclass(frozen=True)
class Connection:
    """A connection without its secrets.

    Attributes
    ----------
    words : dict
        Keywords of libpq: service, host, port, dbname, user, sslmode; what is not given is left to libpq.
    authcfg : str
        Id of a configuration of QGIS's authentication manager, if any. QGIS alone can use it.
    home : str
        Folder of the embedded server whose socket the words name, if it is one.
    """

    words: Dict[str, str] = field(default_factory=dict)
    authcfg: str = ""
    home: str = ""

    def arguments(self) -> List[str]:
        """Return the options of ``tunneldb`` before the command."""
        return [] if self.home else ["--dsn", dsn(self.words)]

    def environment(self) -> Dict[str, str]:
        """Return the variables with which ``tunneldb`` is called."""
        return {"TUNNELDB_HOME": self.home} if self.home else {}


def of_service(name: str, authcfg: str = "") -> Connection:
    """Connect by an entry of ``pg_service.conf``."""
    return Connection({"service": name}, authcfg)


def of_home(folder: str, told: str) -> Connection:
    """Connect to the embedded server of a folder, with the DSN printed by ``tunneldb server start``."""
    return Connection(words_of(told), home=folder)


def of_source(source: str) -> Connection:
    """Connect as a layer does, by its data source; a password in it is left there."""
    found = re.search(r"\bauthcfg=(\w+)", source)
    return Connection(words_of(source.split(" key=")[0].split(" table=")[0]), found.group(1) if found else "")


def words_of(text: str) -> Dict[str, str]:
    """Return the keywords of a DSN or a data source, without a password.

    Raises
    ------
    ValueError
        It names no server that can be reached.
    """
    words = {name: _unquoted(value) for name, value in _WORD.findall(text) if name in _KEPT}
    if not words.get("service") and not words.get("dbname"):
        raise ValueError(f"no database in {text.strip()[:80]!r}")
    return {name: value for name, value in words.items() if value}


def dsn(words: Dict[str, str]) -> str:
    """Return keywords as libpq wants them."""
    return " ".join(f"{name}={_quoted(value)}" for name, value in words.items())


def _quoted(value: str) -> str:
    if re.fullmatch(r"[\w./:-]+", value):
        return value
    return "'" + value.replace("\\", "\\\\").replace("'", "\\'") + "'"


def _unquoted(value: str) -> str:
    return re.sub(r"\\(.)", r"\1", value[1:-1]) if value.startswith("'") else value
