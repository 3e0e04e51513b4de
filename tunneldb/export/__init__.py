"""Export from the database to files: images, point clouds, tables, figures, exchange formats and QGIS projects."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
