"""Actions of layers that QGIS has no tool for: the database splits, merges and undoes findings."""

from __future__ import annotations

import uuid
import xml.etree.ElementTree as ET

_COMMON = """
from qgis.core import Qgis, QgsProject, QgsProviderRegistry
from qgis.utils import iface

layer = QgsProject.instance().mapLayer('[% @layer_id %]')

def ask(query, said):
    if layer.isModified():
        iface.messageBar().pushMessage('Findings', 'Save the edits of this layer first.', Qgis.Warning)
        return
    server = QgsProviderRegistry.instance().providerMetadata('postgres').createConnection(layer.source(), {})
    try:
        answer = server.executeSql(query)[0][0]
    except Exception as error:
        told = str(error).split('ERROR:')[-1].split(chr(10))[0].strip()
        iface.messageBar().pushMessage('Findings', told, Qgis.Warning)
        return
    iface.messageBar().pushMessage('Findings', said.format(answer), Qgis.Success)
    for other in QgsProject.instance().mapLayers().values():
        if '"tunnel_api"."finding_' in other.source() or '"tunnel_api"."leak' in other.source():
            other.reload()
            other.triggerRepaint()
"""

_UNDO = (
    _COMMON
    + """
ask('SELECT tunnel_api.finding_undo([% "id" %])', 'Finding [% "id" %]: what was {} is taken back.')
"""
)
_MERGE = (
    _COMMON
    + """
ids = sorted(feature['id'] for feature in layer.selectedFeatures())
if len(ids) < 2:
    iface.messageBar().pushMessage('Findings', 'Select the findings that are to be one, at least two.', Qgis.Warning)
else:
    ask('SELECT tunnel_api.finding_merge(ARRAY{}::bigint[])'.format(ids), 'Merged into finding {}.')
"""
)
_SPLIT = (
    _COMMON
    + """
from qgis.gui import QgsMapToolEmitPoint

class Split(QgsMapToolEmitPoint):
    def __init__(self, canvas, former):
        super().__init__(canvas)
        self.former, self.ends = former, []

    def canvasReleaseEvent(self, event):
        at = self.toLayerCoordinates(layer, event.pos())
        self.ends.append('ST_MakePoint({!r}, {!r})'.format(at.x(), at.y()))
        if len(self.ends) == 2:
            self.canvas().setMapTool(self.former)
            line = 'ST_SetSRID(ST_MakeLine({}, {}), {})'.format(*self.ends, max(layer.crs().postgisSrid(), 0))
            ask('SELECT array_to_string(tunnel_api.finding_split([% "id" %], ' + line + '), chr(44))', 'Cut into findings {}.')

canvas = iface.mapCanvas()
iface.tunneldb_split = Split(canvas, canvas.mapTool())
canvas.setMapTool(iface.tunneldb_split)
iface.messageBar().pushMessage('Findings', 'Click on both sides of finding [% "id" %], where it is to be cut.', Qgis.Info)
"""
)

_ACTIONS = (
    ("Take back the last change", "Undo", _UNDO, ("Canvas", "Feature")),
    ("Split by a line between two clicks", "Split", _SPLIT, ("Canvas", "Feature")),
    ("Merge what is selected", "Merge", _MERGE, ("Canvas", "Layer")),
)


def finding_actions() -> ET.Element:
    """Return the element ``attributeactions`` of a layer of findings.

    Each runs a function of ``tunnel_api`` with the rights of the QGIS user, and shows its answer in one line.
    """
    root = ET.Element("attributeactions")
    for name, short, code, scopes in _ACTIONS:
        action = ET.SubElement(
            root, "actionsetting", id=f"{{{uuid.uuid5(uuid.NAMESPACE_OID, f'tunneldb {short}')}}}", name=name, shortTitle=short,
            type="1", action=code.strip(), capture="0", icon="", notificationMessage="", isEnabledOnlyWhenEditable="0",
        )  # fmt: skip
        for scope in scopes:
            ET.SubElement(action, "actionScope", id=scope)
    return root
