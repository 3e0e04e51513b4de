"""What the tutorial does in QGIS, done in QGIS Desktop, with pictures of it; ``docs/tutorial_pictures.py`` calls it.

Runs as ``qgis --project demo.qgz --code in_qgis.py`` with the name of a step in ``TUTORIAL_STEP`` and the picture's path in
``TUTORIAL_PICTURE``. A step is a generator: at each ``yield`` QGIS goes on until nothing is being drawn.
"""

from __future__ import annotations

import os
import traceback
from collections.abc import Iterator
from typing import Any

from osgeo import gdal
from qgis.core import QgsGeometry, QgsLayoutExporter, QgsProject, QgsRectangle, QgsVectorLayer
from qgis.gui import QgsMapCanvas
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtWidgets import QApplication, QDockWidget
from qgis.utils import iface

POLL, SETTLED = 250, 8  # milliseconds between looks, and looks without drawing until QGIS has settled
WINDOW = (1500, 950)
VERTEX, SHIFT = 1235, 0.10  # the vertex at 12+350 and how far it is moved, m


def overview(picture: str) -> Iterator[None]:
    """Show the window with the newly opened project."""
    yield from tidy()
    grab(picture)


def review(picture: str) -> Iterator[None]:
    """Confirm the largest leak, in its form, on the unrolled lining."""
    yield from tidy()
    root, tree = QgsProject.instance().layerTreeRoot(), iface.layerTreeView().layerTreeModel()
    QgsProject.instance().mapThemeCollection().applyTheme("Unrolled", root, tree)
    layer = editable("leak_unrolled")
    iface.actionZoomToLayer().trigger()
    yield
    leak = max(layer.getFeatures(), key=lambda feature: feature["area"])
    form = iface.getFeatureForm(layer, leak)
    form.setWindowFlags(Qt.Window)
    form.attributeForm().changeAttribute("review", "confirmed")
    form.attributeForm().changeAttribute("remark", "dripping, 2 l/min")
    form.show()
    yield
    form.move(WINDOW[0] - form.width(), 90)  # it is as wide as it needs to be
    yield
    grab(picture)
    form.accept()
    save(layer)


def vertex(picture: str) -> Iterator[None]:
    """Move a vertex of the axis, and show what has become stale."""
    yield from tidy()
    layer = editable("axis_vertex")
    feature = next(feature for feature in layer.getFeatures() if feature["n"] == VERTEX)
    point = feature.geometry().constGet().clone()
    point.setY(point.y() + SHIFT)
    layer.changeGeometry(feature.id(), QgsGeometry(point))
    save(layer)
    around = QgsRectangle(point.x() - 35, point.y() - 15, point.x() + 35, point.y() + 15)
    iface.mapCanvas().setExtent(around)
    iface.mapCanvas().refreshAllLayers()
    yield
    grab(picture)


def sheets(picture: str) -> Iterator[None]:
    """Print the inspection sheets, as *Atlas › Export Atlas as PDF* does, beside the project; the picture is the first."""
    layout = QgsProject.instance().layoutManager().layoutByName("Inspection sheets")
    target = f"{QgsProject.instance().homePath()}/sheets.pdf"
    result, error = QgsLayoutExporter.exportToPdf(layout.atlas(), target, QgsLayoutExporter.PdfExportSettings())
    assert result == QgsLayoutExporter.Success, error
    gdal.Translate(picture, gdal.OpenEx(f"PDF:1:{target}", gdal.OF_RASTER, open_options=["DPI=110"]), format="PNG")
    yield


def tidy() -> Iterator[None]:
    """Lay the window out as a user would: no browser, no 3D, layers wide enough to read, half of it for the unrolled lining."""
    window = iface.mainWindow()
    window.setGeometry(0, 0, *WINDOW)
    docks = {dock.objectName(): dock for dock in window.findChildren(QDockWidget)}
    for name, dock in docks.items():
        if name in ("Browser", "Browser2") or dock.windowTitle() == "3D":
            dock.hide()
    yield
    unrolled = next(dock for dock in docks.values() if dock.windowTitle() == "Unrolled")
    window.resizeDocks([docks["Layers"]], [330], Qt.Horizontal)
    window.resizeDocks([unrolled], [360], Qt.Vertical)
    yield


def editable(layer_id: str) -> QgsVectorLayer:
    """Return a layer, selected and open for editing."""
    layer = QgsProject.instance().mapLayer(f"tunneldb_layer_{layer_id}")
    iface.setActiveLayer(layer)
    assert layer.startEditing(), layer_id
    return layer


def save(layer: QgsVectorLayer) -> None:
    """Save the edits of a layer."""
    assert layer.commitChanges(), layer.commitErrors()


def grab(picture: str) -> None:
    """Take a picture of the whole screen."""
    QApplication.processEvents()
    QApplication.primaryScreen().grabWindow(0).save(picture)


def drawing() -> bool:
    """Whether a map is being drawn."""
    return any(canvas.isDrawing() for canvas in iface.mainWindow().findChildren(QgsMapCanvas))


def go_on(step: Iterator[None], idle: int = 0) -> None:
    """Go on with a step when QGIS has settled; leave QGIS at its end."""
    if drawing() or idle < SETTLED:
        QTimer.singleShot(POLL, lambda: go_on(step, 0 if drawing() else idle + 1))
        return
    try:
        next(step)
    except StopIteration:
        leave(0)
    except Exception:
        traceback.print_exc()
        leave(1)
    go_on(step)


def leave(code: int) -> Any:
    """End QGIS without its questions."""
    os._exit(code)


STEPS = {step.__name__: step for step in (overview, review, vertex, sheets)}
go_on(STEPS[os.environ["TUTORIAL_STEP"]](os.environ["TUTORIAL_PICTURE"]))
