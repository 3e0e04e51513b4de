"""Shape of the lining, ring by ring: planes, circles, ellipses and harmonics, with standard errors.

Works on arrays only: no database and no files.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
