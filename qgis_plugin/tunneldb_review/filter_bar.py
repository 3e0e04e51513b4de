"""Selection and order of findings."""

from __future__ import annotations

from typing import List, Tuple

from qgis.gui import QgsCheckableComboBox, QgsDoubleSpinBox, QgsSpinBox
from qgis.PyQt.QtCore import Qt, pyqtSignal
from qgis.PyQt.QtWidgets import QCheckBox, QComboBox, QFormLayout, QHBoxLayout, QLabel, QWidget

from .worklist import ORDERS, Filter

_ANY_KM = -1


class FilterBar(QWidget):
    """Survey, order and filters of the dock."""

    asked = pyqtSignal()
    survey_chosen = pyqtSignal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.survey = QComboBox()
        self.survey.setObjectName("survey")
        self.order = QComboBox()
        self.order.setObjectName("order")
        for name, (title, _) in ORDERS.items():
            self.order.addItem(title, name)
        self.kinds = QgsCheckableComboBox()
        self.kinds.setObjectName("kinds")
        self.kinds.setDefaultText("all kinds")
        self.open_only = QCheckBox("not reviewed only")
        self.open_only.setObjectName("open_only")
        self.open_only.setChecked(True)
        self.km_from, self.km_to = _kilometre("km_from"), _kilometre("km_to")
        self.min_area = QgsDoubleSpinBox()
        self.min_area.setObjectName("min_area")
        self.min_area.setRange(0.0, 10_000.0)
        self.min_area.setDecimals(2)
        self.min_area.setSingleStep(0.1)
        self.min_area.setSuffix(" m² and more")
        self.min_area.setClearValue(0.0, "any area")
        self._arrange()
        self.survey.currentIndexChanged.connect(lambda _: self.survey_chosen.emit())
        self.order.currentIndexChanged.connect(lambda _: self.asked.emit())
        self.kinds.checkedItemsChanged.connect(lambda _: self.asked.emit())
        self.open_only.toggled.connect(lambda _: self.asked.emit())
        for box in (self.km_from, self.km_to, self.min_area):
            box.setKeyboardTracking(False)
            box.valueChanged.connect(lambda _: self.asked.emit())

    def offer(self, surveys: List[Tuple[int, str, str]], kinds: List[Tuple[str, str]], chosen: str) -> None:
        """Fill in surveys and kinds without a signal."""
        for box in (self.survey, self.kinds):
            box.blockSignals(True)
        self.survey.clear()
        for _, name, tunnel in surveys:
            self.survey.addItem(f"{name} ({tunnel})", name)
        self.survey.setCurrentIndex(max(self.survey.findData(chosen), 0))
        self.kinds.clear()
        for code, label in kinds:
            self.kinds.addItemWithCheckState(label, Qt.CheckState.Unchecked, code)
        for box in (self.survey, self.kinds):
            box.blockSignals(False)

    @property
    def filter(self) -> Filter:
        """Return the selection."""
        return Filter(
            frozenset(str(code) for code in self.kinds.checkedItemsData()),
            None if self.km_from.value() == _ANY_KM else self.km_from.value(),
            None if self.km_to.value() == _ANY_KM else self.km_to.value(),
            self.min_area.value(),
            self.open_only.isChecked(),
        )

    def _arrange(self) -> None:
        form = QFormLayout(self)
        form.setContentsMargins(0, 0, 0, 0)
        form.setVerticalSpacing(3)
        form.addRow("Survey", self.survey)
        form.addRow("Order", self.order)
        form.addRow("Kinds", self.kinds)
        between = QHBoxLayout()
        between.addWidget(self.km_from)
        between.addWidget(QLabel("to"))
        between.addWidget(self.km_to)
        form.addRow("km", between)
        form.addRow("Area", self.min_area)
        form.addRow(self.open_only)


def _kilometre(name: str) -> QgsSpinBox:
    box = QgsSpinBox()
    box.setObjectName(name)
    box.setRange(_ANY_KM, 9999)
    box.setSpecialValueText("any")
    box.setClearValue(_ANY_KM)
    box.setValue(_ANY_KM)
    return box
