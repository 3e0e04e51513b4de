"""Six structures, cast by a ray caster over boxes, cylinders, quarter bends and bushes (`caster`).

Two bridges of steel (`steel`), a pipe rack, a tank and a row of switchgear (`plant`) and an abutment (`concrete`). Every beam
is cast at its axis and, where its neighbours lie on another surface, at six more rays of its footprint: partial hits and
mixed pixels come from these. A pulsed instrument keeps the strongest echo, a phase one mixes all. Amplitude is a constant, a
range term with defocus at short range, a cosine with a lobe for each material, reflectance with mottle and grain, patches of
design and of anomaly, noise, a gain for each line, a slow drift, compression and a detection limit. Glossy sheets return
ghosts, air returns false echoes. Truth is what the caster knows of each hit: an anomaly is where its strength is above 0.4 of
the full one.
"""

from __future__ import annotations

from benchmarks.blind_structures.scene import Scene

from . import concrete, plant, steel

SCENES = (
    Scene("lattice-bridge", "Lattice girder of double angles and gussets, painted, rust patches; two stations.", steel.lattice),
    Scene("pipe-rack", "Twelve pipes of 5 to 40 cm, coatings, cladding, elbows, rust, leak stains; two stations.", plant.rack),
    Scene("tank-wall", "Tank of 8 m radius, courses, seams, ladder, rust runs, a repainted patch; two stations.", plant.tank),
    Scene("abutment", "Abutment with two bearings, rebar stains, efflorescence, moisture; one station.", concrete.abutment),
    Scene("switchgear", "Switchgear cabinets with doors, handles, labels and cables; clean; two stations.", plant.switchgear),
    Scene("weathering-box", "Box girder of weathering steel, a wet run and salt stains; three stations.", steel.weathering),
)
