"""Batches: what is wanted, the jobs that follow from it, the workers that do them, and how far they have come."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
