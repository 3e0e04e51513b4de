"""Synthetic laser-scanned tunnels with reference data, for the demo, tests and benchmarks.

>>> from tunneldb.simulate import Parameters, Simulation, simulate
>>> cloud = simulate(Parameters(length=30, radius=300, scanner="profiler", profile_spacing=0.2, leaks=2))
"""

from tunneldb.simulate.floor_profile import rise
from tunneldb.simulate.generate import Cloud, Simulation, simulate
from tunneldb.simulate.objects.primitives import Primitive, TargetSphere
from tunneldb.simulate.output import Files, write
from tunneldb.simulate.parameters import PRESETS, Parameters
from tunneldb.simulate.tunnel.centreline import CentreLine, Element
from tunneldb.simulate.tunnel.section import Section, box, circular, horseshoe
from tunneldb.simulate.tunnel.tunnel import Tunnel, Unrolled

__all__ = [
    "PRESETS",
    "CentreLine",
    "Cloud",
    "Element",
    "Files",
    "Parameters",
    "Primitive",
    "Section",
    "Simulation",
    "TargetSphere",
    "Tunnel",
    "Unrolled",
    "box",
    "circular",
    "horseshoe",
    "rise",
    "simulate",
    "write",
]
