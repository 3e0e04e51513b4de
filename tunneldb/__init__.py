"""From laser scans of tunnels to water leaks, in PostGIS and QGIS."""

import logging

__version__ = "0.1.0"

logging.getLogger(__name__).addHandler(logging.NullHandler())  # a program that wants the log says where to
