"""Axis, segment, section and unrolling: the mathematics of ``sql/``, vectorised for full density."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
