"""The Processing provider: an algorithm for each command that :mod:`.commands` describes."""

from __future__ import annotations

from pathlib import Path

from qgis.core import QgsProcessingProvider
from qgis.PyQt.QtGui import QIcon

from .algorithm import CommandAlgorithm
from .commands import COMMANDS

ICON = str(Path(__file__).with_name("icon.svg"))


class CommandProvider(QgsProcessingProvider):
    """Algorithms that call ``tunneldb``."""

    def id(self) -> str:
        """Return its id."""
        return "tunneldb"

    def name(self) -> str:
        """Return its name."""
        return "tunneldb"

    def longName(self) -> str:
        """Return the provider's name."""
        return "tunneldb: laser-scanned tunnels"

    def icon(self) -> QIcon:
        """Return its icon."""
        return QIcon(ICON)

    def loadAlgorithms(self) -> None:
        """Make all algorithms."""
        for command in COMMANDS:
            self.addAlgorithm(CommandAlgorithm(command))
