"""The unrolled image: points projected, gathered by pixel, and what each pixel shows."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
