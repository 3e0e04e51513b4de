"""Where rays meet a lining that has relief."""

from __future__ import annotations

import numpy as np

from benchmarks.blind.known.rays import Hits, Index, Rays
from benchmarks.blind.known.section import Array
from benchmarks.blind.known.site import Site

SLACK = 0.006
DELTA = 0.012


def on_relief(site: Site, rays: Rays, smooth: Hits) -> Hits:
    """March rays through the zone of the relief; a ray that finds nothing gets an infinite range."""
    if site.surface.relief is None:
        return smooth
    low, high = site.surface.relief_range
    steep = np.maximum(smooth.cos, 0.06)
    near = np.maximum(smooth.t + (low - SLACK) / steep, 1.0)
    far = smooth.t + (high + SLACK) / steep
    count = int(np.clip((high - low) / 0.008, 8, 28))
    t = np.full(len(near), np.inf)
    active = np.arange(len(near))
    before_t, before_g = near, _gap(site, rays, active, near)[0]
    for k in range(1, count + 1):
        at = near[active] + (far - near)[active] * (k / count)
        gap = _gap(site, rays, active, at)[0]
        met = (gap >= 0.0) & (before_g < 0.0)
        crossed = active[met]
        t[crossed] = _close(site, rays, crossed, before_t[met], at[met], before_g[met], gap[met])
        active, before_t, before_g = active[~met], at[~met], gap[~met]
        if not len(active):
            break
    found = np.flatnonzero(np.isfinite(t))
    hits = Hits(t, smooth.u.copy(), smooth.s.copy(), smooth.cos.copy())
    _, hits.u[found], hits.s[found] = _gap(site, rays, found, t[found])
    hits.cos[found] = _cosine(site, rays, found, hits)
    return hits


def _gap(site: Site, rays: Rays, index: Index, t: Array) -> tuple[Array, Array, Array]:
    """How far a point of a ray is beyond the surface, with its chainage and outline coordinate."""
    origin, direction = rays.origin[index], rays.direction[index]
    u = origin[:, 0] + t * direction[:, 0]
    s, beyond = site.section.locate(origin[:, 1] + t * direction[:, 1], origin[:, 2] + t * direction[:, 2])
    return beyond - site.surface.depth(u, s), u, s


def _close(site: Site, rays: Rays, index: Index, one: Array, two: Array, g_one: Array, g_two: Array) -> Array:
    """False position, three times."""
    for _ in range(3):
        t = one - g_one * (two - one) / np.maximum(g_two - g_one, 1e-9)
        g, _, _ = _gap(site, rays, index, t)
        inner = g < 0.0
        one, g_one = np.where(inner, t, one), np.where(inner, g, g_one)
        two, g_two = np.where(inner, two, t), np.where(inner, g_two, g)
    result: Array = one - g_one * (two - one) / np.maximum(g_two - g_one, 1e-9)
    return result


def _cosine(site: Site, rays: Rays, index: Index, hits: Hits) -> Array:
    """Cosine of the incidence on the tilted surface."""
    u, s = hits.u[index], hits.s[index]
    surface = site.surface
    along = (surface.depth(u + DELTA, s) - surface.depth(u - DELTA, s)) / (2 * DELTA)
    across = (surface.depth(u, s + DELTA) - surface.depth(u, s - DELTA)) / (2 * DELTA)
    ty, tz = site.section.tangent(s)
    _, direction = rays.take(index)
    dot = direction[0] * along + direction[1] * (-tz + across * ty) + direction[2] * (ty + across * tz)
    cosine: Array = np.clip(-dot / np.sqrt(1.0 + along**2 + across**2), 0.03, 1.0)
    return cosine
