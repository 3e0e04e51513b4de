"""QGIS plugin of tunneldb: a dock to review leaks by keyboard, and the command line as Processing algorithms."""

from __future__ import annotations


def classFactory(iface):
    """Return the plugin, as QGIS asks for it; without an interface (``qgis_process``) it has its algorithms alone."""
    from .plugin import ReviewPlugin

    return ReviewPlugin(iface)
