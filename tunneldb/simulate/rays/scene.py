"""A synthetic tunnel and what is in it, as flat arrays for the kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tunneldb.simulate.objects.fixtures import Appendage, Niche, appendage_table, bins, niche_table
from tunneldb.simulate.lining.leaks import EDGE, Leak, edge_table
from tunneldb.simulate.tunnel.tunnel import Tunnel

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Scene(NamedTuple):
    """A tunnel and what is in it, as flat arrays for the kernels."""

    plan: Array
    profile: Array
    parts: Array
    # chainage of both ends, arc of the floor's corner, reach of the appendages off the lining, half a leak's edge,
    # number of leaks in niches
    ends: Array
    items: Array
    item_bins: Index
    item_list: Index
    niches: Array
    niche_bins: Index
    niche_list: Index
    edges: Array
    edge_first: Index
    leaks: Array
    leak_bins: Index
    leak_list: Index


def scene(tunnel: Tunnel, items: list[Appendage], niches: list[Niche], leaks: list[Leak], edge: float = EDGE) -> Scene:
    """Lay a tunnel and its contents out for the kernels; leaks go from dry to wet over ``edge`` m."""
    line = tunnel.line
    item_rows, niche_rows = appendage_table(tunnel, items), niche_table(tunnel, niches)
    edges, first, leak_rows = edge_table(leaks)
    wet_niches = float(sum(leak.kind == "niche" for leak in leaks))
    reach = max((i.standoff + 0.5 * i.depth for i in items), default=0.0)
    return Scene(
        line.plan,
        line.profile,
        tunnel.section.parts,
        np.array([line.start, line.end, tunnel.section.floor_arc, 1.1 * reach + 0.02, 0.5 * edge, wet_niches]),
        item_rows,
        *bins(item_rows[:, 1], item_rows[:, 2], line.start, line.end),
        niche_rows,
        *bins(niche_rows[:, 0], niche_rows[:, 1], line.start, line.end),
        edges,
        first,
        leak_rows,
        *bins(leak_rows[:, 0], leak_rows[:, 2], line.start, line.end),
    )
