"""The form of a leak or a spot in QGIS, used as an inspector does: with mouse and keys."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from support.system import missing

from tunneldb.export.qgis import styles

STYLES = Path(styles.__file__).parent / "style"
TYPE = """
import os, sys
from qgis.core import QgsApplication, QgsFeature, QgsVectorLayer, NULL
from qgis.gui import QgsGui, QgsAttributeForm
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QLineEdit, QPlainTextEdit
application = QgsApplication([], True)
application.initQgis()
QgsGui.editorWidgetRegistry().initEditors()
fields = "field=id:integer&field=review:string&field=kind:string&field=remark:string&field=clock:double"
layer = QgsVectorLayer("Polygon?" + fields, "", "memory")
print(layer.loadNamedStyle(sys.argv[1])[1], file=sys.stderr)
feature = QgsFeature(layer.fields())
feature.setAttributes([1, "open", "leak", NULL, 4.5])
layer.dataProvider().addFeature(feature)
layer.startEditing()
form = QgsAttributeForm(layer, next(layer.getFeatures()))
form.show()
form.activateWindow()
application.processEvents()
field = form.findChild(QLineEdit, "remark") or form.findChild(QPlainTextEdit, "remark")
QTest.mouseClick(field, Qt.LeftButton)
application.processEvents()
QTest.keyClicks(field, "dripping")
form.save()
print(next(layer.getFeatures())["remark"])
shown = form.findChild(QLineEdit, "clock_text")
print(shown and shown.text(), flush=True)
os._exit(0)  # QGIS's own end is not what is tested
"""


@pytest.mark.slow
@pytest.mark.parametrize("style", ["leak", "dark", "leak_3d", "spot", "spot_3d"])
def test_a_remark_is_what_was_typed_without_the_null_that_stood_there(style: str, tmp_path: Path) -> None:
    if not Path("/usr/lib/python3/dist-packages/qgis").exists():
        missing("QGIS")
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "QT_QPA_PLATFORM": "offscreen", "LC_ALL": "C.UTF-8"}
    done = subprocess.run(
        ["/usr/bin/python3", "-c", TYPE, str(STYLES / f"{style}.qml")],
        env=os.environ | environment, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.stdout.splitlines() == ["dripping", "None" if style.startswith("spot") else "4:30"], done.stderr
