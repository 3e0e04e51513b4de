"""Design alignments: lines, arcs and clothoids in plan, grades, parabolas and circles in profile; LandXML and IFC."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
