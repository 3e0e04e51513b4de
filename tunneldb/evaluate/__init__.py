"""Comparison of detected leaks with reference leaks: number, area and accuracy of edges."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
