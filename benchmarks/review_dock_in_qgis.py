"""The eyes of ``benchmarks/review_dock.py`` in QGIS Desktop, which runs this by ``--code``: they look, and press nothing.

A socket takes a question a line – a function of this file and its arguments, as JSON – and answers in a line. Places are those
of the screen, in pixels.
"""

from __future__ import annotations

import json
import os
import time
import traceback
from pathlib import Path
from typing import Any

import qgis.utils
from qgis.core import QgsProject, QgsVectorLayer
from qgis.PyQt.QtCore import QRect, Qt, QTimer
from qgis.PyQt.QtNetwork import QLocalServer, QLocalSocket
from qgis.PyQt.QtWidgets import QAbstractButton, QApplication, QDockWidget, QLabel, QLineEdit, QMenu, QWidget
from qgis.utils import iface

NAME = "tunneldb_review"
WINDOW = (1600, 1000)


def install(archive: str) -> bool:
    """Install a plugin from its zip, as the button of the plugin manager does; whether it runs."""
    import pyplugin_installer

    pyplugin_installer.instance().installFromZipFile(archive)
    return NAME in qgis.utils.active_plugins


def tidy() -> None:
    """Lay the window out as a user would."""
    window = iface.mainWindow()
    window.setGeometry(0, 0, *WINDOW)
    docks = {dock.objectName(): dock for dock in window.findChildren(QDockWidget)}
    for name, dock in docks.items():
        if name in ("Browser", "Browser2") or dock.windowTitle() in ("3D", "Unrolled"):
            dock.hide()
    window.resizeDocks([docks["Layers"]], [300], Qt.Horizontal)


def theme(name: str) -> None:
    """Show the layers of a theme."""
    root, tree = QgsProject.instance().layerTreeRoot(), iface.layerTreeView().layerTreeModel()
    QgsProject.instance().mapThemeCollection().applyTheme(name, root, tree)


def state() -> dict[str, Any]:
    """Return the contents of the window and the dock."""
    modal, focus, active = QApplication.activeModalWidget(), QApplication.focusWidget(), QApplication.activeWindow()
    seen: dict[str, Any] = {
        "project": QgsProject.instance().fileName(),
        "drawing": any(canvas.isDrawing() for canvas in iface.mapCanvases()),
        "modal": modal.windowTitle() if modal is not None else None,
        "window": active.windowTitle() if active is not None else None,
        "focus": focus.objectName() if focus is not None else None,
        "text": focus.text() if isinstance(focus, QLineEdit) else None,
        "popup": QApplication.activePopupWidget() is not None,
    }
    plugin = qgis.utils.plugins.get(NAME)
    dock = plugin.dock if plugin is not None else None
    if dock is not None and dock.isVisible() and dock.session is not None:
        work = dock.session.work
        seen["drawing"] |= dock.lingering.isActive()
        seen |= {
            "dock": True, "current": work.current.id if work.current is not None else None, "listed": len(work.findings),
            "settled": dock.settled(), "pictures": sum(view.image is not None for view in dock.views.values()),
            "message": dock.message.text(), "told": dock.told.text(), "reviewed": work.reviewed,
            "keys": dock.widget().isAncestorOf(focus) if focus is not None else False,
        }  # fmt: skip
    return seen


def order() -> list[int]:
    """The findings of the dock that are open, in their order."""
    findings = qgis.utils.plugins[NAME].dock.session.work.findings
    return [finding.id for finding in findings if finding.review == "open"]


def widget(name: str, last: bool = False) -> list[int] | None:
    """The middle of a visible widget of this name, title, text or tool tip; of several in a window the first or the last."""
    for top in QApplication.topLevelWidgets():
        found = [each for each in (top, *top.findChildren(QWidget)) if name in _names(each) and each.isVisible()]
        if found:
            return _middle(found[-1 if last else 0], found[-1 if last else 0].rect())
    return None


def frame(title: str) -> list[int]:
    """The box of a window with what the window manager draws about it: left, top, width, height."""
    (window,) = [top for top in QApplication.topLevelWidgets() if top.isVisible() and top.windowTitle() == title]
    box = window.frameGeometry()
    return [box.x(), box.y(), box.width(), box.height()]


def menu(text: str) -> list[int] | None:
    """The middle of an entry of the menu bar or of an open menu."""
    bar = iface.mainWindow().menuBar()
    menus = [m for m in QApplication.topLevelWidgets() if isinstance(m, QMenu) and m.isVisible()]
    for held in (*reversed(menus), bar):
        for action in held.actions():
            if action.text().replace("&", "") == text and action.isVisible():
                return _middle(held, held.actionGeometry(action))
    return None


def layer(layer_id: str) -> list[int] | None:
    """The middle of a layer in the layer tree."""
    view = iface.layerTreeView()
    node = QgsProject.instance().layerTreeRoot().findLayer(f"tunneldb_layer_{layer_id}")
    if node is None:
        return None
    index = view.node2index(node)
    view.scrollTo(index)
    return _middle(view.viewport(), view.visualRect(index))


def edits(layer_id: str) -> dict[str, Any]:
    """Return True if a layer is open for editing, and True if it has unsaved edits."""
    found = QgsProject.instance().mapLayer(f"tunneldb_layer_{layer_id}")
    assert isinstance(found, QgsVectorLayer)
    return {"editable": found.isEditable(), "modified": found.isModified(), "features": found.featureCount()}


def cpu() -> float:
    """Seconds of the processor that QGIS has taken."""
    return time.process_time()


def grab(path: str) -> None:
    """Take a picture of the whole screen."""
    QApplication.primaryScreen().grabWindow(0).save(path)


def leave() -> None:
    """End QGIS without its questions."""
    QTimer.singleShot(100, lambda: os._exit(0))


def _names(of: QWidget) -> set[str]:
    names = {of.objectName(), of.windowTitle()}
    return names | {of.text().replace("&", ""), of.toolTip()} if isinstance(of, (QAbstractButton, QLabel)) else names


def _middle(of: QWidget, box: QRect) -> list[int]:
    point = of.mapToGlobal(box.center())
    return [point.x(), point.y()]


ASKED = {
    question.__name__: question
    for question in (
        install, tidy, theme, state, order, widget, frame, menu, layer, edits, cpu, grab, leave,
    )
}  # fmt: skip


def answer(socket: QLocalSocket) -> None:
    """Answer the questions that came."""
    while socket.canReadLine():
        name, *arguments = json.loads(bytes(socket.readLine()))
        try:
            told = {"is": ASKED[name](*arguments)}
        except Exception:
            told = {"wrong": traceback.format_exc()}
        socket.write(json.dumps(told).encode() + b"\n")
        socket.flush()


def listen() -> QLocalServer:
    """Take questions at the socket."""
    server = QLocalServer()
    path = str(Path(os.environ["REVIEW_SOCKET"]))
    QLocalServer.removeServer(path)
    assert server.listen(path), server.errorString()

    def met() -> None:
        socket = server.nextPendingConnection()
        socket.readyRead.connect(lambda: answer(socket))
        answer(socket)

    server.newConnection.connect(met)
    return server


SERVER = listen()
