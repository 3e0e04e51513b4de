"""Scan files: LAS, LAZ, E57 and raw coordinates, their headers and what is wrong with them."""
