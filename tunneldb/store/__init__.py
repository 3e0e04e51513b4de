"""Tables of the database to arrays and back; nothing is computed or decided here (an import contract)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
