"""Motorway and hydropower tunnels, as a surveyor with profilers and static scanners meets them."""

from __future__ import annotations

from ..scene import Scene
from .hydropower import GALLERY, WATERWAY
from .motorway import FANS, WINTER
from .road import PANELS, TILES
from .rough import ROCK, SPRAYED

SCENES: tuple[Scene, ...] = (FANS, PANELS, ROCK, SPRAYED, TILES, WATERWAY, WINTER, GALLERY)
