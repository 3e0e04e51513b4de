"""The inspection report of a survey: one HTML file that asks nothing of the network, or a PDF of it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
