"""Classification of points: ground, lining, objects and fixtures, and target spheres (Li et al., 2023)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
