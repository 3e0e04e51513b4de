"""Formats of scan files: LAS, LAZ, E57 and raw coordinates, their headers and faults."""
