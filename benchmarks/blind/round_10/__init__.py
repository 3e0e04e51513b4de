"""Round 10: eight ordinary tunnels, six with leaks and two dry and dirty.

Painted on the unrolled lining and scanned by following beams to lining and fixtures; written from descriptions of the
trade alone.
"""

from .scene_brick import SCENE as BRICK
from .scene_gallery import SCENE as GALLERY
from .scene_metro import SCENE as METRO
from .scene_rail import SCENE as RAIL
from .scene_road import SCENE as ROAD
from .scene_shotcrete import SCENE as SHOTCRETE
from .scene_stone import SCENE as STONE
from .scene_underpass import SCENE as UNDERPASS

SCENES = (METRO, RAIL, BRICK, ROAD, SHOTCRETE, GALLERY, UNDERPASS, STONE)

__all__ = ["SCENES"]
