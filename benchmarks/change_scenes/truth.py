"""Truth, from the arrays that shaped the lining."""

from __future__ import annotations

import json

import numpy as np
import shapely
from shapely.geometry import mapping
from scipy import ndimage

SECTION = 1.5


def outline(lining, mask, win, tol=0.006):
    """Mask on nodes (in window) -> (Multi)Polygon in (s, u)."""
    ds, du = lining.ds, lining.profile.du
    s0, u0 = win[0].start or 0, win[1].start or 0
    boxes = []
    for i in range(mask.shape[0]):
        e = np.diff(np.r_[0, mask[i].astype(np.int8), 0])
        for a, b in zip(np.nonzero(e == 1)[0], np.nonzero(e == -1)[0]):
            boxes.append((max((s0 + i - 0.5) * ds, 0), (u0 + a - 0.5) * du, (s0 + i + 0.5) * ds, (u0 + b - 0.5) * du))
    b = np.array(boxes)
    g = shapely.union_all(shapely.box(*b.T), grid_size=1e-5)
    return shapely.make_valid(g.simplify(tol))


def lift(lining, geom, d):
    """(s, u) -> EPSG:25832 on the lining d, vertices 5 cm apart or closer."""
    from .scanner import Field

    f = Field(lining, d)
    p = lining.profile
    geom = shapely.segmentize(geom, 0.05)
    parts = [g for g in getattr(geom, "geoms", [geom]) if g.geom_type == "Polygon" and g.area > 0.0004]

    def ring(r):
        c = np.array(r.coords)
        s, u = np.clip(c[:, 0], 0, lining.length), c[:, 1] % p.length
        k = u / p.du
        j = k.astype(int) % p.n
        w = k - k.astype(int)
        j2 = (j + 1) % p.n
        x, z, nx, nz = (v[j] * (1 - w) + v[j2] * w for v in (p.x, p.z, p.nx, p.nz))
        v = f(s, u)
        q = lining.axis.world(lining.axis.from_local(s, x + nx * v, z + nz * v))
        return [[round(float(a), 4) for a in row] for row in q]

    return {
        "type": "MultiPolygon",
        "coordinates": [[ring(g.exterior)] + [ring(h) for h in g.interiors if h.length > 0.08] for g in parts],
    }


def su_geometry(geom):
    return [[round(float(v), 3) for v in geom.bounds]]


def collection(path, features):
    path.write_text(
        json.dumps(
            {
                "type": "FeatureCollection",
                "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}},
                "features": features,
            }
        )
    )


def coverage(lining, seen, cell=0.08):
    ns, nu = int(lining.length / cell) + 1, int(lining.profile.length / cell) + 1
    key = (seen["S"] / cell).astype(int) * nu + np.minimum((seen["U"] / cell).astype(int), nu - 1)
    return np.bincount(key, minlength=ns * nu).reshape(ns, nu)


def nodes_to_cover(lining, cover, cell=0.08):
    i = np.minimum((lining.s / cell).astype(int), cover.shape[0] - 1)
    j = np.minimum((lining.u / cell).astype(int), cover.shape[1] - 1)
    return cover[np.ix_(i, j)]


def rigid_rest(lining, delta, seen, use_floor, robust, step=5, length=SECTION):
    """delta less the rigid motion (x, z, roll, yaw, pitch) of each section, on every step-th node (the fit takes seen ones only)."""
    p = lining.profile
    dl = delta[::step, ::step].astype(float)
    sn = seen[::step, ::step]
    s = lining.s[::step]
    nx, nz, x, z = (v[::step] for v in (p.nx, p.nz, p.x, p.z))
    ok = np.ones(len(nx), bool) if use_floor else lining.on_lining[::step]
    out = np.zeros_like(dl)
    for k in range(int(np.ceil(lining.length / length))):
        rows = np.nonzero((s >= k * length) & (s < (k + 1) * length))[0]
        if len(rows) < 3:
            continue
        sc = s[rows][:, None] - s[rows].mean()
        one = np.ones((len(rows), 1))
        A = np.stack([one * nx, one * nz, one * (nz * x - nx * z), sc * nx, sc * nz], -1).reshape(-1, 5)
        y = dl[rows].ravel()
        w0 = (sn[rows] & ok[None, :]).ravel().astype(float)
        if w0.sum() < 50:
            out[rows] = np.nan
            continue
        w = w0.copy()
        for _ in range(25 if robust else 1):
            q = np.linalg.lstsq(A * np.sqrt(w)[:, None], y * np.sqrt(w), rcond=None)[0]
            r = y - A @ q
            if robust:
                w = w0 / np.maximum(np.abs(r), 5e-5)
        out[rows] = r.reshape(len(rows), -1)
    return out
