"""Structures of round 4: a lattice gantry, silos, the bearing of a truss bridge, and a skid of a process plant."""

from __future__ import annotations

from benchmarks.blind_structures.scene import Scene

from . import bearing, gantry, silos, skid

SCENES: tuple[Scene, ...] = (
    Scene("gantry-lattice-rust", "A substation's portal of galvanised lattice with rust, two stations.", gantry.make),
    Scene("silos-concrete-stains", "Three concrete silos with stains, damp and efflorescence, two stations.", silos.make),
    Scene(
        "truss-bearing-paint", "The bearing of a painted truss bridge with rails and a grating, three stations.", bearing.make
    ),
    Scene("skid-pipes-wet", "A process plant's skid with tank, pipes, cable trays and wet patches, one station.", skid.make),
)
