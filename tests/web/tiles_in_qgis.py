"""Draw tiles of the desk in QGIS, as an XYZ layer; print the brightness at places.

Arguments: address of the desk, user, password, JSON list of [chainage, arc].
"""

import json
import sys
from urllib.parse import quote

from qgis.core import (
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsRasterLayer,
    QgsRectangle,
)
from qgis.PyQt.QtCore import QSize

PIXEL = 0.02

address, user, password, places = sys.argv[1:5]
points = json.loads(places)
application = QgsApplication([], False)
application.initQgis()
url = quote(f"{address}/tiles/demo-2024/corrected/{{z}}/{{x}}/{{y}}.png", safe=":/")
layer = QgsRasterLayer(f"type=xyz&url={url}&zmin=10&zmax=23&username={user}&password={quote(password)}", "lining", "wms")
west, east = min(x for x, _ in points) - 0.5, max(x for x, _ in points) + 0.5
south, north = min(y for _, y in points) - 0.5, max(y for _, y in points) + 0.5
settings = QgsMapSettings()
settings.setLayers([layer])
settings.setDestinationCrs(QgsCoordinateReferenceSystem("EPSG:3857"))
settings.setExtent(QgsRectangle(west, south, east, north))
settings.setOutputSize(QSize(round((east - west) / PIXEL), round((north - south) / PIXEL)))
job = QgsMapRendererParallelJob(settings)
job.start()
job.waitForFinished()
image = job.renderedImage()
shown = settings.visibleExtent()
grey = []
for x, y in points:
    column = int((x - shown.xMinimum()) / shown.width() * image.width())
    row = int((shown.yMaximum() - y) / shown.height() * image.height())
    colour = image.pixelColor(column, row)
    grey.append(colour.red() if colour.alpha() else None)
print(json.dumps({"valid": layer.isValid(), "errors": [e.message for e in job.errors()], "grey": grey}))
application.exitQgis()
