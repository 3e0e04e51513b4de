"""The action by which QGIS has recomputed what an edit of the axis made stale."""

from __future__ import annotations

import sys
import uuid
import xml.etree.ElementTree as ET
from pathlib import Path

from tunneldb.export.qgis.source import Source
from tunneldb.store.survey import Survey

RECOMPUTED_FROM = ("axis_vertex", "segment")
"""Layers that offer it."""


def recompute(survey: Survey, source: Source) -> ET.Element:
    """Return the element ``attributeactions`` of a layer: it runs ``tunneldb run --stale`` and shows what that says.

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
