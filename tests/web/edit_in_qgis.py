"""Confirm a finding in QGIS: change its attribute, wait for a line, and save.

Arguments: connection string of libpq, id of the finding.
"""

import json
import sys

from qgis.core import QgsApplication, QgsVectorLayer

connection, key = sys.argv[1], int(sys.argv[2])
application = QgsApplication([], False)
application.initQgis()
source = f"{connection} key='id' type=Polygon table=\"tunnel_api\".\"finding_unrolled\" (geom) sql=survey = 'demo-2024'"
layer = QgsVectorLayer(source, "findings", "postgres")
(feature,) = [one for one in layer.getFeatures() if one["id"] == key]
layer.startEditing()
layer.changeAttributeValue(feature.id(), layer.fields().indexOf("review"), "confirmed")
print(json.dumps({"valid": layer.isValid(), "seen": feature["review"]}), flush=True)
sys.stdin.readline()
print(json.dumps({"saved": layer.commitChanges()}), flush=True)
application.exitQgis()
