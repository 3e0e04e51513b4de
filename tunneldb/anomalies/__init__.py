"""Leaks: unrolled image, appendages, threshold, polygons, statistics (Xu et al., 2018)."""
