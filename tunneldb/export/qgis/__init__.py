"""QGIS projects of a survey, written without QGIS, and the styles of its layers."""

from tunneldb.export.qgis.project import Rating, store_project, write_project
from tunneldb.export.qgis.styles import store_styles

__all__ = ["Rating", "store_project", "store_styles", "write_project"]
