"""Synthetic canal tunnels with reference data: laser scans above the water, sonar scans below it.

>>> from tunneldb.simulate.canal import CanalParameters, simulate
>>> scene = simulate(CanalParameters(seed=3))
"""

from tunneldb.simulate.canal.generate import CanalScene, simulate
from tunneldb.simulate.canal.output import CanalFiles, write
from tunneldb.simulate.canal.parameters import CanalParameters
from tunneldb.simulate.canal.sonar import FALSE, SonarScan

__all__ = ["FALSE", "CanalFiles", "CanalParameters", "CanalScene", "SonarScan", "simulate", "write"]
