"""Five structures, cast blind.

A galvanised stair tower, a hall with painted frames, a formwork concrete wall with plants, a footbridge seen from below after
rain, and a clean painted pipe bridge. Each is built of flat patches and tubes with true edges (`engine.py`) and seen from its
stations by five sub-rays for each beam, so that edges mix, ranges have noise and everything in front hides what lies behind.
Amplitude has a range function with a weak near field, a diffuse and a specular part for each material, mottling, zinc spangle,
drift, noise and a station constant. Truth is what was cast: the surface hit, the anomaly at that place, the angle, the area.
"""

from benchmarks.blind_structures.round_02 import hall, outside, stairs
from benchmarks.blind_structures.scene import Scene

SCENES = (
    Scene("galvanised-stair-tower", "Galvanised stair tower, gratings, rails, rust at feet; two stations.", stairs.make),
    Scene("crane-hall", "Painted frames in two colours, peeled paint, soot, trays and cables; three stations.", hall.make),
    Scene("formwork-wall", "Formwork concrete with graffiti, rebar stains, ivy and shrubs; one station.", outside.wall),
    Scene("wet-footbridge", "Steel deck from below after rain: wet films, puddles, rust; two stations.", outside.footbridge),
    Scene("clean-pipe-bridge", "Pipe bridge without anomalies: bands, labels, flanges; two stations.", hall.pipe_bridge),
)
