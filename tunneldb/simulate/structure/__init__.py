"""Synthetic scans of steel and concrete structures with truth: profiles, pipes, walls and what differs on their surfaces.

>>> from tunneldb.simulate.structure import StructureParameters, StructureScan
>>> scan = StructureScan(StructureParameters(seed=3))
"""

from tunneldb.simulate.structure.generate import StructureScan
from tunneldb.simulate.structure.output import StructureFiles, write_structure
from tunneldb.simulate.structure.parameters import StructureParameters

__all__ = ["StructureFiles", "StructureParameters", "StructureScan", "write_structure"]
