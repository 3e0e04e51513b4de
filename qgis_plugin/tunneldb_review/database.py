"""Database access through QGIS's PostgreSQL provider, so that services, .pgpass and its authentication manager apply."""

from __future__ import annotations

from typing import Any, List, Mapping

from qgis.core import NULL, QgsDataSourceUri, QgsException, QgsProviderConnectionException, QgsProviderRegistry

from . import sql
from .connection import Connection

LOST = "No connection to the database. Nothing is lost: press the same key to try again."
NOT_WRITTEN = "No connection to the database. This was not written; repeat it when the server is back."


class DatabaseError(Exception):
    """Refusal by the database or QGIS, in one line."""


class ConnectionLostError(DatabaseError):
    """Server not reachable; the request was not done.

    Parameters
    ----------
    said : str
        What that means to the user.
    reason : str
        What the server or QGIS says of it.
    """

    def __init__(self, said: str, reason: str) -> None:
        super().__init__(said)
        self.reason = reason


class ChangedMeanwhileError(DatabaseError):
    """Somebody else has changed a finding since it was read.

    Parameters
    ----------
    finding_id : int
    now : mapping
        Facts of it as they are now.
    """

    def __init__(self, finding_id: int, now: Mapping[str, Any]) -> None:
        remark = f", remark “{now['remark']}”" if now["remark"] else ""
        super().__init__(
            f"{now['reviewed_by'] or 'Somebody'} has changed finding {finding_id} in the meantime: it is {now['review']},"
            f" {now['kind_label'] or now['kind']}{remark}. Nothing was written; enter your review again."
        )


class Database:
    """A connected database of tunneldb.

    Parameters
    ----------
    connection : Connection

    Raises
    ------
    DatabaseError
        It can't be reached, or holds no tunneldb.
    """

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self._uri = _uri(connection)
        self._server = QgsProviderRegistry.instance().providerMetadata("postgres").createConnection(self._uri.uri(False), {})
        try:
            ((self.person, self.may_review, self.may_undo),) = self.rows(sql.PERSON)
        except ConnectionLostError as error:
            raise DatabaseError(f"{error.reason}: check that the server runs and that you may log in") from None

    def rows(self, query: str) -> List[List[Any]]:
        """Return the rows of a query of :mod:`.sql`, with None for NULL.

        QGIS connects anew by itself where the connection was cut, so that only a server that is away is an error.
        """
        try:
            rows = self._server.executeSql(query)
        except (QgsProviderConnectionException, QgsException) as error:  # the second where it cannot connect
            if sql.is_lost(str(error)):
                raise ConnectionLostError(LOST, sql.error_line(str(error))) from None
            raise DatabaseError(_explained(sql.error_line(str(error)))) from None
        return [[_plain(value) for value in row] for row in rows]

    def review(self, finding_id: int, seen: Mapping[str, Any], values: Mapping[str, Any]) -> bool:
        """Write the review, the kind or the remark of a finding; return False, without writing, if it is already so.

        Parameters
        ----------
        finding_id : int
        seen : mapping
            What the person saw of all three.
        values : mapping
            What some are to be; all in one step, which :meth:`undo` takes back as one.

        Raises
        ------
        ChangedMeanwhileError
            Somebody else has changed one of the three since: nothing is written.
        DatabaseError
            It is gone, the person may not, or the database refuses.
        """
        if not self.may_review:
            raise DatabaseError(f"{self.person} may look, but not review: an operator must grant the role tunnel_inspector")
        try:
            if self.rows(sql.review(finding_id, seen, values)):
                return True
            rows = self.rows(sql.facts(finding_id))
        except ConnectionLostError as error:
            raise ConnectionLostError(NOT_WRITTEN, error.reason) from None
        if not rows:
            raise DatabaseError(f"finding {finding_id} does not exist any more")
        now = sql.told(rows[0])
        if any(now[name] != value for name, value in values.items()):
            raise ChangedMeanwhileError(finding_id, now)
        return False

    def undo(self, finding_id: int) -> str:
        """Undo the last change of a finding, and return its columns, as "reviewed"."""
        return str(self.rows(sql.undo(finding_id))[0][0])


def _uri(connection: Connection) -> QgsDataSourceUri:
    words = connection.words
    uri = QgsDataSourceUri()
    mode = QgsDataSourceUri.decodeSslMode(words.get("sslmode", "prefer"))
    if words.get("service"):
        uri.setConnection(words["service"], words.get("dbname", ""), words.get("user", ""), "", mode, connection.authcfg)
    else:
        uri.setConnection(
            words.get("host", ""), words.get("port", ""), words["dbname"], words.get("user", ""), "", mode, connection.authcfg
        )
    return uri


def _plain(value: Any) -> Any:
    return None if value == NULL else value


def _explained(line: str) -> str:
    """Name what is missing, if the server names only tables."""
    if "tunnel_api" in line and ("does not exist" in line or "permission denied" in line):
        return f"no tunneldb database for you ({line}): run tunneldb init, and have the role tunnel_inspector granted"
    return line
