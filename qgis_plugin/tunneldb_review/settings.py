"""Settings stored between sessions of QGIS: names, paths and ids of entries elsewhere, never a password."""

from __future__ import annotations

import shutil
from dataclasses import dataclass

from qgis.core import QgsProject, QgsSettings, QgsVectorLayer

from .connection import HOME, PROJECT, SERVICE, Connection, of_home, of_service, of_source
from .runner import CommandError, answer

_PREFIX = "tunneldb_review"


@dataclass
class Settings:
    """Settings of the plugin.

    Attributes
    ----------
    way : {'project', 'service', 'home'}
        Where the connection is taken from.
    service, authcfg : str
        Entry of ``pg_service.conf``, and id of an authentication configuration that gives user and password, if any.
    home : str
        Folder of an embedded server, as TUNNELDB_HOME; empty for the one in the user's data folder.
    command : str
        Path of the command ``tunneldb``; empty for the one on the path.
    images : str
        Folder of images, for surveys of which the open project shows none.
    survey : str
        Survey that was last chosen.
    """

    way: str = PROJECT
    service: str = ""
    authcfg: str = ""
    home: str = ""
    command: str = ""
    images: str = ""
    survey: str = ""

    @classmethod
    def read(cls) -> Settings:
        """Return the stored settings."""
        kept = QgsSettings()
        return cls(**{name: str(kept.value(f"{_PREFIX}/{name}", default)) for name, default in vars(cls()).items()})

    def write(self) -> None:
        """Store the settings."""
        kept = QgsSettings()
        for name, value in vars(self).items():
            kept.setValue(f"{_PREFIX}/{name}", value)

    @property
    def program(self) -> str:
        """The command ``tunneldb``."""
        return self.command or shutil.which("tunneldb") or "tunneldb"

    def connection(self) -> Connection:
        """Return how the database is reached; an embedded server is started.

        Raises
        ------
        CommandError, ValueError
            In one line, why it can't be said.
        """
        if self.way == SERVICE:
            if not self.service:
                raise ValueError("enter a service of pg_service.conf in Connect")
            return of_service(self.service, self.authcfg)
        if self.way == HOME:
            environment = {"TUNNELDB_HOME": self.home} if self.home else {}
            return of_home(self.home, answer(self.program, ["server", "start"], environment))
        for layer in QgsProject.instance().mapLayers().values():
            if isinstance(layer, QgsVectorLayer) and layer.providerType() == "postgres" and '"tunnel_api"' in layer.source():
                return of_source(layer.source())
        raise ValueError("the open project has no layer of tunneldb: open one, or enter a service or a home in Connect")


__all__ = ["CommandError", "Settings"]
