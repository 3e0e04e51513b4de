"""Synthetic scans of steel and concrete structures with reference data: profiles, pipes, walls, and surface anomalies.

>>> from tunneldb.simulate.structure import StructureParameters, StructureScan
>>> scan = StructureScan(StructureParameters(seed=3))
"""

from tunneldb.simulate.structure.generate import StructureScan
from tunneldb.simulate.structure.output import StructureFiles, write_structure
from tunneldb.simulate.structure.parameters import StructureParameters

__all__ = ["StructureFiles", "StructureParameters", "StructureScan", "write_structure"]
