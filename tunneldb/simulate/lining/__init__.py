"""Lining and floor of a synthetic tunnel: rings, relief, reflectance, marks, leaks, ballast."""
