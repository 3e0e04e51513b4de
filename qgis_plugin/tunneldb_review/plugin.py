"""Entry point of QGIS: menu, tool bar, dock and provider."""

from __future__ import annotations

from typing import Any, List, Optional, Tuple

from qgis.core import Qgis, QgsApplication, QgsMessageLog
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QAction

from .database import Database, DatabaseError
from .provider import ICON, CommandProvider
from .runner import CommandError
from .session import Session
from .settings import Settings

TITLE = "tunneldb"


class ReviewPlugin:
    """The plugin.

    Parameters
    ----------
    iface : QgisInterface or None
        None where QGIS has no window, as in ``qgis_process``.
    """

    def __init__(self, iface: Any) -> None:
        self.iface = iface
        self.provider: Optional[CommandProvider] = None
        self.dock: Any = None
        self.reloader: Any = None
        self.actions: List[QAction] = []

    def initProcessing(self) -> None:
        """Add the algorithms."""
        self.provider = CommandProvider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self) -> None:
        """Add algorithms, dock, menu and tool bar."""
        from .dock import ReviewDock
        from .reload import ImageReloader

        self.initProcessing()
        self.reloader = ImageReloader()
        self.dock = ReviewDock(lambda: self.iface.mapCanvases(), self.iface.mainWindow())
        self.iface.addDockWidget(Qt.DockWidgetArea.BottomDockWidgetArea, self.dock)
        self.dock.hide()  # QGIS shows what it adds
        self.dock.survey_changed.connect(self._keep_survey)
        self.dock.reload_wanted.connect(self.reload)
        self._add("Review leaks", self.review, QIcon(ICON), "Ctrl+Alt+L")
        self._add("Connect…", self.connect)
        self._add("Read images and findings again", self.reload)

    def unload(self) -> None:
        """Remove everything again."""
        for action in self.actions:
            self.iface.removePluginDatabaseMenu(TITLE, action)
            self.iface.removeToolBarIcon(action)
        self.actions.clear()
        if self.reloader is not None:
            self.reloader.stop()
            self.reloader = None
        if self.dock is not None:
            self.dock.end()
            self.iface.removeDockWidget(self.dock)
            self.dock.deleteLater()
            self.dock = None
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None

    def review(self) -> None:
        """Show the dock, and connect it if it is not; a second time its keys are given back to it."""
        self.dock.show()
        self.dock.raise_()
        if self.dock.session is None:
            self.begin(Settings.read())
        self.dock.take_keys()

    def connect(self) -> None:
        """Ask for the connection, and start there."""
        from .connect_dialog import ConnectDialog

        dialog = ConnectDialog(Settings.read(), self.attempt, self.iface.mainWindow())
        if dialog.exec():
            settings = dialog.settings()
            settings.write()
            self.dock.end()
            self.dock.show()
            self.begin(settings)

    def attempt(self, settings: Settings) -> Tuple[str, bool]:
        """Try to connect, and report the result."""
        try:
            session = Session(Database(settings.connection()))
        except (DatabaseError, CommandError, ValueError) as error:
            return str(error), False
        database = session.database
        said = f"Connected as {database.person}: {len(session.surveys)} surveys."
        return (said, True) if database.may_review else (f"{said} You may look, but not review.", False)

    def begin(self, settings: Settings) -> None:
        """Connect the dock."""
        try:
            session = Session(Database(settings.connection()))
        except (DatabaseError, CommandError, ValueError) as error:
            self._say(str(error), Qgis.Warning)
            return
        self.dock.source.folder = settings.images
        self.dock.begin(session, settings.survey)

    def reload(self) -> None:
        """Reload image layers with changed files, layers of the database, and the list of the dock."""
        names = self.reloader.reload()
        read = self.dock.read_again()
        changed = f"{len(names)} changed images were reloaded" if names else "No image has changed"
        findings = "findings were reloaded" if read else "findings of the dock were not reloaded"
        self._say(f"{changed}; {findings}.", Qgis.Info if read else Qgis.Warning)

    def _keep_survey(self, survey: str) -> None:
        settings = Settings.read()
        settings.survey = survey
        settings.write()

    def _add(self, text: str, act: Any, icon: Optional[QIcon] = None, key: str = "") -> None:
        action = QAction(icon or QIcon(), text, self.iface.mainWindow())
        action.triggered.connect(lambda _=False: act())
        if key:
            action.setShortcut(key)
        if icon is not None:
            self.iface.addToolBarIcon(action)
        self.iface.addPluginToDatabaseMenu(TITLE, action)
        self.actions.append(action)

    def _say(self, text: str, level: Any) -> None:
        QgsMessageLog.logMessage(text, TITLE, level)
        self.iface.messageBar().pushMessage(TITLE, text, level)
