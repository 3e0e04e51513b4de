"""Facts of a finding, and the inspector's input."""

from __future__ import annotations

from html import escape
from typing import Any, Dict, List, Tuple

from qgis.PyQt.QtCore import Qt, pyqtSignal
from qgis.PyQt.QtWidgets import QComboBox, QGridLayout, QHBoxLayout, QLabel, QLineEdit, QPushButton, QVBoxLayout, QWidget

from .cutouts import REVIEW_COLOURS

_LETTERS = {"joint": "J", "dark": "D"}
"""Kinds that detection finds besides leaks: always available, whatever their place in the list."""


class FactsPanel(QWidget):
    """Facts, kind, remark, and the buttons of a verdict."""

    kind_chosen = pyqtSignal(str)
    remarked = pyqtSignal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.head, self.facts = QLabel(), QLabel()
        self.head.setObjectName("head")
        self.facts.setObjectName("facts")
        self.facts.setWordWrap(True)
        self.facts.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.kind = QComboBox()
        self.kind.setObjectName("kind")
        self.remark = QLineEdit()
        self.remark.setObjectName("remark")
        self.remark.setPlaceholderText("Remark (M), Enter writes it")
        self.buttons = {
            "confirm": QPushButton("&Confirm (C)"), "reject": QPushButton("&Reject (R)"), "reopen": QPushButton("&Open (O)"),
            "previous": QPushButton("◀ (P)"), "next": QPushButton("▶ (N)"), "undo": QPushButton("&Undo (Z)"),
        }  # fmt: skip
        self._arrange()
        self.kind.activated.connect(lambda _: self.kind_chosen.emit(str(self.kind.currentData())))
        self.remark.returnPressed.connect(lambda: self.remarked.emit(self.remark.text()))

    def offer(self, kinds: List[Tuple[str, str]]) -> None:
        """Offer kinds, each with its key if it has one."""
        self.kind.clear()
        keys = {code: key for key, code in keys_of(kinds).items()}
        for code, label in kinds:
            self.kind.addItem(f"{label} ({keys[code]})" if code in keys else label, code)

    def show_finding(self, facts: Dict[str, Any] | None, probability: float | None) -> None:
        """Show a finding, or that there is none."""
        self.setEnabled(facts is not None)
        if facts is None:
            self.head.setText("<b>No finding</b>")
            self.facts.setText("No finding is left in this selection.")
            self.remark.clear()
            return
        raw = facts
        facts = {name: escape(value) if isinstance(value, str) else value for name, value in raw.items()}  # labels are HTML
        badge = f"<span style='color:{REVIEW_COLOURS.get(facts['review'], '#000')}'>{facts['review']}</span>"
        self.head.setText(f"<b>{facts['label'] or ''}</b> &nbsp; no. {facts['id']} &nbsp; <b>{badge}</b>")
        self.facts.setText("<br>".join(_lines(facts, probability)))
        self.kind.setCurrentIndex(self.kind.findData(raw["kind"]))
        self.remark.setText(raw["remark"] or "")

    def _arrange(self) -> None:
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        column.addWidget(self.head)
        column.addWidget(self.facts, 1)
        column.addWidget(self.kind)
        column.addWidget(self.remark)
        verdict, steps = QHBoxLayout(), QGridLayout()
        for name in ("confirm", "reject"):
            verdict.addWidget(self.buttons[name])
        for n, name in enumerate(("previous", "next", "reopen", "undo")):
            steps.addWidget(self.buttons[name], 0, n)
        for name, button in self.buttons.items():
            button.setObjectName(name)
        column.addLayout(verdict)
        column.addLayout(steps)


def keys_of(kinds: List[Tuple[str, str]]) -> Dict[str, str]:
    """Return the keys of kinds: numbers of the first nine, letters of those that detection finds."""
    lettered = {_LETTERS[code]: code for code, _ in kinds if code in _LETTERS}
    others = [code for code, _ in kinds if code not in _LETTERS]
    return {**{str(n): code for n, code in enumerate(others[:9], 1)}, **lettered}


def _lines(facts: Dict[str, Any], probability: float | None) -> List[str]:
    """Return the facts in words, a line each."""
    lines = []
    if probability is not None and facts["confidence"] is not None:
        lines.append(f"leak with probability <b>{probability:.2f}</b> (found as {facts['kind_detected']})")
    else:
        lines.append(f"{facts['origin']} by hand")
    size = f"{facts['area']:.2f}\u00a0m²"
    if facts["clock"] is not None:
        minutes = round(float(facts["clock"]) * 60) % 720
        size += f", at {minutes // 60 or 12}:{minutes % 60:02d}"
    lines.append(size + f", arc {facts['arc_from']:+.2f} to {facts['arc_to']:+.2f} m")
    if facts["darkening_mean"] is not None:
        darker = f"{facts['darkening_mean']:.1f} dB darker, at most {facts['darkening_max']:.1f}"
        if facts["contrast"] is not None:
            darker += f"; contrast {facts['contrast']:.0f}"
        if facts["image_share"] is not None:
            darker += f"; seen\u00a0{100 * facts['image_share']:.0f}\u00a0%"
        lines.append(darker)
    if facts["evidence"]:
        lines.append(str(facts["evidence"]))
    if facts["other_images"]:
        lines.append(str(facts["other_images"]))
    if facts["reviewed_by"]:
        lines.append(f"reviewed by {facts['reviewed_by']}, {facts['reviewed_at']}")
    if facts["photos"]:
        lines.append(f"{facts['photos']} photos")
    return lines
