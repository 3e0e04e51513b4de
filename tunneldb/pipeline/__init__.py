"""Processing of a survey's files, and the stages of a kilometre."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
