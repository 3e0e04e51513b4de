"""Canals of round 4: brick with weed, a masonry bend, a basin with piers, and a culvert without a ladder."""

from __future__ import annotations

from benchmarks.blind_canal.scene import Scene

from . import basin, bend, brick, culvert

SCENES: tuple[Scene, ...] = (
    Scene("brick-straight-60", "A straight brick canal of 60 m, one wooden ladder, weed at the walls.", brick.make),
    Scene("masonry-bend-towpath", "A masonry canal in a gentle bend, a towpath, two steel ladders.", bend.make),
    Scene("basin-bridge-piers", "A wide basin under a bridge with round piers, one ladder, water that fell.", basin.make),
    Scene("culvert-inlets-buttresses", "A concrete culvert with inlets, a bed step and buttresses, no ladder.", culvert.make),
)
