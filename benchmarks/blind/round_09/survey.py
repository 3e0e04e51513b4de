"""Scanners, what they record, and the files that come of it.

A return is a mixture of three lobes – diffuse, one back towards the source, and a narrow mirror-like one –, with shares that belong
to the material; water takes from the first two and adds a film to the third.
"""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, field
from pathlib import Path

import laspy
import numpy as np
import pyproj
import shapely
from scipy import ndimage

from .sheet import outline
from .tube import Axis, Section, meet, meet_rows, nearest

GLOSS, FILM = 0.09, 0.20  # widths of the lobes of glaze and of a film of water


def lobes(cos, kr):
    """The matt part at an angle, relative to square incidence."""
    c = np.clip(cos, 0.02, 1.0)
    return (1 - kr) * c * (1 - 0.12 * (1 - c) ** 2) + kr * c**0.3


def returned(cos, level, kr, ks=0.0, film=0.0, film_gain=0.06):
    """Power that comes back, relative to a white diffuse target met squarely, in dB."""
    c = np.clip(cos, 0.02, 1.0)
    t2 = (1 - c * c) / (c * c)
    p = 10 ** (level / 10) * lobes(c, kr)
    p = p + ks * np.exp(-t2 / GLOSS**2) + film * film_gain * np.exp(-t2 / FILM**2)
    return 10 * np.log10(np.maximum(p, 1e-6))


@dataclass
class Instrument:
    """What a scanner makes of a return."""

    const: float = 30.0  # dB, of a white target at 1 m, far of the optics of near range
    near: float = 1.2  # m: below some times this the receiver sees less
    power: float = 1.6
    speckle: float = 0.35  # dB
    floor: float = 2.0  # dB: the least that is recorded, four times the noise
    sigma: float = 0.0015  # m, range noise
    spot: float = 0.003  # m, radius of the beam at the exit
    spread: float = 0.00015  # rad, half divergence
    curve: tuple = (0.15, 3.0, 0.0)  # error of the reference curve: dB, period in ln r, slope in dB per 10 m
    slow: float = 0.0  # dB, drift over a scan
    target: float = 0.8  # reflectance of the reference target

    def of_range(self, r):
        r = np.maximum(r, 0.3)
        return -20 * np.log10(r) + 10 * np.log10(1 - np.exp(-((r / self.near) ** self.power)))

    def reference(self):
        r = np.round(np.arange(1.0, 30.01, 0.25), 3)
        a, k, b = self.curve
        off = a * np.sin(k * np.log(r)) + b * (r - 8) / 10
        return r, self.const + self.of_range(r) + 10 * np.log10(self.target) + off


@dataclass
class Floor:
    """What lies between the feet of the walls."""

    level: float = -8.0
    kr: float = 0.3
    rough: float = 0.004
    noise: float = 0.6  # dB, patches
    grain: float = 0.4  # dB, from point to point
    puddles: list = field(default_factory=list)  # (s, v, a, b): v along the floor from the right foot
    bands: list = field(default_factory=list)  # (v0, v1, level, rough)


@dataclass
class Works:
    """Everything that a scan needs to know of a tunnel."""

    axis: Axis
    sheet: object
    floor: Floor
    objects: list
    inst: Instrument
    relief: float = 0.02  # m, the most that anything stands out
    depth: float = 0.02  # m, the deepest recess
    steps: int = 6
    film_gain: float = 0.06
    truth_relief: float = 0.03  # m: smoothing of the relief that outlines are laid on; negative: none at all
    seed: int = 1


# ------------------------------------------------------------------------------------------------------------------------- casting


def _lookup(a, sheet, s, u):
    i = np.clip((s / sheet.h).astype(np.int32), 0, sheet.ns - 1)
    j = np.clip((u / sheet.h).astype(np.int32), 0, sheet.nu - 1)
    return a[i, j]


def _bilinear(a, sheet, s, u):
    x = np.clip(s / sheet.h - 0.5, 0, sheet.ns - 1.001)
    y = np.clip(u / sheet.h - 0.5, 0, sheet.nu - 1.001)
    i, j = x.astype(np.int32), y.astype(np.int32)
    fx, fy = (x - i).astype(np.float32), (y - j).astype(np.float32)
    return (a[i, j] * (1 - fx) + a[i + 1, j] * fx) * (1 - fy) + (a[i, j + 1] * (1 - fx) + a[i + 1, j + 1] * fx) * fy


def _shoot(w: Works, sec: Section, os, oy, oz, ds, dy, dz, hit, rng):
    """Follows beams to where they end. Returns a dict of arrays; `hit` is what `meet` gave."""
    sh = w.sheet
    t0, s, u, seg = hit
    n = len(t0)
    lin = seg < sec.k
    ny, nz = sec.n[seg, 0], sec.n[seg, 1]
    ty, tz = sec.t[seg, 0], sec.t[seg, 1]
    cosn = np.maximum(-(dy * ny + dz * nz), 0.02)
    dtan = dy * ty + dz * tz
    t = t0.copy()
    # relief of the lining: along the beam to the first place where it is inside of the surface
    idx = np.nonzero(lin)[0]
    if len(idx) and w.steps > 1:
        a, b = t0[idx] - w.relief / cosn[idx], t0[idx] + w.depth / cosn[idx]
        a = np.maximum(a, 0.1)
        cn, dsi, dti, si, ui, ti = cosn[idx], ds[idx], dtan[idx], s[idx], u[idx], t0[idx]
        best = b.copy()
        open_ = np.ones(len(idx), bool)
        prev = None
        for k in range(w.steps):
            tk = a + (b - a) * (k / (w.steps - 1))
            f = (ti - tk) * cn - _lookup(sh.disp, sh, si + (tk - ti) * dsi, ui + (tk - ti) * dti)
            if k:
                cross = open_ & (f <= 0)
                if cross.any():
                    fp, tp = prev
                    g = fp[cross] / np.maximum(fp[cross] - f[cross], 1e-9)
                    best[cross] = tp[cross] + np.clip(g, 0, 1) * (tk[cross] - tp[cross])
                    open_ &= ~cross
            prev = (f, tk)
        # once more, with the surface between cells
        d = _bilinear(sh.disp, sh, si + (best - ti) * dsi, ui + (best - ti) * dti)
        fine = ti - d / cn
        near = np.abs(fine - best) < 0.03
        best = np.where(near, 0.5 * best + 0.5 * fine, best)
        t[idx] = best
    # the floor
    fl = np.nonzero(~lin)[0]
    v = u[fl] - sec.girth
    level = np.empty(n, np.float32)
    kr = np.empty(n, np.float32)
    ks = np.zeros(n, np.float32)
    film = np.zeros(n, np.float32)
    drop = np.zeros(n, np.float32)
    nrm = np.zeros((3, n))
    nrm[1], nrm[2] = ny, nz
    mirror = np.zeros(n, bool)
    if len(fl):
        f = w.floor
        lev = np.full(len(fl), f.level, np.float32)
        rough = np.full(len(fl), f.rough, np.float32)
        for v0, v1, lv, ro in f.bands:
            m = (v >= v0) & (v < v1)
            lev[m], rough[m] = lv, ro
        c = np.clip((s[fl] / 0.05).astype(int), 0, w._floor_noise.shape[0] - 1)
        e = np.clip((v / 0.05).astype(int), 0, w._floor_noise.shape[1] - 1)
        lev += f.noise * w._floor_noise[c, e] + f.grain * rng.standard_normal(len(fl)).astype(np.float32)
        up = np.abs(rng.standard_normal(len(fl))) * rough
        kk = np.full(len(fl), f.kr, np.float32)
        for ps, pv, pa, pb in f.puddles:
            q = ((s[fl] - ps) / pa) ** 2 + ((v - pv) / pb) ** 2 + 0.25 * w._floor_noise[c, e]
            m = q < 1
            lev[m] -= 6.0
            kk[m] = 0.05
            up[m] = 0
            pud = fl[m]
            film[pud] = 1.0
            mirror[pud] = True
            damp = (q >= 1) & (q < 1.8)
            lev[damp] -= 3.0
        level[fl], kr[fl] = lev, kk
        t[fl] -= np.minimum(up / cosn[fl], 0.25)
        # rough ground: normals of stones scatter
        tilt = np.clip(rough * 12, 0, 0.5)
        nrm[0, fl] += tilt * rng.standard_normal(len(fl))
        nrm[1, fl] += tilt * rng.standard_normal(len(fl))
    s = os + t * ds
    u = u + (t - t0) * dtan
    if len(idx):
        sl, ul = s[idx], u[idx]
        gs, gu = w._grad
        a, b = _lookup(gs, sh, sl, ul), _lookup(gu, sh, sl, ul)
        nrm[0, idx] = -a
        nrm[1, idx] = ny[idx] - b * ty[idx]
        nrm[2, idx] = nz[idx] - b * tz[idx]
        level[idx] = _lookup(sh.level, sh, sl, ul)
        kr[idx] = _lookup(sh.kr, sh, sl, ul)
        ks[idx] = _lookup(sh.ks, sh, sl, ul)
        drop[idx] = _lookup(sh.drop, sh, sl, ul)
        film[idx] = _lookup(sh.film, sh, sl, ul)
    kind = np.where(lin, 0, 1).astype(np.int8)
    # things in front
    if w.objects:
        oo = w.objects
        best, who, on = nearest(oo, os, oy, oz, ds, dy, dz, t)
        m = who >= 0
        lv = np.array([o.level for o in oo], np.float32)
        k1 = np.array([o.kr for o in oo], np.float32)
        k2 = np.array([o.ks for o in oo], np.float32)
        # the rim of the beam: where it sees something else than its middle
        r = np.minimum(best, t)
        foot = w.inst.spot + w.inst.spread * r
        turn = rng.uniform(-1, 1, n) * foot / np.maximum(r * np.hypot(dy, dz), 0.05)
        ct, st = np.cos(turn), np.sin(turn)
        best2, who2, _ = nearest(oo, os, oy, oz, ds, dy * ct - dz * st, dy * st + dz * ct, t)
        mixed = (who != who2) & (np.abs(best2 - best) > 0.012)
        t_far = np.where(mixed, np.maximum(best, best2), 0)
        t_near = np.where(mixed, np.minimum(best, best2), 0)
        t = best
        s = os + t * ds
        level[m], kr[m], ks[m] = lv[who[m]], k1[who[m]], k2[who[m]]
        film[m] = 0
        drop[m] = 0
        mirror[m] = False
        nrm[:, m] = on[:, m]
        kind[m] = 2
        share = rng.uniform(0.1, 0.9, n)
        # echoes closer than half a metre run together, others leave the first one alone, weakened
        close = mixed & (t_far - t_near < 0.5)
        t = np.where(close, t_near * share + t_far * (1 - share), np.where(mixed, t_near, t))
        level = np.where(mixed & ~close, level + 10 * np.log10(share), level).astype(np.float32)
        kind[mixed] = 3
        s = os + t * ds
    return {
        "t": t,
        "s": s,
        "u": u,
        "level": level,
        "kr": kr,
        "ks": ks,
        "drop": drop,
        "film": film,
        "nrm": nrm,
        "kind": kind,
        "mirror": mirror,
    }


def _prepare(w: Works, rng):
    sh = w.sheet
    d = ndimage.gaussian_filter(sh.disp, 0.7) if np.ptp(sh.disp) > 0 else sh.disp
    gs, gu = np.gradient(d, sh.h)
    lim = 2.5
    w._grad = (np.clip(gs, -lim, lim).astype(np.float32), np.clip(gu, -lim, lim).astype(np.float32))
    girth = sh.sec.around - sh.sec.girth
    a = ndimage.gaussian_filter(rng.standard_normal((int(sh.length / 0.05) + 2, int(girth / 0.05) + 2)), 3)
    w._floor_noise = (a / a.std()).astype(np.float32)


def _thin(key, rng):
    """One of the points of each cell, by chance."""
    p = rng.permutation(len(key))
    _, first = np.unique(key[p], return_index=True)
    return p[first]


def static_scan(w: Works, stations, step=0.11, cell=0.028, floor_cell=0.045, low=-62.0, bias=None, most=38):
    """Scans from `stations` (s, y, z). `bias`: dB of each station."""
    rng = np.random.default_rng(w.seed)
    _prepare(w, rng)
    sh, sec = w.sheet, w.sheet.sec
    az = np.radians(np.arange(0, 360, step))
    el = np.radians(np.arange(low, 90, step))
    ce, se = np.cos(el), np.sin(el)
    out = []
    for k, (s0, y0, z0) in enumerate(stations):
        tab = sec.table(y0, z0)
        keep = []
        block = max(1, int(4e5 / len(el)))
        for i in range(0, len(az), block):
            a = az[i : i + block] + rng.uniform(0, 1e-4)
            ds = (np.cos(a)[:, None] * ce).ravel()
            dy = (np.sin(a)[:, None] * ce).ravel()
            dz = np.broadcast_to(se, (len(a), len(el))).ravel()
            t, s, u, seg = meet(sec, tab, y0, z0, s0, ds, dy, dz)
            ok = (t > 1.0) & (t < 25.3) & (s > -0.05) & (s < sh.length + 0.05)
            j = np.nonzero(ok)[0]
            if not len(j):
                continue
            c = np.where(seg[j] < sec.k, cell, floor_cell)
            key = ((s[j] + 1) / c).astype(np.int64) * 100000 + (u[j] / c).astype(np.int64) + np.where(seg[j] < sec.k, 0, 50000)
            m = j[_thin(key, rng)]
            keep.append(np.stack([ds[m], dy[m], dz[m], t[m], s[m], u[m], seg[m], (i + m // len(el)) * 1.0]))
        q = np.concatenate(keep, 1)
        c = np.where(q[6] < sec.k, cell, floor_cell)
        key = ((q[4] + 1) / c).astype(np.int64) * 100000 + (q[5] / c).astype(np.int64) + np.where(q[6] < sec.k, 0, 50000)
        q = q[:, _thin(key, rng)]
        ds, dy, dz = q[0], q[1], q[2]
        r = _shoot(w, sec, s0, y0, z0, ds, dy, dz, (q[3], q[4], q[5], q[6].astype(np.int32)), rng)
        n = len(ds)
        o = np.broadcast_to(np.array([s0, y0, z0]), (n, 3))
        time = 1000.0 + 420.0 * k + q[7] * (180.0 / len(az))
        gain = (bias[k] if bias is not None else 0.0) + w.inst.slow * np.sin(q[7] / len(az) * 2 * np.pi + k)
        out.append(_record(w, r, o, ds, dy, dz, time, gain, np.full(n, k + 1), rng))
    return _capped(_join(out), rng, most=most)


def _capped(pts, rng, cell=0.1, most=38):
    """What an export filter leaves: no more than `most` points in a cell of the lining."""
    lin = np.nonzero(pts["kind"] == 0)[0]
    key = (pts["s"][lin] / cell).astype(np.int64) * 100000 + (pts["u"][lin] / cell).astype(np.int64)
    p = rng.permutation(len(lin))
    o = p[np.argsort(key[p], kind="stable")]
    k = key[o]
    start = np.r_[0, np.nonzero(np.diff(k))[0] + 1]
    rank = np.arange(len(k)) - np.repeat(start, np.diff(np.r_[start, len(k)]))
    keep = np.ones(len(pts["s"]), bool)
    keep[lin[o[rank >= most]]] = False
    return {a: b[keep] for a, b in pts.items()}


def mobile_scan(w: Works, passes, rate, spacing, tilt=0.0, wander=0.04, gap=60.0, traffic=()):
    """Profiles of a scanner on a vehicle. `passes`: (y, z, speed, direction) of each pass; `rate` profiles a second.

    `traffic`: (pass, box) – what else was in the tunnel during one pass only.
    """
    rng = np.random.default_rng(w.seed)
    _prepare(w, rng)
    sh, sec = w.sheet, w.sheet.sec
    out, track = [], []
    t_start = 20000.0
    home = list(w.objects)
    for k, (yc, zc, speed, sign) in enumerate(passes):
        lead = 2.5 + 6.0 * np.tan(np.radians(abs(tilt)))
        dur = (sh.length + 2 * lead) / speed
        tick = np.arange(0, dur + 0.2, 0.05)
        ph = rng.uniform(0, 6.28, 6)

        def where(tt, yc=yc, zc=zc, speed=speed, sign=sign, ph=ph, lead=lead):
            x = speed * (tt + 0.06 * np.sin(0.9 * tt + ph[0])) - lead
            s = x if sign > 0 else sh.length - x
            y = yc + wander * (0.7 * np.sin(0.30 * x + ph[1]) + 0.3 * np.sin(0.9 * x + ph[2]))
            z = zc + 0.3 * wander * np.sin(0.7 * x + ph[3])
            return s, y, z

        ts, tyv, tzv = where(tick)
        track.append(np.column_stack([t_start + tick, w.axis.world(ts, tyv, tzv)]))
        pt = np.arange(0, dur, 1.0 / rate)
        ps, py, pz = where(pt)
        mean_r = sec.around / (2 * np.pi)
        m = int(2 * np.pi * mean_r / spacing)
        # tables at every half metre of the way
        kk = np.floor((ps - ps.min()) / 0.5).astype(int)
        tabs, rows = [], {}
        for c in np.unique(kk):
            sel = kk == c
            rows[c] = len(tabs)
            tabs.append(sec.table(py[sel].mean(), pz[sel].mean(), 3600))
        tabs = np.stack(tabs)
        rowid = np.array([rows[c] for c in kk])
        ang = np.arange(m) / m * 2 * np.pi
        w.objects = home + [b for p, b in traffic if p == k]
        tl = np.radians(tilt) * sign
        chunk = max(1, int(3e5 / m))
        for i in range(0, len(pt), chunk):
            j = np.arange(i, min(i + chunk, len(pt)))
            a = ang[None] + rng.uniform(0, 2 * np.pi / m, (len(j), 1))
            dy0, dz = np.cos(a).ravel(), np.sin(a).ravel()
            ds = dy0 * np.sin(tl)
            dy = dy0 * np.cos(tl)
            rep = np.repeat(j, m)
            os, oy, oz = ps[rep], py[rep], pz[rep]
            t, s, u, seg = meet_rows(sec, tabs, rowid[rep], oy, oz, os, ds, dy, dz)
            ok = (t > 1.0) & (t < 25.3) & (s > -0.05) & (s < sh.length + 0.05)
            g = np.nonzero(ok)[0]
            if not len(g):
                continue
            r = _shoot(w, sec, os[g], oy[g], oz[g], ds[g], dy[g], dz[g], (t[g], s[g], u[g], seg[g]), rng)
            tm = t_start + pt[rep[g]] + (a.ravel()[g] % (2 * np.pi)) / (2 * np.pi) / rate
            gain = w.inst.slow * np.sin(0.35 * pt[rep[g]] * speed / 3 + 2.0 * k)
            o = np.stack([os[g], oy[g], oz[g]], 1)
            out.append(_record(w, r, o, ds[g], dy[g], dz[g], tm, gain, np.full(len(g), k + 1), rng))
        t_start += dur + gap
    w.objects = home
    return _join(out), np.concatenate(track)


def _record(w: Works, r, o, ds, dy, dz, time, gain, src, rng):
    """Amplitudes and positions of what was hit."""
    ax, inst, sh = w.axis, w.inst, w.sheet
    t, n = r["t"], len(r["t"])
    noise = rng.normal(0, 1, n) * inst.sigma
    s, y, z = o[:, 0] + t * ds, o[:, 1] + t * dy, o[:, 2] + t * dz
    p = ax.world(s, y, z)
    q = ax.world(o[:, 0], o[:, 1], o[:, 2])
    ray = p - q
    rng_m = np.linalg.norm(ray, axis=1)
    ray /= rng_m[:, None]
    nw = ax.turn(s, *r["nrm"])
    nw /= np.maximum(np.linalg.norm(nw, axis=1), 1e-9)[:, None]
    cos = np.abs((nw * ray).sum(1))
    wetness = np.clip(r["drop"] / 4.0, 0, 1)
    kr = r["kr"] * (1 - 0.6 * wetness)
    back = returned(cos, r["level"] - r["drop"], kr, r["ks"] * (1 - 0.5 * wetness), r["film"], w.film_gain)
    dry = returned(cos, r["level"], r["kr"], r["ks"])
    clean = inst.const + inst.of_range(rng_m) + back
    # a film on a slope throws the beam on; what comes back by the other wall lies behind the surface and is weak
    ghost = np.zeros(n, bool)
    wet = (r["film"] > 0.6) & (r["kind"] < 2)
    if wet.any():
        j = np.nonzero(wet & (rng.random(n) < np.where(r["mirror"], 0.25, 0.012)))[0]
        extra = rng.gamma(3.0, 1.0, len(j)) + 0.3
        rng_m[j] += extra
        p[j] += ray[j] * extra[:, None]
        clean[j] += -9.0 - rng.gamma(2.0, 1.5, len(j)) - 20 * np.log10(rng_m[j] / (rng_m[j] - extra))
        ghost[j] = True
    kind = r["kind"].copy()
    kind[ghost] = 4
    spread = np.hypot(inst.speckle, 2.2 * 10 ** (-np.maximum(clean - inst.floor, -3) / 20))
    amp = clean + gain + rng.normal(0, 1, n) * spread
    p = p + ray * (noise * (1 + 0.5 * (1 / np.maximum(cos, 0.15) - 1)) * (1 + 1.5 * (kind == 3)))[:, None]
    keep = (rng_m > 1.5) & (rng_m < 25.0) & (amp > inst.floor) & (s > 0) & (s < sh.length)
    f = {
        "xyz": p,
        "amp": amp,
        "clean": clean,
        "range": rng_m,
        "cos": cos,
        "s": s,
        "u": r["u"],
        "kind": kind,
        "time": time,
        "src": src,
        "dry": inst.const + inst.of_range(rng_m) + dry,
        "drop": r["drop"],
    }
    return {k: v[keep] for k, v in f.items()}


def _join(parts):
    return {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}


# ---------------------------------------------------------------------------------------------------------------- truth and files


def _unseen(w: Works, pts, cell=0.02, wide=0.15):
    """Lining behind things wider than `wide`, on a raster of `cell`."""
    sh = w.sheet
    n0, n1 = int(np.ceil(sh.length / cell)), int(np.ceil(sh.girth / cell))
    m = pts["kind"] == 0
    i = np.clip((pts["s"][m] / cell).astype(int), 0, n0 - 1)
    j = np.clip((pts["u"][m] / cell).astype(int), 0, n1 - 1)
    has = np.zeros((n0, n1), bool)
    has[i, j] = True
    d = ndimage.distance_transform_edt(~has) * cell
    core = d > wide / 2
    if not core.any():
        return core, cell
    return (ndimage.distance_transform_edt(~core) * cell < wide / 2 - 0.005) & (d > 0.02), cell


def _fit(mask, win, wide, cell, h):
    i = ((np.arange(win.i0, win.i1) + 0.5) * h / cell).astype(int)
    j = ((np.arange(win.j0, win.j1) + 0.5) * h / cell).astype(int)
    return mask & ~wide[np.minimum(i, wide.shape[0] - 1)][:, np.minimum(j, wide.shape[1] - 1)]


def _solid(w: Works, poly, base):
    """Rings of a polygon in (s, u) as coordinates in the world."""
    sh = w.sheet
    out = []
    for g in getattr(poly, "geoms", [poly]):
        rings = []
        for ring in [g.exterior, *g.interiors]:
            c = shapely.get_coordinates(shapely.segmentize(ring, 0.03))
            s, u = np.clip(c[:, 0], 0.001, sh.length - 0.001), np.clip(c[:, 1], 0.001, sh.girth - 0.001)
            y, z = sh.sec.at(u)
            ny, nz = sh.sec.inward(u)
            d = 0.0 if base is None else _bilinear(base, sh, s, u)
            p = w.axis.world(s, y + d * ny, z + d * nz)
            rings.append(np.round(p, 4).tolist())
        out.append(rings)
    return out


def truths(w: Works, pts, smallest=0.002):
    """Leaks and other things as features, with the drop that the data has without noise."""
    sh = w.sheet
    h = sh.h
    wide, cell = _unseen(w, pts)
    base = None
    if w.truth_relief >= 0:
        base = ndimage.gaussian_filter(sh.disp, w.truth_relief / h) if w.truth_relief > 0 else sh.disp
    # waters that touch are one
    marks = _united(sh.leaks, h)
    lin = pts["kind"] == 0
    i = np.clip((pts["s"][lin] / h).astype(np.int32), 0, sh.ns - 1)
    j = np.clip((pts["u"][lin] / h).astype(np.int32), 0, sh.nu - 1)
    c = pts["cos"][lin]
    flat = (pts["clean"][lin] - w.inst.const - w.inst.of_range(pts["range"][lin]) - 10 * np.log10(lobes(c, sh.own_kr))).astype(
        np.float32
    )
    label = np.zeros(sh.shape, np.int16)
    leaks = []
    for m in marks:
        mask = _fit(m.mask, m.win, wide, cell, h)
        poly = outline(mask, m.win, h)
        poly = shapely.union_all([g for g in getattr(poly, "geoms", [poly]) if g.area > smallest])
        if poly.is_empty:
            continue
        leaks.append((m, mask, poly))
        label[m.win.cut][mask] = len(leaks)
    others = np.zeros(sh.shape, bool)
    for m in sh.others:
        if m.mask.sum() * h * h < 4.0:  # fields of a tone of their own are lining
            others[m.win.cut] |= m.mask
    any_leak = label > 0
    features, table = [], []
    lab = label[i, j]
    for k, (m, mask, poly) in enumerate(leaks, 1):
        g = int(0.6 / h)
        a0, a1 = max(0, m.win.i0 - g), min(sh.ns, m.win.i1 + g)
        b0, b1 = max(0, m.win.j0 - g), min(sh.nu, m.win.j1 + g)
        box = (i >= a0) & (i < a1) & (j >= b0) & (j < b1)
        far = ndimage.distance_transform_edt(label[a0:a1, b0:b1] != k) * h
        ring = (
            (far > 0.08)
            & (far < 0.5)
            & ~ndimage.binary_dilation(any_leak[a0:a1, b0:b1], iterations=int(0.06 / h))
            & ~others[a0:a1, b0:b1]
        )
        bi = np.nonzero(box)[0]
        inside = flat[bi[lab[bi] == k]]
        around = flat[bi[ring[i[bi] - a0, j[bi] - b0]]]
        if len(inside) < 3 or len(around) < 20:
            drop = float(np.median(sh.drop[m.win.cut][mask])) if mask.any() else 0.0
        else:
            drop = float(around.mean() - inside.mean())
        contrast = drop / max(float(around.std()), 1e-3) if len(around) else 0.0
        props = {"id": f"W{len(features) + 1:02d}", "drop_db": round(drop, 2), "phenomenon": m.props["phenomenon"]}
        if "limit" in m.props:
            props["limit"] = m.props["limit"]
        features.append(_feature(w, poly, base, props))
        table.append(
            {
                **props,
                "area": float(poly.area),
                "sd": float(around.std()) if len(around) else 0.0,
                "contrast": contrast,
                "poly": poly,
                "paint": float(np.mean(sh.drop[m.win.cut][mask])) if mask.any() else 0.0,
            }
        )
    rest, kinds = [], []
    merged: dict[str, list] = {}
    water = shapely.union_all([poly for _, _, poly in leaks]) if leaks else shapely.Polygon()
    for m in sh.others:
        coarse = 1 if m.mask.size < 4e5 else 4
        poly = outline(m.mask, m.win, h, coarse).difference(water)
        poly = shapely.union_all([g for g in getattr(poly, "geoms", [poly]) if g.area > smallest])
        if poly.is_empty:
            continue
        if m.props.get("many"):
            merged.setdefault(m.name, []).append(poly)
        else:
            rest.append(_feature(w, poly, base, {"id": f"O{len(rest) + 1:03d}", **m.props}))
            kinds.append((m.name, float(poly.area), poly))
    for name, polys in merged.items():
        poly = shapely.union_all(polys)
        rest.append(_feature(w, poly, base, {"id": f"O{len(rest) + 1:03d}", "kind": name}))
        kinds.append((name, float(poly.area), poly))
    return features, rest, table, kinds


def _united(marks, h):
    """Leaks whose masks touch become one; it is called after the greater."""
    marks = list(marks)
    again = True
    while again:
        again = False
        for a in range(len(marks)):
            for b in range(a + 1, len(marks)):
                p, q = marks[a], marks[b]
                i0, i1 = max(p.win.i0, q.win.i0), min(p.win.i1, q.win.i1)
                j0, j1 = max(p.win.j0, q.win.j0), min(p.win.j1, q.win.j1)
                if i0 >= i1 or j0 >= j1:
                    continue
                x = p.mask[i0 - p.win.i0 : i1 - p.win.i0, j0 - p.win.j0 : j1 - p.win.j0]
                y = q.mask[i0 - q.win.i0 : i1 - q.win.i0, j0 - q.win.j0 : j1 - q.win.j0]
                if not (ndimage.binary_dilation(x, iterations=2) & y).any():
                    continue
                big, small = (p, q) if p.mask.sum() >= q.mask.sum() else (q, p)
                w = type(p.win)(
                    min(p.win.i0, q.win.i0), max(p.win.i1, q.win.i1), min(p.win.j0, q.win.j0), max(p.win.j1, q.win.j1), h
                )
                m = np.zeros(w.shape, bool)
                for r in (p, q):
                    m[r.win.i0 - w.i0 : r.win.i1 - w.i0, r.win.j0 - w.j0 : r.win.j1 - w.j0] |= r.mask
                m = ndimage.binary_closing(np.pad(m, 4), iterations=3)[4:-4, 4:-4] | m
                props = dict(big.props)
                if "limit" in props and "limit" not in small.props:
                    del props["limit"]
                marks[a] = type(p)(big.name, w, m, props)
                del marks[b]
                again = True
                break
            if again:
                break
    return marks


def _feature(w, poly, base, props):
    c = _solid(w, poly, base)
    geom = {"type": "Polygon", "coordinates": c[0]} if len(c) == 1 else {"type": "MultiPolygon", "coordinates": c}
    return {"type": "Feature", "properties": props, "geometry": geom}


def _geojson(path: Path, name, features):
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
    path.write_text(json.dumps({"type": "FeatureCollection", "name": name, "crs": crs, "features": features}), encoding="utf-8")


def _table(path: Path, head, rows, digits=4):
    with path.open("w", newline="", encoding="utf-8") as f:
        out = csv.writer(f)
        out.writerow(head)
        for r in rows:
            out.writerow([v if isinstance(v, (int, str)) else round(float(v), digits) for v in r])


def write(folder: Path, w: Works, pts, stations=None, track=None, reference=True, axis_step=4.0, before=2.0, after=2.0):
    """Writes all files of a scene; returns the tables of truth."""
    folder = Path(folder)
    xyz = pts["xyz"]
    head = laspy.LasHeader(version="1.4", point_format=6)
    head.add_crs(pyproj.CRS.from_epsg(25832))
    head.scales = np.full(3, 0.0005)
    head.offsets = np.floor(xyz.min(0))
    head.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
    head.system_identifier = "terrestrial scanner" if stations is not None else "profiler"
    head.generating_software = "survey"
    las = laspy.LasData(head)
    order = np.argsort(pts["time"], kind="stable")
    xyz = xyz[order]
    las.x, las.y, las.z = xyz[:, 0], xyz[:, 1], xyz[:, 2]
    las.Amplitude = pts["amp"][order].astype(np.float32)
    las.intensity = np.clip(pts["amp"][order] * 1000, 0, 65535).astype(np.uint16)
    las.gps_time = pts["time"][order]
    las.point_source_id = (pts["src"][order] if stations is not None else np.ones(len(order))).astype(np.uint16)
    las.return_number = np.ones(len(order), np.uint8)
    las.number_of_returns = np.ones(len(order), np.uint8)
    las.write(str(folder / "scan.laz"), laz_backend=laspy.LazBackend.Lazrs)
    n = max(2, int(round((w.sheet.length + before + after) / axis_step)) + 1)
    _table(folder / "axis.csv", ("x", "y", "z"), w.axis.world(np.linspace(-before, w.sheet.length + after, n), 0.0, 0.0))
    if stations is not None:
        p = [w.axis.world(*s) for s in stations]
        _table(folder / "stations.csv", ("scan_id", "x", "y", "z"), [(k + 1, *q) for k, q in enumerate(p)])
    if track is not None:
        _table(folder / "trajectory.csv", ("time", "x", "y", "z"), track)
    if reference:
        r, a = w.inst.reference()
        _table(folder / "reference.csv", ("range_m", "intensity_db"), zip(r, a), 3)
    leaks, rest, table, kinds = truths(w, pts)
    _geojson(folder / "truth.geojson", "truth", leaks)
    _geojson(folder / "other.geojson", "other", rest)
    return table, kinds
