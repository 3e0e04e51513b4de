"""Data source of a project's layers, and the QGIS action that recomputes results after an edit of the axis."""

from __future__ import annotations

import getpass
import sys
import uuid
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import psycopg

from tunneldb.errors import UserError
from tunneldb.export.qgis.layer import VectorLayer
from tunneldb.store.survey import Survey


def quote(value: str) -> str:
    """Quote a value of a data source string."""
    return "'" + value.replace("\\", "\\\\").replace("'", "\\'") + "'"


def literal(value: str) -> str:
    """Return a text as an SQL literal."""
    return "'" + value.replace("'", "''") + "'"


@dataclass(frozen=True)
class Source:
    """Connection of QGIS to the database.

    Attributes
    ----------
    connection : str
        The part of a data source string that names server and database.
    """

    connection: str

    @classmethod
    def of_service(cls, name: str) -> Source:
        """Connect by an entry of the user's ``pg_service.conf``."""
        return cls(f"service={quote(name)}")

    @classmethod
    def of_connection(cls, conn: psycopg.Connection) -> Source:
        """Make the connection of ``conn``; as the user who opens the project, unless ``conn`` names another user.

        Raises
        ------
        UserError
            QGIS can't use the server's address.
        """
        info = conn.info
        if set(" '\\") & set(info.host):
            raise UserError(
                f"QGIS cannot connect to a socket in {info.host!r}, because it does not quote the path; give an entry of"
                " pg_service.conf with --service"
            )
        parts = [f"dbname={quote(info.dbname)}", f"host={quote(info.host)}", f"port={info.port}"]
        if info.user != getpass.getuser():
            parts.append(f"user={quote(info.user)}")
        mode = info.get_parameters().get("sslmode")
        if mode is not None:
            parts.append(f"sslmode={mode}")
        return cls(" ".join(parts))

    def layer(self, layer: VectorLayer, survey: Survey) -> str:
        """Return the data source of a layer, restricted to a survey or to its tunnel.

        Key, SRID and type are stated and statistics trusted, so that QGIS doesn't scan the view to find them out.
        """
        rows = f'"tunnel" = {literal(survey.tunnel)}' if layer.of_tunnel else f'"survey" = {literal(survey.name)}'
        return (
            f"{self.connection} key='id' estimatedmetadata=true srid={survey.srid if layer.on_map else 0} type={layer.wkb} "
            f'checkPrimaryKeyUnicity=\'0\' table="tunnel_api"."{layer.view}" ({layer.column}) '
            f"sql={rows}{' AND ' + layer.where if layer.where else ''}"
        )

    def table(self, view: str, survey: str | None) -> str:
        """Return the data source of a view without geometry, of a survey or of all; its rows are counted, not estimated."""
        name = "" if survey is None else f'"survey" = {literal(survey)}'
        return (
            f"{self.connection} key='id' estimatedmetadata=false checkPrimaryKeyUnicity='0' "
            f'table="tunnel_api"."{view}" sql={name}'
        )


RECOMPUTED_FROM = ("axis_vertex", "segment")
"""Layers with this action."""


def recompute(survey: Survey, source: Source) -> ET.Element:
    """Return the element ``attributeactions`` of a layer: it runs ``tunneldb run --stale`` and shows its output.

    It runs the program that writes the project, on the database that the project reads, as whoever uses QGIS.
    """
    beside = Path(sys.executable).with_name("tunneldb")
    program = str(beside) if beside.exists() else "tunneldb"
    key = f"{{{uuid.uuid5(uuid.NAMESPACE_OID, 'tunneldb recompute')}}}"
    actions = ET.Element("attributeactions")
    action = ET.SubElement(
        actions, "actionsetting", id=key, name=f"Recompute what is stale of {survey.name}", shortTitle="Recompute", type="0",
        action=f'"{program}" --dsn "{source.connection}" run {survey.name} --stale', capture="1", icon="",
        notificationMessage="", isEnabledOnlyWhenEditable="0",
    )  # fmt: skip
    for scope in ("Canvas", "Feature", "Layer"):
        ET.SubElement(action, "actionScope", id=scope)
    return actions
