"""The canal as a signed field (free space is positive), bars and hulls as analytic bodies, and a ray caster over both.

The field is built of minima and maxima of distances, so that it never exceeds the distance to the nearest surface by more than
the roughness, and a ray may step by it. The local frame has x along the canal, y to the left, z up, and z = 0 at the water of
the laser's day.
"""

from __future__ import annotations

from dataclasses import dataclass, field as default

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

CHUNK = 20_000  # rays at a time, so that the work stays in the cache
NONE, SOLID, LADDER, ROPE, BOAT, TRIPOD, SURFACE = range(7)


@dataclass
class Box:
    """A recess (cut into a wall) or a pilaster (before a wall), in chainage and height."""

    wall: str  # "R", "L" (the channel's walls) or "B" (the wall behind the towpath)
    s: float
    half: float
    depth: float  # positive
    low: float
    high: float
    cut: bool  # True: recess


@dataclass
class Pier:
    """A pier of oblong plan with round noses."""

    s: float
    n: float
    half: float  # half length of the straight part
    radius: float
    top: float  # height of its top, under the deck


@dataclass
class Bar:
    """A round bar from a to b in the local frame."""

    a: np.ndarray
    b: np.ndarray
    radius: float
    kind: int


@dataclass
class Hull:
    """The lower part of an ellipsoid: a boat, open at the top."""

    centre: np.ndarray
    axes: tuple[float, float, float]
    heading: float
    gunwale: float  # height of the open rim


@dataclass
class Canal:
    """Shape of a canal and its tunnel. Lengths in m; n is the offset to the left of the channel's middle."""

    length: float
    half: float
    springing: float
    rise: float
    depth: float
    seed: int
    tow_width: float = 0.0
    tow_height: float = 0.5
    profile: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = default(default_factory=dict)
    ledges: tuple[tuple[str, float, float], ...] = ()  # wall, height of the top, width
    boxes: list[Box] = default(default_factory=list)
    piers: list[Pier] = default(default_factory=list)
    deck: tuple[float, float, float, float] | None = None  # chainage, half width, low, high
    holes: tuple[tuple[float, float, float, float], ...] = ()  # s, n, radius, depth of scour
    stones: float = 0.05  # a square metre
    bend: tuple[float, float] | None = None  # amplitude, wave length
    masonry: tuple[float, float, float] = (0.6, 0.3, 0.004)  # block length, block height, offset of faces
    joint: float = 0.006
    wave: float = 0.01  # slow changes of the walls along the canal
    margin: float = 35.0
    cell: float = 0.05

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        self.s0 = -self.margin
        ns = int((self.length + 2 * self.margin) / self.cell) + 1
        self.z0, nz = -self.depth - 0.8, int((self.depth + self.springing + self.rise + 2.0) / self.cell)
        self.slow = {w: self._smooth(rng, ns, 2.5 / self.cell) * self.wave for w in "RLB"}
        self.rough = {w: self._texture(rng, ns, nz) for w in "RLB"}
        self.n0 = -self.half - 1.5
        nn = int((2 * self.half + self.tow_width + 3.0) / self.cell)
        self.rough["V"] = self._texture(rng, ns, nn)
        self.bed_cell = 0.1
        self._make_bed(rng)

    @staticmethod
    def _smooth(rng: np.random.Generator, n: int, sigma: float) -> np.ndarray:
        v = gaussian_filter(rng.standard_normal(n), sigma)
        return v / v.std()

    def _texture(self, rng: np.random.Generator, ns: int, nz: int) -> np.ndarray:
        """Roughness of a wall: fine grain, bulges, courses of blocks with joints."""
        g = gaussian_filter(rng.standard_normal((ns, nz)).astype(np.float32), 0.8)
        out = g * np.float32(0.002 / g.std())
        coarse = gaussian_filter(rng.standard_normal((ns // 8 + 2, nz // 8 + 2)).astype(np.float32), 1.2)
        coarse *= np.float32(0.006 / coarse.std())
        i, j = np.arange(ns), np.arange(nz)
        out += coarse[i // 8][:, j // 8] * 0.5 + coarse[(i + 4) // 8][:, (j + 4) // 8] * 0.5
        length, height, sigma = self.masonry
        course = (j * self.cell / height).astype(int)
        block = ((i[:, None] * self.cell / length) + 0.5 * (course % 2)[None, :]).astype(int)
        table = rng.standard_normal((block.max() + 1, course.max() + 1)).astype(np.float32) * np.float32(sigma)
        out += table[block, course[None, :]]
        frac_v = (j * self.cell / height) % 1.0 < self.cell / height
        if height > 0.15:
            out[:, frac_v] -= self.joint
        return out

    def _make_bed(self, rng: np.random.Generator) -> None:
        c = self.bed_cell
        ns, nn = int((self.length + 2 * self.margin) / c) + 1, int((2 * self.half + 1.5) / c) + 1
        self.bed_n0 = -self.half - 0.75
        relief = gaussian_filter(rng.standard_normal((ns, nn)), 12)
        fine = gaussian_filter(rng.standard_normal((ns, nn)), 2.5)
        bed = -self.depth + 0.06 * relief / relief.std() + 0.012 * fine / fine.std()
        n = self.bed_n0 + np.arange(nn) * c
        edge = np.clip(self.half - np.abs(n), 0, None)
        mud = gaussian_filter(rng.random((ns, 2)), (20, 0))
        mud = 0.22 + 0.12 * (mud - mud.mean()) / mud.std()
        bed += np.where(n[None, :] < 0, mud[:, :1], mud[:, 1:]) * np.exp(-((edge[None, :] / 0.6) ** 2))
        s = self.s0 + np.arange(ns) * c
        for hs, hn, r, d in self.holes:
            k = np.abs(s - hs) < 4 * r
            q = ((s[k, None] - hs) / (1.5 * r)) ** 2 + ((n[None, :] - hn) / r) ** 2
            bed[k] += -d * np.exp(-q) + 0.25 * d * np.exp(-((np.sqrt(q) - 1.9) ** 2) / 0.2)
        for _ in range(int(self.stones * ns * nn * c * c)):
            cs, cn = rng.uniform(s[0], s[-1]), rng.uniform(-self.half + 0.3, self.half - 0.3)
            r, h = rng.uniform(0.12, 0.4), rng.uniform(0.08, 0.3)
            a, b = int((cs - s[0]) / c), int((cn - n[0]) / c)
            sl = (slice(max(a - 8, 0), a + 9), slice(max(b - 8, 0), b + 9))
            q = ((s[sl[0], None] - cs) ** 2 + (n[None, sl[1]] - cn) ** 2) / r**2
            bed[sl] += h * np.exp(-(q**1.5))
        self.bed = bed.astype(np.float32)
        self.bed_top = float(bed.max())

    # -- coordinates -------------------------------------------------------------------------------------------------------
    def frame(self, s: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """The lateral place of the channel's middle and its direction at a chainage."""
        if self.bend is None:
            return np.zeros_like(s), np.zeros_like(s)
        a, wave = self.bend
        k = 2 * np.pi / wave
        return a * np.sin(k * s), np.arctan(a * k * np.cos(k * s))

    def to_sn(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self.bend is None:
            return x, y
        a, wave = self.bend
        k = 2 * np.pi / wave
        slope = a * k * np.cos(k * x)
        dy, square = y - a * np.sin(k * x), 1 / (1 + slope**2)
        return x + dy * slope * square, dy * np.sqrt(square)

    def to_xyz(self, s: float, n: float, z: float) -> np.ndarray:
        y0, phi = self.frame(float(s))
        return np.array([s - n * np.sin(phi), y0 + n * np.cos(phi), z], float)

    def bed_at(self, s: float, n: float) -> float:
        c = self.bed_cell
        return float(map_coordinates(self.bed, [[(s - self.s0) / c], [(n - self.bed_n0) / c]], order=1, mode="nearest")[0])

    # -- the field ---------------------------------------------------------------------------------------------------------
    def near(self, low: float, high: float) -> tuple[list[Box], list[Pier]]:
        return [b for b in self.boxes if low < b.s < high], [p for p in self.piers if low < p.s < high]

    def field(self, x: np.ndarray, y: np.ndarray, z: np.ndarray, feats: tuple[list[Box], list[Pier]]) -> np.ndarray:
        """Distance to the nearest surface or less; negative in solids."""
        s, n = self.to_sn(x, y)
        i = np.clip(((s - self.s0) / self.cell).astype(np.int32), 0, len(self.slow["R"]) - 1)
        j = np.clip(((z - self.z0) / self.cell).astype(np.int32), 0, self.rough["R"].shape[1] - 1)
        boxes, piers = feats
        q: dict[str, np.ndarray] = {}
        walls = "RLB" if self.tow_width else "RL"
        for w in walls:
            base = n + self.half if w == "R" else (self.half - n if w == "L" else self.half + self.tow_width - n)
            base = base + self.slow[w][i] - self.rough[w][i, j]
            if w in self.profile:
                base -= np.interp(z, *self.profile[w])
            v = base
            for b in boxes:
                if b.wall != w:
                    continue
                along, tall = b.half - np.abs(s - b.s), np.minimum(b.high - z, z - b.low)
                inside = np.minimum(along, tall)
                if b.cut:
                    v = np.maximum(v, np.minimum(inside, base + b.depth))
                else:
                    v = np.minimum(v, np.maximum(-inside, base - b.depth))
            for lw, top, width in self.ledges:
                if lw == w:
                    v = np.minimum(v, np.maximum(base - width, z - top))
            q[w] = v
        out = q["R"]
        if self.tow_width:
            out = np.minimum(out, np.minimum(np.maximum(q["L"], z - self.tow_height + 0.5 * self.rough["V"][i, 0]), q["B"]))
        else:
            out = np.minimum(out, q["L"])
        a, b = self.half + self.tow_width / 2, self.rise
        up = z > self.springing - 0.3
        if up.any():
            su, nu, zu, iu = s[up], n[up], z[up], i[up]
            jn = np.clip(((nu - self.n0) / self.cell).astype(np.int32), 0, self.rough["V"].shape[1] - 1)
            rho = np.hypot((nu - self.tow_width / 2) / a, np.maximum(zu - self.springing, 0) / b)
            v = np.maximum((1 - rho) * min(a, b) - self.rough["V"][iu, jn], self.springing - zu)
            v = np.maximum(v, np.maximum(-su, su - self.length))
            out[up] = np.minimum(out[up], v)
        low = z < self.bed_top + 0.25
        if low.any():
            c = self.bed_cell
            coords = [(s[low] - self.s0) / c, (n[low] - self.bed_n0) / c]
            bed = map_coordinates(self.bed, coords, order=1, mode="nearest")
            out[low] = np.minimum(out[low], (z[low] - bed) * 0.85)
        out = np.where(low, out, np.minimum(out, z - self.bed_top))
        for p in piers:
            v = np.hypot(np.maximum(np.abs(s - p.s) - p.half, 0), n - p.n) - p.radius - 0.5 * self.rough["L"][i, j]
            out = np.minimum(out, np.maximum(v, z - p.top))
        if self.deck is not None:
            ds, dh, dl, du = self.deck
            out = np.minimum(out, np.maximum(np.abs(s - ds) - dh, np.maximum(dl - z, z - du)))
        return out


def fold(z: np.ndarray, water: float, side: int) -> np.ndarray:
    """Mirror heights at the water, so that a straight ray meets what its mirror image would meet."""
    return water + side * np.abs(z - water)


def march(canal: Canal, o: np.ndarray, d: np.ndarray, tmax: float, water: float, side: int) -> np.ndarray:
    """Lengths of rays to the field's surface; infinite where nothing is met."""
    s = canal.to_sn(o[:1], o[1:2])[0][0]
    feats = canal.near(s - tmax, s + tmax)
    out = np.full(len(d), np.inf)
    for lo in range(0, len(d), CHUNK):
        idx = np.arange(lo, min(lo + CHUNK, len(d)))
        t = np.full(len(idx), 0.02)
        dd = d[idx]
        for _ in range(130):
            f = canal.field(o[0] + t * dd[:, 0], o[1] + t * dd[:, 1], fold(o[2] + t * dd[:, 2], water, side), feats)
            hit = f < 5e-4
            out[idx[hit]] = t[hit]
            t = t + np.maximum(0.92 * f, 4e-4)
            keep = ~hit & (t < tmax)
            if not keep.any():
                break
            if not keep.all():
                idx, t, dd = idx[keep], t[keep], dd[keep]
    return out


def bar_hits(
    o: np.ndarray, d: np.ndarray, bars: list[Bar], t: np.ndarray, kind: np.ndarray, cos: np.ndarray, water: float, side: int
) -> None:
    """Shorten rays to the bars that they meet, real (on the instrument's side of the water) or mirrored."""
    if not bars:
        return
    for mirror in (False, True):
        ends = np.array([[b.a, b.b] for b in bars])
        if mirror:
            ends[..., 2] = 2 * water - ends[..., 2]
        c = ends.reshape(-1, 3).mean(axis=0)
        radius = np.linalg.norm(ends.reshape(-1, 3) - c, axis=1).max() + 0.05
        rel = c - o
        along = d @ rel
        sel = np.flatnonzero((along > -radius) & (rel @ rel - along**2 < radius**2))
        if not len(sel):
            continue
        ds = d[sel]
        for (a, b), bar in zip(ends, bars):
            axis = b - a
            length = np.linalg.norm(axis)
            axis = axis / length
            w = o - a
            dp, wp = ds - (ds @ axis)[:, None] * axis, w - (w @ axis) * axis
            qa, qb, qc = (dp * dp).sum(1), dp @ wp, wp @ wp - bar.radius**2
            disc = qb**2 - qa * qc
            k = np.flatnonzero(disc > 0)
            if not len(k):
                continue
            tt = (-qb[k] - np.sqrt(disc[k])) / qa[k]
            h = w @ axis + tt * (ds[k] @ axis)
            z = o[2] + tt * ds[k, 2]
            ok = (tt > 0.05) & (h > 0) & (h < length) & (tt < t[sel[k]]) & ((side * (z - water) < 0) == mirror)
            k, tt = k[ok], tt[ok]
            normal = (wp + tt[:, None] * dp[k]) / bar.radius
            g = sel[k]
            t[g], kind[g], cos[g] = tt, bar.kind, np.abs((normal * ds[k]).sum(1))


def hull_hits(
    o: np.ndarray, d: np.ndarray, hulls: list[Hull], t: np.ndarray, kind: np.ndarray, cos: np.ndarray, water: float, side: int
) -> None:
    """As bar_hits, for boats."""
    for hull in hulls:
        for mirror in (False, True):
            flip = np.array([1.0, 1.0, -1.0 if mirror else 1.0])
            oo = o.copy()
            if mirror:
                oo[2] = 2 * water - o[2]
            dd = d * flip
            ch, sh = np.cos(hull.heading), np.sin(hull.heading)
            rot = np.array([[ch, sh, 0], [-sh, ch, 0], [0, 0, 1]]) / np.array(hull.axes)[:, None]
            p, v = rot @ (oo - hull.centre), dd @ rot.T
            qa, qb, qc = (v * v).sum(1), v @ p, p @ p - 1
            disc = qb**2 - qa * qc
            root = np.sqrt(np.maximum(disc, 0))
            for sign in (1, -1):
                tt = (-qb + sign * root) / qa
                z = oo[2] + tt * dd[:, 2]
                ok = (disc > 0) & (tt > 0.05) & (z < hull.gunwale) & (tt < t) & (side * (z - water) > 0)
                if ok.any():
                    t[ok], kind[ok] = tt[ok], BOAT
                    normal = (p + tt[ok, None] * v[ok]) @ rot
                    normal /= np.linalg.norm(normal, axis=1)[:, None]
                    cos[ok] = np.abs((normal * dd[ok]).sum(1))


def cast(
    canal: Canal,
    o: np.ndarray,
    d: np.ndarray,
    tmax: float,
    water: float,
    side: int,
    groups: list[list[Bar]],
    hulls: list[Hull],
    incidence: bool,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Length, kind, cosine of incidence and upward part of the normal for each ray. Side is 1 above the water, -1 below."""
    t = march(canal, o, d, tmax, water, side)
    kind = np.where(np.isfinite(t), SOLID, NONE).astype(np.int8)
    cos, up = np.ones(len(d)), np.zeros(len(d))
    if incidence:
        s = canal.to_sn(o[:1], o[1:2])[0][0]
        feats = canal.near(s - tmax, s + tmax)
        for lo in range(0, len(d), CHUNK):
            k = lo + np.flatnonzero(np.isfinite(t[lo : lo + CHUNK]))
            p = o + t[k, None] * d[k]
            sign = np.where(side * (p[:, 2] - water) < 0, -1.0, 1.0)
            p[:, 2] = fold(p[:, 2], water, side)
            h = 0.03
            f0 = canal.field(p[:, 0], p[:, 1], p[:, 2], feats)
            g = np.stack(
                [canal.field(p[:, 0] + h * e[0], p[:, 1] + h * e[1], p[:, 2] + h * e[2], feats) - f0 for e in np.eye(3)], axis=1
            )
            g /= np.maximum(np.linalg.norm(g, axis=1), 1e-6)[:, None]
            up[k] = g[:, 2]
            g[:, 2] *= sign
            cos[k] = np.clip(-(g * d[k]).sum(1), 0.05, 1)
    for bars in groups:
        bar_hits(o, d, bars, t, kind, cos, water, side)
    hull_hits(o, d, hulls, t, kind, cos, water, side)
    return t, kind, cos, up
