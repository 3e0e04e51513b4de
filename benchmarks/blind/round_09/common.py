"""What several tunnels have in common: textures of concrete, cables, stains, and the run of a scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy import ndimage

from . import survey
from .sheet import smooth_step
from .tube import Box, Tube


def cast_texture(sh, joints, tone=0.35, scale=1.0, plates=1.5, lifts=None):
    """Concrete from a steel form: a tone for each block, lifts of its pour, imprints of plates, mottling."""
    rng = sh.rng
    edges = [0.0, *[j for j in joints if 0 < j < sh.length], sh.length]
    w = sh.all
    for a, b in zip(edges[:-1], edges[1:]):
        c = sh.window(a, b, 0, sh.girth)
        sh.level[c.cut] += np.float32(rng.normal(0, tone))
        for side in (-1, 1):
            # lifts: the pour rises on both sides; each lift has a tone and an uneven top
            foot = sh.foot(side)
            top = 0.0
            reach = sh.crown if side < 0 else sh.girth - sh.crown
            while top < reach - 1.0:
                top += rng.uniform(0.9, 2.2)
                u0, u1 = (foot, foot + top) if side < 0 else (foot - top, foot)
                q = sh.window(a, b, max(0, u0 - 0.4), min(sh.girth, u1 + 0.4))
                edge = 0.12 * random_line(sh, q)
                d = (u1 + edge - q.u) if side < 0 else (q.u - (u0 + edge))
                sh.level[q.cut] += (rng.normal(0, 0.22 if lifts is None else lifts) * smooth_step(d / 0.10 + 0.5)).astype(
                    np.float32
                )
    if plates:
        for s in np.arange(plates / 2, sh.length, plates):
            sh.hoop(s + rng.normal(0, 0.003), 0, sh.girth, 0.012, rng.normal(-0.25, 0.15), 0.001)
    sh.mottle((3.0 * scale, 0.28), (0.9 * scale, 0.24), (0.25 * scale, 0.20), (0.06, 0.20))
    sh.level += np.float32(0.18) * sh.rng.standard_normal(sh.shape).astype(np.float32)
    # dirt that runs down walls
    run = sh.noise(0.05, 1.6) * np.clip(np.abs(sh.steep), 0, 1)[None]
    sh.level += np.float32(0.16) * run
    return w


def random_line(sh, w):
    """A line along s that wanders about zero, unit variance, as a column."""
    n = w.shape[0]
    c = ndimage.gaussian_filter1d(sh.rng.standard_normal(n + 400), 40)[200 : 200 + n]
    return (c / max(c.std(), 1e-6)).astype(np.float32)[:, None]


def sooty_crown(sh, depth, width, off=0.0, patchy=0.3):
    """Soot about the crown, thick in the middle, without an edge."""
    d = (np.arange(sh.nu) + 0.5) * sh.h - sh.crown - off
    p = np.exp(-((d / width) ** 2)).astype(np.float32)[None]
    sh.level -= depth * p * (1 + patchy * sh.noise(1.2, 0.8))


def dirty_foot(sh, side, depth, height, fade=0.25, wave=0.06, kind="splash zone"):
    """A band of dirt along the foot of a wall, as high all along."""
    w = sh.window(0, sh.length, 0, height + 1) if side < 0 else sh.window(0, sh.length, sh.girth - height - 1, sh.girth)
    up = w.u if side < 0 else sh.girth - w.u
    e = height + wave * random_line(sh, w) * 0.5 + 0.03 * sh.noise(0.3, win=w)
    a = smooth_step((e - up) / fade + 0.5)
    sh.level[w.cut] -= (depth * a * (1 + 0.2 * sh.noise(0.5, 0.2, w))).astype(np.float32)
    sh.other(kind, w, a > 0.5)


def drip_stains(sh, spots, dlevel, length, n=60, kind="dirt run", blur=0.012):
    """Narrow dry runs below brackets, bolts and edges."""
    for s, u in spots:
        k = sh.rng.uniform(0.5, 1.3)
        part = sh.run(s, u, length * k, n=n, blur=blur, unrest=0.02, braid=0.08, width=0.012, fill=2.0)
        sh.stain(part, dlevel * sh.rng.uniform(0.6, 1.2), kind, record=0.35)


def clips(sh, u, pitch, s0=0.4, size=0.05, out=0.06, level=-7.0, kr=0.2):
    """Brackets of a cable: small plates on the wall."""
    at = np.arange(s0, sh.length - 0.2, pitch)
    for s in at:
        sh.rect(s - size / 2, s + size / 2, u - size, u + size, 0, out, 0.004, level=level, kr=kr)
    return at


def cables(sec, u, off, r, n, length, rng, pitch=1.5, sag=0.02, gap=0.055, level=-11.0, s0=0.0):
    """`n` cables one above another, `off` the lining, the first at arc length `u`, going up."""
    out = []
    for k in range(n):
        side = -1 if u < sec.crown else 1
        uk = u - side * k * gap
        y, z = sec.at(uk)
        ny, nz = sec.inward(np.array(uk))
        out.append(
            Tube(
                float(y + off * ny),
                float(z + off * nz),
                r * rng.uniform(0.8, 1.2),
                s0,
                length,
                level + rng.normal(0, 0.6),
                0.15,
                0.02,
                sag * rng.uniform(0.6, 1.3),
                pitch,
            )
        )
    return out


def rails(y, z, length, gauge=1.435):
    return [Box(y + k * (gauge / 2 + 0.035), z, 0.035, 0.085, -0.1, length + 0.1, 0.0, -9.0, 0.05, 0.4) for k in (-1, 1)]


def on_wall(sec, u, off, along_half, depth, s0, s1, level=-6.0, ks=0.05):
    """A box on the lining: `along_half` half its height on the wall, `depth` half its depth, centre `off` the wall."""
    y, z = sec.at(u)
    ny, nz = sec.inward(np.array(u))
    rot = float(np.degrees(np.arctan2(nz, ny)))
    return Box(float(y + off * ny), float(z + off * nz), depth, along_half, s0, s1, rot, level, 0.2, ks)


def scan(build, folder: Path):
    """Builds, scans and writes a scene; returns what was made, for pictures."""
    w, how = build()
    if how["kind"] == "static":
        pts = survey.static_scan(
            w,
            how["stations"],
            how.get("step", 0.11),
            how.get("cell", 0.028),
            how.get("floor_cell", 0.05),
            bias=how.get("bias"),
            most=how.get("most", 38),
        )
        table, kinds = survey.write(folder, w, pts, stations=how["stations"], reference=how.get("reference", True))
    else:
        pts, track = survey.mobile_scan(
            w,
            how["passes"],
            how["rate"],
            how["spacing"],
            how.get("tilt", 0.0),
            how.get("wander", 0.04),
            traffic=how.get("traffic", ()),
        )
        table, kinds = survey.write(folder, w, pts, track=track)
    return w, pts, table, kinds


def maker(build):
    def make(folder: Path) -> None:
        scan(build, Path(folder))

    return make


def blotches(sh, n, depth, size=(0.3, 0.9), kind="blotch", zone=None, rough=0.5, fringe=0.9):
    """Dry uneven patches of another tone: release oil, laitance, old dirt."""
    for _ in range(n):
        s = sh.rng.uniform(0.5, sh.length - 0.5)
        u = sh.rng.uniform(*(zone or (0.6, sh.girth - 0.6)))
        a, b = sh.rng.uniform(*size, 2)
        w, q = sh.blob(s, u, a, b, rough, fringe, 0.35)
        d = sh.rng.normal(depth, 0.25 * abs(depth))
        sh.level[w.cut] += (d * q * (1 + 0.3 * sh.noise(0.12, win=w))).astype(np.float32)
        if abs(d) > 0.6:
            sh.other(kind, w, q > 0.5)


def old_runs(sh, spots, dlevel, length, kind="old run, dry", width=0.05, n=200, blur=0.018, rim=0.9, core=0.9):
    """Where water once ran: dirt without a film, between pale rims of lime and with lime where most of it ran."""
    for s, u in spots:
        w, a = sh.run(s, u, length * sh.rng.uniform(0.5, 1.4), n=n, blur=blur, width=width, fill=2.4)
        sh.stain((w, a), dlevel * sh.rng.uniform(0.6, 1.2), kind, record=0.35)
        e = np.exp(-(((a - 0.14) / 0.08) ** 2)) * smooth_step(0.5 + 0.8 * sh.noise(0.2, 0.4, w))
        sh.level[w.cut] += (rim * e + core * smooth_step((a - 0.75) / 0.2)).astype(np.float32)
