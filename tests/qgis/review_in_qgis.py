"""The plugin in real QGIS without a screen; runs under the Python that has PyQGIS, says what it saw as JSON.

Usage: review_in_qgis.py PROJECT PLUGINS COMMAND FOLDER     # PLUGINS holds the unpacked zip, COMMAND is the program tunneldb
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import time
from pathlib import Path
from typing import Any

import qgis.utils
from qgis.core import (
    QgsApplication,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProject,
    QgsRasterLayer,
    QgsRectangle,
    QgsSettings,
)
from qgis.gui import QgsGui, QgsMapCanvas, QgsMessageBar
from qgis.PyQt.QtCore import QCoreApplication, Qt
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QMainWindow

NAME = "tunneldb_review"


class Desktop:
    """As much of QGIS's window as a plugin takes hold of."""

    def __init__(self) -> None:
        self.window, self.canvas = QMainWindow(), QgsMapCanvas()
        self.bar = QgsMessageBar(self.window)  # a window of its own would take the keys
        self.window.setCentralWidget(self.canvas)
        self.window.resize(1400, 900)
        self.actions: list[str] = []

    def mainWindow(self) -> QMainWindow:  # noqa: N802
        return self.window

    def mapCanvases(self) -> list[QgsMapCanvas]:  # noqa: N802
        return [self.canvas]

    def messageBar(self) -> QgsMessageBar:  # noqa: N802
        return self.bar

    def addDockWidget(self, area: Any, dock: Any) -> None:  # noqa: N802
        self.window.addDockWidget(area, dock)

    def removeDockWidget(self, dock: Any) -> None:  # noqa: N802
        self.window.removeDockWidget(dock)

    def addPluginToDatabaseMenu(self, title: str, action: Any) -> None:  # noqa: N802
        self.actions.append(action.text())

    def addToolBarIcon(self, action: Any) -> None:  # noqa: N802
        pass

    def removePluginDatabaseMenu(self, title: str, action: Any) -> None:  # noqa: N802
        self.actions.remove(action.text())

    def removeToolBarIcon(self, action: Any) -> None:  # noqa: N802
        pass


def load(plugins: str) -> dict[str, Any]:
    """Load the plugin as QGIS does, by its metadata."""
    qgis.utils.iface = Desktop()
    qgis.utils.plugin_paths = [plugins]
    sys.path.insert(0, plugins)
    qgis.utils.updateAvailablePlugins()
    assert qgis.utils.loadPlugin(NAME), "it cannot be loaded"
    assert qgis.utils.startPlugin(NAME), "it cannot be started"
    return {
        "version": qgis.utils.pluginMetadata(NAME, "version"),
        "menu": list(qgis.utils.iface.actions),
        "algorithms": sorted(a.id() for a in QgsApplication.processingRegistry().providerById("tunneldb").algorithms()),
    }


def press(dock: Any, *keys: Any) -> None:
    """Press keys with the dock in focus, and wait until the pictures are there."""
    for key in keys:
        QTest.keyClick(dock.widget(), key)
        wait(dock)


def wait(dock: Any) -> None:
    """Wait until the pictures are there and the canvas is drawn."""
    canvas = qgis.utils.iface.canvas
    until = time.monotonic() + 20
    QCoreApplication.processEvents()
    while (not dock.settled() or dock.lingering.isActive() or canvas.isDrawing()) and time.monotonic() < until:
        QCoreApplication.processEvents()


def at(dock: Any) -> int | None:
    """The number of the finding that the dock is at."""
    current = dock.session.work.current
    return None if current is None else current.id


def pictures(dock: Any) -> dict[str, bool]:
    """Return for each kind of image whether it is shown."""
    return {kind: view.image is not None and not view.missing for kind, view in dock.views.items()}


def review(dock: Any) -> dict[str, Any]:
    """Step, confirm, reject, name, remark and take back by keys."""
    window = qgis.utils.iface.window
    seen: dict[str, Any] = {"order": [finding.id for finding in dock.session.work.findings], "first": at(dock)}
    seen["pictures"] = pictures(dock)
    box = dock.session.work.current
    box = QgsRectangle(box.chainage_from, box.arc_from, box.chainage_to, box.arc_to)
    seen["followed"] = qgis.utils.iface.canvas.extent().contains(box) and qgis.utils.iface.canvas.extent().width() < 100
    press(dock, Qt.Key_N)
    seen["next"] = at(dock)
    press(dock, Qt.Key_P)
    seen["previous"] = at(dock)
    press(dock, Qt.Key_C)
    seen["after_confirm"] = at(dock)
    press(dock, Qt.Key_R)
    seen["rejected"] = seen["after_confirm"]
    seen["renamed"] = at(dock)
    dock.set_kind("efflorescence")
    press(dock, Qt.Key_M)
    QTest.keyClicks(dock.panel.remark, "it's a \\ 'trap'; no CR")
    QTest.keyClick(dock.panel.remark, Qt.Key_Return)
    seen["focus_back"] = not dock.panel.remark.hasFocus()
    press(dock, Qt.Key_C)
    seen["undone"] = at(dock)
    press(dock, Qt.Key_C)
    seen["said_before"] = dock.message.text()
    press(dock, Qt.Key_Z)
    seen["said"] = dock.message.text()
    seen["after_undo"] = at(dock)
    seen["progress"], seen["coverage"] = dock.told.text(), [dock.coverage.text()]
    dock.filters.km_from.setValue(13)
    seen["coverage"].append(dock.coverage.text())
    dock.filters.km_from.setValue(dock.filters.km_from.minimum())
    dock.filters.open_only.setChecked(False)
    dock.filters.min_area.setValue(1.0)
    seen["large"] = [finding.id for finding in dock.session.work.findings]
    wait(dock)
    window.grab().save(str(FOLDER / "dock.png"))
    return seen


def images_again(plugin: Any) -> dict[str, Any]:
    """Another image is put in a file's place; the layer shows it once the button was pressed."""
    layer = next(
        layer for layer in QgsProject.instance().mapLayers().values()
        if isinstance(layer, QgsRasterLayer) and layer.source().endswith("-raw.tif")
    )  # fmt: skip
    path = Path(layer.source())
    before = layer.dataProvider().bandStatistics(1).maximumValue
    other = Path(str(path).replace("-raw.tif", "-offset.tif"))
    renderer = layer.renderer().type()
    shutil.copy(other, FOLDER / "new.tif")
    (FOLDER / "new.tif").replace(path)
    changed = plugin.reloader.reload()
    again = plugin.reloader.reload()
    after = layer.dataProvider().bandStatistics(1).maximumValue
    offset = QgsRasterLayer(str(other), "", "gdal")
    wanted = offset.dataProvider().bandStatistics(1).maximumValue
    return {
        "changed": changed, "again": again, "new": after == wanted != before,
        "drawn_as_before": layer.renderer().type() == renderer,
    }  # fmt: skip


def process(name: str, parameters: dict[str, Any]) -> dict[str, Any]:
    """Run an algorithm."""
    algorithm = QgsApplication.processingRegistry().createAlgorithmById(f"tunneldb:{name}")
    context, feedback = QgsProcessingContext(), QgsProcessingFeedback(False)
    context.setProject(QgsProject.instance())
    context.setFeedback(feedback)
    checked, why = algorithm.checkParameterValues(parameters, context)
    assert checked, why
    try:
        results, _ = algorithm.run(parameters, context, feedback, {}, False)
    except QgsProcessingException as error:
        return {"error": str(error)}
    loaded = [details.name for details in context.layersToLoadOnCompletion().values()]
    return {**results, "loaded": sorted(loaded), "log": feedback.textLog()}


def main() -> None:
    """Do all of it."""
    application = QgsApplication([], True)
    application.initQgis()
    QgsGui.editorWidgetRegistry().initEditors()
    QCoreApplication.setOrganizationName("tunneldb-test")
    project, plugins, command = sys.argv[1:4]
    settings = QgsSettings()
    settings.setValue("tunneldb_review/command", command)
    assert QgsProject.instance().read(project)
    seen: dict[str, Any] = {"loaded": load(plugins)}
    plugin = qgis.utils.plugins[NAME]
    theme = QgsProject.instance().mapThemeCollection().mapThemeVisibleLayers("Unrolled")
    qgis.utils.iface.canvas.setLayers(theme)
    window = qgis.utils.iface.window
    window.show()
    window.activateWindow()
    assert QTest.qWaitForWindowActive(window)
    plugin.review()
    wait(plugin.dock)
    seen["connected"] = plugin.dock.message.text()
    if len(sys.argv) > 5:
        seen["pictures"] = pictures(plugin.dock)
        press(plugin.dock, Qt.Key_C)
        seen["refused"] = plugin.dock.message.text()
    else:
        press(plugin.dock, Qt.Key_H, Qt.Key_H)
        seen["review"] = review(plugin.dock)
        seen["images"] = images_again(plugin)
        settings.setValue("tunneldb_review/way", "service")
        settings.setValue("tunneldb_review/service", "owner")
        seen["leaks"] = process("leaks", {"SURVEY": "demo-2024", "OUTPUT": str(FOLDER / "leaks.gpkg"), "LOAD": True})
        seen["wrong"] = process("leaks", {"SURVEY": "nowhere-2024", "LOAD": False})
    qgis.utils.unloadPlugin(NAME)
    seen["left"] = list(qgis.utils.iface.actions)
    seen["settings"] = {key: str(settings.value(key)) for key in settings.allKeys() if key.startswith("tunneldb_review/")}
    print(json.dumps(seen))
    sys.stdout.flush()
    os._exit(0)  # QGIS's own end is not what is tested


FOLDER = Path(sys.argv[4]) if len(sys.argv) > 4 else Path()
if __name__ == "__main__":
    main()
