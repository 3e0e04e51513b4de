"""Synthetic tunnel and its contents, as flat arrays for the kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.simulate.lining.leaks import EDGE, Leak, edge_table
from tunneldb.simulate.objects.fixtures import Appendage, Niche, appendage_table, bins, niche_table
from tunneldb.simulate.tunnel.tunnel import Tunnel


class Scene(NamedTuple):
    """Tunnel and its contents, as flat arrays for the kernels."""

    plan: Float
    profile: Float
    parts: Float
    # chainage of both ends, arc of the floor's corner, reach of fixtures off the lining, half a leak's edge,
    # number of leaks in niches
    ends: Float
    items: Float
    item_bins: Int64
    item_list: Int64
    niches: Float
    niche_bins: Int64
    niche_list: Int64
    edges: Float
    edge_first: Int64
    leaks: Float
    leak_bins: Int64
    leak_list: Int64


def scene(tunnel: Tunnel, items: list[Appendage], niches: list[Niche], leaks: list[Leak], edge: float = EDGE) -> Scene:
    """Arrange a tunnel and its contents for the kernels; leaks change from dry to wet over ``edge`` m."""
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
