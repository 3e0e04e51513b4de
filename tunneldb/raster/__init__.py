"""Unrolled image: projection of points, sums by pixel, and the state of each pixel."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
