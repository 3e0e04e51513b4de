"""Eight tunnels: roads, an adit, a power station's access, brick, metro, box, precast arch and an escape gallery."""

from __future__ import annotations

from . import adit, box, brick, gallery, hydro, metro, road, underpass

SCENES = tuple(module.SCENE for module in (road, adit, hydro, brick, metro, box, underpass, gallery))
