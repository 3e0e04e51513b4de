"""Dialog for the connection to the database, the command and the folder of images."""

from __future__ import annotations

from typing import Callable

from qgis.gui import QgsAuthConfigSelect, QgsFileWidget
from qgis.PyQt.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QRadioButton,
    QVBoxLayout,
    QWidget,
)

from .connection import HOME, PROJECT, SERVICE
from .settings import Settings


class ConnectDialog(QDialog):
    """Asks for the settings of the plugin.

    Parameters
    ----------
    settings : Settings
        What stands there at first.
    attempt : callable
        Takes settings, tries to connect, and returns a line and whether it went well.
    """

    def __init__(
        self, settings: Settings, attempt: Callable[[Settings], tuple[str, bool]], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Connect to tunneldb")
        self.setMinimumWidth(560)
        self.attempt = attempt
        self.survey = settings.survey
        self.ways = {
            PROJECT: QRadioButton("as in the layers of the open project"),
            SERVICE: QRadioButton("by a service of pg_service.conf"),
            HOME: QRadioButton("to the embedded server of a home folder"),
        }
        self.service = QLineEdit(settings.service)
        self.service.setObjectName("service")
        self.authcfg = QgsAuthConfigSelect(self, "postgres")
        self.authcfg.setConfigId(settings.authcfg)
        self.home, self.command, self.images = QgsFileWidget(), QgsFileWidget(), QgsFileWidget()
        self.home.setStorageMode(QgsFileWidget.GetDirectory)
        self.home.lineEdit().setPlaceholderText("TUNNELDB_HOME; empty: default in your data folder")
        self.command.lineEdit().setPlaceholderText("empty: tunneldb on the path")
        self.images.setStorageMode(QgsFileWidget.GetDirectory)
        self.images.lineEdit().setPlaceholderText("output folder of tunneldb image; not needed with a project")
        for box, value in ((self.home, settings.home), (self.command, settings.command), (self.images, settings.images)):
            box.setFilePath(value)
        self.ways.get(settings.way, self.ways[PROJECT]).setChecked(True)
        self.told = QLabel()
        self.told.setWordWrap(True)
        self._arrange()

    def settings(self) -> Settings:
        """Return the user's settings."""
        return Settings(
            way=next(way for way, button in self.ways.items() if button.isChecked()),
            service=self.service.text().strip(),
            authcfg=self.authcfg.configId(),
            home=self.home.filePath().strip(),
            command=self.command.filePath().strip(),
            images=self.images.filePath().strip(),
            survey=self.survey,
        )

    def _try(self) -> None:
        text, well = self.attempt(self.settings())
        self.told.setStyleSheet("" if well else "color: #b00020")
        self.told.setText(text)

    def _arrange(self) -> None:
        form = QFormLayout()
        form.addRow("Connect", self.ways[PROJECT])
        form.addRow("", self.ways[SERVICE])
        form.addRow("Service", self.service)
        form.addRow("User and password", self.authcfg)
        form.addRow("", self.ways[HOME])
        form.addRow("Home", self.home)
        form.addRow("Command tunneldb", self.command)
        form.addRow("Images", self.images)
        hint = QLabel(
            "No password is stored here: it comes from the service's entry, from .pgpass, or from QGIS's authentication manager"
            " (which the command tunneldb does not use)."
        )
        hint.setWordWrap(True)
        test = QPushButton("Try it")
        test.clicked.connect(self._try)
        test.setAutoDefault(False)  # Enter accepts, also after a try
        box = QDialogButtonBox(QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel)
        box.addButton(test, QDialogButtonBox.ButtonRole.ActionRole)
        box.accepted.connect(self.accept)
        box.rejected.connect(self.reject)
        column = QVBoxLayout(self)
        column.addLayout(form)
        column.addWidget(hint)
        column.addWidget(self.told)
        column.addWidget(box)
        for way, fields in ((SERVICE, (self.service, self.authcfg)), (HOME, (self.home,))):
            for each in fields:
                each.setEnabled(self.ways[way].isChecked())
                self.ways[way].toggled.connect(each.setEnabled)
