"""Segmentation of the lining by a small network: which pixels are wet."""
