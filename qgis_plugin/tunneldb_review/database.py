"""The database through QGIS's own PostgreSQL provider, so that services, .pgpass and its authentication manager hold."""

from __future__ import annotations

from typing import Any, Dict, List

from qgis.core import (
    NULL,
    QgsDataSourceUri,
    QgsException,
    QgsFeatureRequest,
    QgsProviderConnectionException,
    QgsProviderRegistry,
    QgsVectorDataProvider,
    QgsVectorLayer,
)

from . import sql
from .connection import Connection


class DatabaseError(Exception):
    """What the database or QGIS refused, in one line."""


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
        self._layer: QgsVectorLayer | None = None
        ((self.person, self.may_review, self.may_undo),) = self.rows(sql.PERSON)

    def rows(self, query: str) -> List[List[Any]]:
        """Return the rows of a query of :mod:`.sql`, with None for NULL."""
        try:
            rows = self._server.executeSql(query)
        except (QgsProviderConnectionException, QgsException) as error:  # the second where it cannot connect
            raise DatabaseError(_explained(sql.error_line(str(error)))) from None
        return [[_plain(value) for value in row] for row in rows]

    def review(self, finding_id: int, seen: Dict[str, Any], values: Dict[str, Any]) -> None:
        """Write the review, the kind or the remark of a finding.

        Parameters
        ----------
        finding_id : int
        seen : dict
            What the person saw of these columns.
        values : dict
            What they are to be; all in one step, which :meth:`undo` takes back as one.

        Raises
        ------
        DatabaseError
            It is gone, somebody else has changed it meanwhile, or the database refuses.
        """
        layer = self._reviews()
        provider = layer.dataProvider()
        request = QgsFeatureRequest().setFilterExpression(f'"id" = {int(finding_id)}')
        request.setFlags(QgsFeatureRequest.NoGeometry)
        feature = next(layer.getFeatures(request), None)
        if feature is None:
            raise DatabaseError(f"finding {finding_id} is gone")
        for name, value in values.items():
            now = _plain(feature[name])
            if now not in (seen[name], value):
                raise DatabaseError(
                    f"finding {finding_id} was changed meanwhile: its {name} is {now or 'empty'}; look at it again"
                )
        fields = layer.fields()
        provider.clearErrors()
        changes = {fields.indexOf(name): NULL if value is None else value for name, value in values.items()}
        if not provider.changeAttributeValues({feature.id(): changes}):
            raise DatabaseError(sql.error_line("\n".join(provider.errors())))

    def undo(self, finding_id: int) -> str:
        """Take back the last change of a finding, and return what that was, as "reviewed"."""
        return str(self.rows(sql.undo(finding_id))[0][0])

    def _reviews(self) -> QgsVectorLayer:
        """The view through which reviews are written, as a layer of its own that no project holds."""
        if self._layer is None:
            uri = QgsDataSourceUri(self._uri)
            uri.setDataSource("tunnel_api", sql.VIEW, "", "", "id")
            uri.setUseEstimatedMetadata(True)
            uri.setParam("checkPrimaryKeyUnicity", "0")
            layer = QgsVectorLayer(uri.uri(False), sql.VIEW, "postgres")
            if not layer.isValid():
                raise DatabaseError(sql.error_line(layer.error().summary()))
            if not layer.dataProvider().capabilities() & QgsVectorDataProvider.ChangeAttributeValues:
                raise DatabaseError(f"{self.person} may look, but not review: an operator grants tunnel_inspector")
            self._layer = layer
        return self._layer


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
    """Name what is missing, where the server speaks of tables alone."""
    if "tunnel_api" in line and ("does not exist" in line or "permission denied" in line):
        return f"that is no database of tunneldb for you ({line}): tunneldb init, and a role of tunnel_inspector"
    return line
