"""What leaves the database as a file: images, point clouds, tables, figures, exchange formats and QGIS projects."""
