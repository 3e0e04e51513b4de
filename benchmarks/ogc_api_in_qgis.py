"""What QGIS finds at a server of OGC API Features, run by QGIS's own Python: ``ogc_api_in_qgis.py URL`` prints it as JSON."""

from __future__ import annotations

import json
import sys
from urllib.request import urlopen

from qgis.core import (
    Qgis,
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsProject,
    QgsVectorDataProvider,
    QgsVectorLayer,
    QgsVectorTileLayer,
)
from qgis.PyQt.QtCore import QSize
from qgis.PyQt.QtGui import QColor

WRITES = (
    QgsVectorDataProvider.AddFeatures | QgsVectorDataProvider.DeleteFeatures | QgsVectorDataProvider.ChangeAttributeValues
    | QgsVectorDataProvider.ChangeGeometries
)  # fmt: skip


def features(url, name):
    """Open a collection as a layer, and count its features."""
    layer = QgsVectorLayer(f"url='{url}' typename='{name}' pageSize='1000'", name, "OAPIF")
    found = {"valid": layer.isValid(), "rows": sum(1 for _ in layer.getFeatures()), "crs": layer.crs().authid()}
    return layer, found | {"writes": bool(layer.dataProvider().capabilities() & WRITES)}


def pixels(url, name, layer):
    """Draw the vector tiles where a layer lies: how many pixels aren't background."""
    source = f"{url}/collections/{name}/tiles/WebMercatorQuad/%7Bz%7D/%7Bx%7D/%7By%7D"
    tiles = QgsVectorTileLayer(f"type=xyz&url={source}&zmin=0&zmax=22", name)
    mercator = QgsCoordinateReferenceSystem("EPSG:3857")
    extent = QgsCoordinateTransform(layer.crs(), mercator, QgsProject.instance()).transformBoundingBox(layer.extent())
    settings = QgsMapSettings()
    settings.setLayers([tiles])
    settings.setDestinationCrs(mercator)
    settings.setExtent(extent.buffered(10.0))
    settings.setOutputSize(QSize(600, 400))
    settings.setBackgroundColor(QColor("white"))
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    image = job.renderedImage()
    return sum(image.pixelColor(x, y) != QColor("white") for x in range(600) for y in range(400))


def found(url):
    """Return the contents of each collection."""
    with urlopen(f"{url}/collections?f=json&limit=100") as answer:
        names = [collection["id"] for collection in json.load(answer)["collections"]]
    collections = {}
    for name in names:
        layer, collections[name] = features(url, name)
        if collections[name]["rows"] and "leak" in name:
            collections[name]["pixels"] = pixels(url, name, layer)
    return {"version": Qgis.QGIS_VERSION, "collections": collections}


if __name__ == "__main__":
    application = QgsApplication([], False)  # must outlive all layers
    application.initQgis()
    print(json.dumps(found(sys.argv[1])), flush=True)
    application.exitQgis()
