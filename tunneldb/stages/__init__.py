"""Stages and measures: one registry of them, what runs them, and the ledger of what ran."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
