"""The hands of ``benchmarks/desk.py``: mouse and keys in QGIS Desktop, which runs this by ``--code``.

Buttons are clicked in the tool bars, layers in the layer tree, places on the canvas; forms are filled in by keys. What was done
is written to ``day.json``. A step is a generator: at each ``yield`` QGIS goes on until nothing is being drawn.
"""

from __future__ import annotations

import faulthandler
import json
import os
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from qgis.core import QgsPointXY, QgsProject, QgsRectangle, QgsSettings, QgsVectorLayer
from qgis.gui import QgsFileWidget, QgsMapCanvas
from qgis.PyQt.QtCore import QPoint, Qt, QTimer
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import (
    QAbstractButton,
    QAction,
    QApplication,
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QDockWidget,
    QDoubleSpinBox,
    QLineEdit,
    QToolBar,
    QToolButton,
    QWidget,
)
from qgis.utils import iface

faulthandler.enable()
POLL, SETTLED = 60, 3  # milliseconds between looks, and looks without drawing until QGIS has settled
WINDOW = (1500, 950)
STEP = os.environ["DESK_STEP"]
FOLDER, PICTURES = Path(os.environ["DESK_FOLDER"]), Path(os.environ["DESK_PICTURES"])
STRETCH = QgsRectangle(12352, -7.5, 12378, 7.5)
"""Where she draws: chainage and arc, m."""

steps: list[dict[str, Any]] = []
errors: list[str] = []

SQUARE = ((0, 0), (1.2, 0), (1.2, 0.9), (0, 0.9))
DRAWN: tuple[tuple[str, str, str, str, tuple[tuple[float, float], ...]], ...] = (
    # layer, kind as the list has it, its code, severity, where
    *(("area", "Leak", "leak", "serious", tuple((12354 + 4 * n + x, 4 + y) for x, y in SQUARE)) for n in range(2)),
    *(("area", "Spall", "spall", ("critical", "moderate")[n % 2], tuple((12354 + 3 * n + x, 1.5 + y) for x, y in SQUARE))
      for n in range(4)),
    *(("area", "Delamination", "delamination", "moderate", tuple((12354 + 3 * n + x, -1.5 + y) for x, y in SQUARE))
      for n in range(3)),
    *(("area", "Efflorescence", "efflorescence", "minor", tuple((12354 + 3 * n + x, -4 + y) for x, y in SQUARE))
      for n in range(2)),
    *(("line", "Crack", "crack", ("serious", "minor")[n % 2],
       ((12365 + 3 * n, -4.5), (12366 + 3 * n, -3), (12367 + 3 * n, -2.6))) for n in range(4)),
    ("line", "Damaged joint", "damaged_joint", "moderate", ((12368, 0.5), (12368, 5))),
    *(("point", "Drip", "drip", "serious", ((12370 + 2 * n, 2),)) for n in range(2)),
    *(("point", "Missing bolt", "missing_bolt", "critical", ((12371 + 2 * n, 5),)) for n in range(2)),
)  # fmt: skip


def day() -> Iterator[None]:
    """Run the steps of an inspector's day."""
    yield from tidy()
    layers = {shape: layer(f"finding_{shape}_unrolled") for shape in ("area", "line", "point")}
    for shape in layers:
        select_layer(layers[shape])
        press(iface.actionToggleEditing())
        press(iface.actionAddFeature())
        yield
        for _, label, code, severity, corners in (row for row in DRAWN if row[0] == shape):
            yield from draw(
                corners, {"kind": label, "severity": severity, "width_mm": "2.00" if code == "crack" else "", "remark": "seen"}
            )
            note("drawn", kind=code)
        press(iface.actionSaveActiveLayerEdits())
        press(iface.actionToggleEditing())
        yield
    areas, lines = layers["area"], layers["line"]

    # redrawn: a corner of a spall and of a crack is moved
    for shape, corner, to in ((areas, (12355.2, 2.4), (12355.8, 3.0)), (lines, (12367, -2.6), (12367.4, -1.6))):
        select_layer(shape)
        press(iface.actionToggleEditing())
        press(iface.actionVertexToolActiveLayer())
        yield
        for place in (corner, to):
            move(place)
            yield
            click(place)
            yield
        note("redrawn")
        press(iface.actionSaveActiveLayerEdits())
        press(iface.actionToggleEditing())
        yield

    # split: a delamination, by two clicks; taken back, and split again
    for step in ("split", "undone", "split"):
        choose(areas, {"split": "Split", "undone": "Undo"}[step])
        yield
        click((12354.3, -1.2))
        yield
        if step == "split":
            click((12354.6, -2.5))
            yield
            click((12354.6, 0.5))
        note(step)
        yield

    # merged again
    select_layer(areas)
    press(iface.actionSelectRectangle())
    click((12354.3, -1.2))
    click((12354.9, -1.2), modifier=Qt.ShiftModifier)
    yield
    choose(areas, "Merge")
    yield
    click((12354.9, -1.2))
    note("merged")
    yield
    grab("desk-merged.png")

    # deleted by the key, and reviewed in the form that a click opens
    select_layer(areas)
    areas.removeSelection()
    press(iface.actionToggleEditing())
    press(iface.actionSelectRectangle())
    click((12360.6, -1.2))
    yield
    press(iface.mainWindow().findChild(QAction, "mActionDeleteSelected"))
    note("deleted")
    press(iface.actionSaveActiveLayerEdits())
    yield
    press(iface.actionIdentify())
    when_asked(lambda form: fill(form, {"remark": "behind the cable"}))
    click((12354.4, 4.4))
    yield from asked()
    note("reviewed")
    press(iface.actionSaveActiveLayerEdits())
    press(iface.actionToggleEditing())
    yield

    # photographed: in the form of a drip; and the review above taken back
    choose(areas, "Undo")
    yield
    click((12354.4, 4.4))
    note("undone")
    yield
    points = layers["point"]
    select_layer(points)
    press(iface.actionToggleEditing())
    press(iface.actionIdentify())
    when_asked(photograph)
    click((12370, 2))
    yield from asked()
    note("photographed")
    yield
    grab("desk-end.png")


def look() -> Iterator[None]:
    """Check the project after opening it again."""
    yield from tidy()
    grab("desk-findings.png")


def tidy() -> Iterator[None]:
    """Lay the window out as a user would, with the theme of findings in it."""
    window = iface.mainWindow()
    window.setGeometry(0, 0, *WINDOW)
    docks = {dock.objectName(): dock for dock in window.findChildren(QDockWidget)}
    for name, dock in docks.items():
        if name in ("Browser", "Browser2") or dock.windowTitle() in ("3D", "Unrolled"):
            dock.hide()
    QgsSettings().setValue("/Map/identifyAutoFeatureForm", True)
    iface.messageBar().setVisible(True)
    yield
    window.resizeDocks([docks["Layers"]], [330], Qt.Horizontal)
    root, tree = QgsProject.instance().layerTreeRoot(), iface.layerTreeView().layerTreeModel()
    QgsProject.instance().mapThemeCollection().applyTheme("Findings", root, tree)
    iface.mapCanvas().setExtent(STRETCH)
    yield


def layer(name: str) -> QgsVectorLayer:
    return QgsProject.instance().mapLayer(f"tunneldb_layer_{name}")


def select_layer(chosen: QgsVectorLayer) -> None:
    """Click on a layer in the layer tree."""
    view = iface.layerTreeView()
    index = view.node2index(QgsProject.instance().layerTreeRoot().findLayer(chosen.id()))
    view.scrollTo(index)
    QTest.mouseClick(view.viewport(), Qt.LeftButton, Qt.NoModifier, view.visualRect(index).center())
    assert iface.activeLayer() == chosen, f"{chosen.name()} cannot be selected"


def press(action: QAction) -> None:
    """Click the button of an action; one that no tool bar shows is triggered."""
    assert action.isEnabled(), f"{action.text()} is not offered"
    for bar in iface.mainWindow().findChildren(QToolBar):
        for button in bar.findChildren(QToolButton):
            if button.defaultAction() == action and button.isVisible():
                QTest.mouseClick(button, Qt.LeftButton)
                return
    action.trigger()


def choose(chosen: QgsVectorLayer, name: str) -> None:
    """Take one of a layer's actions as the one that a click on the canvas runs."""
    select_layer(chosen)
    (action,) = [action for action in chosen.actions().actions("Canvas") if action.shortTitle() == name]
    chosen.actions().setDefaultAction("Canvas", action.id())
    press(iface.mainWindow().findChild(QAction, "mActionFeatureAction"))


def pixel(place: tuple[float, float]) -> QPoint:
    at = iface.mapCanvas().getCoordinateTransform().transform(QgsPointXY(*place))
    return QPoint(round(at.x()), round(at.y()))


def click(
    place: tuple[float, float], button: Qt.MouseButton = Qt.LeftButton, modifier: Qt.KeyboardModifier = Qt.NoModifier
) -> None:
    """Click on a place of the unrolled plane."""
    QTest.mouseClick(iface.mapCanvas().viewport(), button, modifier, pixel(place))


def move(place: tuple[float, float]) -> None:
    QTest.mouseMove(iface.mapCanvas().viewport(), pixel(place))


def draw(corners: tuple[tuple[float, float], ...], values: dict[str, str]) -> Iterator[None]:
    """Draw a finding and fill in the form that asks for it."""
    for corner in corners[:-1]:
        move(corner)
        click(corner)
    move(corners[-1])
    if len(corners) > 1:
        click(corners[-1])
        move(corners[-1])
    when_asked(lambda form: fill(form, values))
    click(corners[-1], Qt.RightButton if len(corners) > 1 else Qt.LeftButton)
    yield from asked()


waiting: list[Callable[[QWidget], None]] = []


def when_asked(answer: Callable[[QWidget], None]) -> None:
    """Have the next form answered, as soon as it is there."""
    waiting.append(answer)
    QTimer.singleShot(50, lambda: _answer(answer, 200))


def _answer(answer: Callable[[QWidget], None], patience: int) -> None:
    form = next(
        (w for w in QApplication.topLevelWidgets() if isinstance(w, QDialog) and w.isVisible() and w.findChild(QDialogButtonBox)
         and w.findChild(QWidget, "remark")), None,
    )  # fmt: skip
    if form is None:
        if patience:
            QTimer.singleShot(30, lambda: _answer(answer, patience - 1))
        else:
            errors.append("no form was shown")
            waiting.remove(answer)
        return
    try:
        answer(form)
    except Exception as error:  # of a timer nobody else would hear
        errors.append(f"{type(error).__name__}: {error}")
        traceback.print_exc()
        form.close()
    waiting.remove(answer)


def asked() -> Iterator[None]:
    """Wait until the form is answered."""
    while waiting:
        yield


def fill(form: QWidget, values: dict[str, str]) -> None:
    """Fill a form in by keys, and accept it."""
    for name, value in values.items():
        if value:
            enter(form, name, value)
    if values.get("kind") == "Spall" and not (PICTURES / "desk-form.png").exists():
        QApplication.processEvents()
        grab("desk-form.png")
    accept(form)


def enter(form: QWidget, name: str, value: str) -> None:
    field = next(w for kind in (QComboBox, QDoubleSpinBox, QLineEdit) for w in form.findChildren(kind, name))
    field.setFocus()
    if isinstance(field, QDoubleSpinBox):
        field.selectAll()
        QTest.keyClicks(field, value)
        QTest.keyClick(field, Qt.Key_Tab)
    elif isinstance(field, QComboBox):
        QTest.keyClicks(field, value)
        assert field.currentText() == value, f"{name} is {field.currentText()!r}, not {value!r}: {texts(field)}"
    else:
        field.selectAll()
        QTest.keyClicks(field, value)


def texts(box: QComboBox) -> list[str]:
    return [box.itemText(n) for n in range(box.count())]


def accept(form: QWidget) -> None:
    box = form.findChild(QDialogButtonBox)
    button = box.button(QDialogButtonBox.Ok) or box.button(QDialogButtonBox.Save)
    assert button.isEnabled(), "the form does not let itself be accepted"
    QTest.mouseClick(button, Qt.LeftButton)


def photograph(form: QWidget) -> None:
    """Add a photo in the form of a finding."""
    buttons = {button.toolTip(): button for button in form.findChildren(QAbstractButton)}
    toggle = buttons["Toggle editing mode for child layer"]
    if not toggle.isChecked():
        QTest.mouseClick(toggle, Qt.LeftButton)
    QTimer.singleShot(300, lambda: _photo(40))
    QTest.mouseClick(buttons["Add child feature"], Qt.LeftButton)
    QTest.mouseClick(buttons["Save child layer edits"], Qt.LeftButton)
    QApplication.processEvents()
    QTest.qWait(300)
    form.move(300, 60)
    form.resize(900, 760)
    QTest.qWait(300)
    grab("desk-thumbnail.png")
    accept(form)


def _photo(patience: int) -> None:
    form = next(
        (w for w in QApplication.topLevelWidgets() if isinstance(w, QDialog) and w.isVisible()
         and w.findChild(QWidget, "caption") and not w.findChild(QWidget, "remark")), None,
    )  # fmt: skip
    if form is None:
        if patience:
            QTimer.singleShot(50, lambda: _photo(patience - 1))
        else:
            errors.append("no form of a photo was shown")
        return
    try:
        line = next(w.lineEdit() for w in form.findChildren(QgsFileWidget) if w.isVisible())
        QTest.mouseClick(line, Qt.LeftButton)
        QTest.keyClicks(line, str(FOLDER / "photo-1.jpg"))
        QTest.keyClick(line, Qt.Key_Tab)
        enter(form, "caption", "drip at the bolt")
        QApplication.processEvents()
        grab("desk-photo.png")
        accept(form)
    except Exception as error:
        errors.append(f"{type(error).__name__}: {error}")
        traceback.print_exc()
        form.close()


def note(step: str, **others: Any) -> None:
    """Write down what was done, and what QGIS warned of meanwhile."""
    item = iface.messageBar().currentItem()
    said = item.text() if item is not None else ""
    failed = bool(errors)
    steps.append({"step": step, "said": "; ".join(errors) or said, **({"failed": True} if failed else {}), **others})
    errors.clear()


def grab(name: str) -> None:
    """Take a picture of the whole screen."""
    QApplication.processEvents()
    QApplication.primaryScreen().grabWindow(0).save(str(PICTURES / name))


def drawing() -> bool:
    """Return True if a map is being drawn."""
    return any(canvas.isDrawing() for canvas in iface.mainWindow().findChildren(QgsMapCanvas))


def go_on(step: Iterator[None], idle: int = 0) -> None:
    """Go on with a step when QGIS has settled; leave QGIS at its end."""
    if drawing() or idle < SETTLED:
        QTimer.singleShot(POLL, lambda: go_on(step, 0 if drawing() else idle + 1))
        return
    try:
        next(step)
    except StopIteration:
        (FOLDER / f"{STEP}.json").write_text(json.dumps(steps, indent=1))
        os._exit(0)
    except Exception:
        traceback.print_exc()
        grab("desk-failed.png")
        os._exit(1)
    QTimer.singleShot(0, lambda: go_on(step))


go_on({"day": day, "look": look}[STEP]())
