"""From laser scans of tunnels to water leaks, in PostGIS and QGIS."""

__version__ = "0.1.0"
