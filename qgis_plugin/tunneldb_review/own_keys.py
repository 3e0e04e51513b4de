"""Lists keep the letters that are typed in them: without this a letter meant to find an entry would be a verdict."""

from __future__ import annotations

from typing import Callable

from qgis.PyQt.QtCore import QEvent, QObject, Qt, QTimer
from qgis.PyQt.QtWidgets import QComboBox

_OTHERS = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier | Qt.KeyboardModifier.MetaModifier
_ARROWS = (Qt.Key.Key_Left, Qt.Key.Key_Right)
_ENDS = (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Escape)


class OwnKeys(QObject):
    """Tells Qt that a plain key pressed in a list is no shortcut of the dock about it.

    Parameters
    ----------
    done : callable
        Is called when a list was folded up, or left by Enter or Escape.
    parent : QObject
    """

    def __init__(self, done: Callable[[], None], parent: QObject) -> None:
        super().__init__(parent)
        self.done = done

    def keep(self, box: QComboBox) -> None:
        """Leave keys to a box and the list that it unfolds."""
        box.installEventFilter(self)
        box.view().installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take plain keys before shortcuts are evaluated."""
        unfolds = not isinstance(watched, QComboBox)
        if event.type() == QEvent.Type.ShortcutOverride and not event.modifiers() & _OTHERS:
            if (event.text() and event.text().isprintable()) or event.key() in _ARROWS:
                event.accept()
                return True
        elif event.type() == QEvent.Type.Hide and unfolds:
            QTimer.singleShot(0, self.done)  # when what was chosen has been acted upon
        elif event.type() == QEvent.Type.KeyPress and not unfolds and event.key() in _ENDS:
            self.done()
            return True
        return super().eventFilter(watched, event)
