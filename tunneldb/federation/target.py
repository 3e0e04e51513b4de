"""Connection string of a server as options of postgres_fdw; without a password, which is nowhere stored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import psycopg
from psycopg.conninfo import conninfo_to_dict

from tunneldb.database.failures import first_line
from tunneldb.errors import UserError

SECRETS = ("password", "sslpassword")
"""Parameters of libpq that are refused."""

_OF_THE_WRAPPER = ("client_encoding", "fallback_application_name")
"""Parameters of libpq that postgres_fdw sets itself."""

DEFAULTS = {"connect_timeout": "3", "keepalives_idle": "10", "keepalives_interval": "5", "keepalives_count": "3",
            "tcp_user_timeout": "25000", "application_name": "tunneldb: hub"}  # fmt: skip
"""Parameters of libpq unless the connection string states others: a lost server is noticed within 25 s."""

PLANNING = {
    "updatable": "false",
    "truncatable": "false",
    "async_capable": "true",
    "extensions": "postgis",
    "fetch_size": "1000",
    "use_remote_estimate": "false",
    "fdw_tuple_cost": "1",
}
"""Options of postgres_fdw: read only, all servers at once, functions of PostGIS are sent. Estimates of the servers take longer
than most queries. Without them the planner expects few rows; a high cost of each makes it group and join on the servers."""


@dataclass(frozen=True)
class Target:
    """Server to connect to.

    Attributes
    ----------
    options
        Options of the foreign server.
    user
        Login on the server.
    """

    options: Mapping[str, str]
    user: str


def parse_target(name: str, dsn: str) -> Target:
    """Return the options of a server from its connection string.

    Raises
    ------
    UserError
        If the string is not valid, has a password, or names no user or database. The message does not repeat the string.
    """
    try:
        given = {key: str(value) for key, value in conninfo_to_dict(dsn).items() if value is not None}
    except psycopg.ProgrammingError as error:
        raise UserError(f"the DSN of {name} is not valid for libpq: {_reason(first_line(error))}") from None
    if secret := next((key for key in SECRETS if key in given), None):
        raise UserError(
            f"the DSN of {name} has a {secret}, which is not stored: use a password file of the operating-system user of the"
            " hub's PostgreSQL (passfile=/path, mode 0600), or certificates"
        )
    user = given.pop("user", None)
    if not user:
        raise UserError(f"the DSN of {name} names no user: add user=…, a login with the role tunnel_viewer there")
    if not given.get("dbname") and "service" not in given:
        raise UserError(f"the DSN of {name} names no database: add dbname=…")
    options = DEFAULTS | {key: value for key, value in given.items() if key not in _OF_THE_WRAPPER} | PLANNING
    options["options"] = f"{given.get('options', '')} -c tunneldb.server={name}".strip()
    return Target(options, user)


def _reason(message: str) -> str:
    """Return libpq's message without the part of the string that it quotes, which may be a password."""
    return 'a word without "="' if message.startswith('missing "="') else message.split('"', 1)[0].rstrip(" :")
