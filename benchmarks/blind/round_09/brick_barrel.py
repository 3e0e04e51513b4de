"""A single-track railway tunnel of brick, built in lengths in the 1860s. Three stations, 1064 nm, no reference curve."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from .common import cables, drip_stains, old_runs, rails, random_line
from .sheet import Sheet, smooth_step
from .survey import Floor, Instrument, Works
from .tube import Axis, Section, Tube, arc, chain, line

LENGTH, R, WALL, FOOT = 27.0, 2.45, 14.0, -2.75
BRICK, COURSE, JOINT = 0.230, 0.076, 0.011


def section():
    a = float(np.degrees(np.arcsin(-FOOT / WALL)))
    right = arc(R - WALL, 0, WALL, 0, -a)
    left = arc(WALL - R, 0, WALL, 180 + a, 180)
    floor = chain(
        line((right[-1, 0], FOOT), (1.5, FOOT - 0.05)), line((1.5, FOOT - 0.05), (-1.5, FOOT - 0.05)), (left[0, 0], FOOT)
    )
    return Section(chain(left, arc(0, 0, R, 180, 0), right), floor)


def bricks(sh, w, bond=0):
    """Number of brick and whether in the mortar, over a window."""
    v = w.u + 0.004 * np.sin(w.s * 1.3) + 0.003 * np.sin(w.s * 4.1)
    row = np.floor(v / COURSE).astype(int)
    odd = row % 2
    # English bond: stretchers and headers by turns
    size = np.where(odd == 1, BRICK, BRICK / 2)
    x = w.s + np.where(odd == 1, 0.0, BRICK / 4) + bond
    col = np.floor(x / size).astype(int)
    mortar = (np.mod(v, COURSE) < JOINT) | (np.mod(x, size) < JOINT)
    return (row * 7919 + col * 104729) % 65521, mortar


def build():
    sec = section()
    sh = Sheet(sec, LENGTH, -5.0, kr=0.35, seed=90503)
    rng = sh.rng
    cr = sh.crown
    left, right = (lambda z: sh.u_of(z, -1)), (lambda z: sh.u_of(z, 1))
    w = sh.all
    ident, mortar = bricks(sh, w)
    tone = rng.normal(0, 0.55, 65521).astype(np.float32)
    tone[rng.random(65521) < 0.04] -= 1.3  # overburnt headers
    set_back = np.abs(rng.normal(0, 0.0025, 65521)).astype(np.float32)
    brick_tone = tone[ident]
    sh.level += np.where(mortar, 0.9, brick_tone).astype(np.float32)
    sh.disp += np.where(mortar, -0.007, -set_back[ident]).astype(np.float32)
    sh.mottle((2.2, 0.4), (0.7, 0.3), (0.2, 0.22), (0.04, 0.25))
    # lengths of building: each with its bricks; a ragged step at their ends
    ends = [4.1, 8.6, 13.2, 17.5, 22.1]
    for a, b in zip([0, *ends], [*ends, LENGTH]):
        q = sh.window(a, b, 0, sh.girth)
        sh.level[q.cut] += np.float32(rng.normal(0, 0.4))
        sh.disp[q.cut] += np.float32(rng.normal(0, 0.006))
    for e in ends:
        sh.hoop(e, 0, sh.girth, 0.02, -0.8, -0.012, 0.012)
    # soot: thick in the vault, thin on the walls, gone where faces have come off
    d = np.abs((np.arange(sh.nu) + 0.5) * sh.h - cr)[None].astype(np.float32)
    soot = 3.2 * smooth_step((3.3 - d + 0.45 * sh.noise(1.6, 0.8)) / 2.6) + 0.5
    lost = np.zeros(sh.shape, bool)
    for _ in range(26):  # faces of bricks that came off, in groups
        s, u = rng.uniform(0.5, LENGTH - 0.5), cr + rng.normal(0, 2.2)
        q, a = sh.blob(s, u, rng.uniform(0.1, 0.35), rng.uniform(0.08, 0.25), 0.5, 0.3)
        m = a > 0.5
        # whole bricks
        idq = ident[q.cut]
        share = np.bincount(idq.ravel(), m.ravel(), 65521) / np.maximum(np.bincount(idq.ravel(), minlength=65521), 1)
        m = (share[idq] > 0.5) & ~mortar[q.cut]
        if m.any():
            lost[q.cut] |= m
            sh.other("spalled bricks", q, m, many=True)
    sh.disp -= 0.022 * ndimage.gaussian_filter(lost.astype(np.float32), 0.8)
    sh.level -= np.where(lost, 0.25 * soot - 0.5, soot).astype(np.float32)
    # pointing renewed: pale joints in a field of a rectangle
    for a, b, u0, u1 in ((18.2, 20.6, right(-0.6), right(-2.2)), (5.2, 7.0, left(-0.2), left(-1.6))):
        q = sh.window(a, b, min(u0, u1), max(u0, u1))
        sh.level[q.cut] += np.where(mortar[q.cut], 2.4, 0.0).astype(np.float32)
        sh.disp[q.cut] += np.where(mortar[q.cut], 0.005, 0.0).astype(np.float32)
        sh.other("new pointing", q, np.ones(q.shape, bool))
    # refaced with blue engineering brick: dark, toothed along the courses
    for s0, s1, u0, u1 in (
        (10.0, 11.6, left(0.6), left(-1.2)),
        (23.6, 24.8, right(1.4), right(0.1)),
        (15.2, 16.4, left(2.0), left(1.2)),
    ):
        u0, u1 = min(u0, u1), max(u0, u1)
        q = sh.window(s0 - 0.3, s1 + 0.3, u0, u1)
        row = np.floor(q.u / COURSE).astype(int)
        tooth = np.where(row % 2 == 1, 0.115, 0.0)
        m = (q.s > s0 - tooth) & (q.s < s1 + tooth)
        mm = mortar[q.cut]
        sh.level[q.cut] = np.where(m, np.where(mm, -6.2, -8.4 + 0.5 * brick_tone[q.cut]), sh.level[q.cut])
        sh.kr[q.cut] = np.where(m, 0.15, sh.kr[q.cut])
        sh.ks[q.cut] = np.where(m & ~mm, 0.03, sh.ks[q.cut])
        sh.disp[q.cut] = np.where(m, np.where(mm, -0.004, 0.004), sh.disp[q.cut])
        sh.other("engineering brick", q, m)
    # a refuge, walled up half a brick behind the face
    u0, u1 = left(-0.75), left(-2.6)
    sh.rect(20.2, 21.1, u0, u1, 0.8, -0.11, 0.012, kind="walled-up refuge")
    # concrete over a hole of the former telegraph; rust below hooks; runs of old soot water
    sh.rect(1.4, 1.9, right(1.0), right(0.4), level=-5.0, disp=0.01, soft=0.015, kind="concrete patch")
    hooks = [(s, right(0.75)) for s in np.arange(0.9, LENGTH, 1.8)]
    for s, u in hooks:
        sh.rect(s - 0.02, s + 0.02, u - 0.05, u + 0.03, 0, 0.06, 0.005, level=-8.0, kr=0.1, ks=0.1)
    drip_stains(sh, [(s, u + 0.06) for s, u in hooks if rng.random() < 0.5], -0.9, 0.5, kind="rust run")
    old_runs(
        sh,
        [(4.1, left(0.5)), (13.2, right(1.2)), (22.1, left(1.0)), (17.5, left(-0.2)), (9.9, right(0.2))],
        -1.1,
        1.2,
        width=0.12,
    )
    # lime that has dried: white curtains
    for s, u, n, ln in ((13.2, left(1.6), 260, 1.4), (2.6, left(1.9), 150, 0.8)):
        part = sh.run(s + rng.normal(0, 0.15, 8), np.full(8, u), ln, n=n, blur=0.025, fill=1.8, width=0.06)
        sh.stain(part, 4.0, "dry efflorescence", record=0.4)
        q, a = part
        sh.disp[q.cut] += 0.012 * a
    # tide of a flood: silt below one level on both walls
    for side in (-1, 1):
        u = sh.u_of(-2.28, side)
        q = sh.window(0, LENGTH, 0, u + 0.1) if side < 0 else sh.window(0, LENGTH, u - 0.1, sh.girth)
        dd = (u - q.u) if side < 0 else (q.u - u)
        a = smooth_step((dd + 0.012 * random_line(sh, q)) / 0.03 + 0.5)
        sh.level[q.cut] -= (1.1 * a * (1 + 0.25 * sh.noise(0.6, 0.15, q))).astype(np.float32)
        sh.other("flood mark", q, a > 0.5)
    # weep pipes
    pipes = [(s, sh.u_of(-2.0, side), side) for s in np.arange(2.2, LENGTH, 3.1) for side in (-1, 1)]
    for s, u, _ in pipes:
        sh.disc(s, u, 0.035, 0, -0.06, 0.01, level=-10.0)

    # ---------------------------------------------------------------------------------------------------------------------- water
    # the joint of two lengths
    a = sh.seam([(8.6, left(2.1)), (8.6, left(-2.0))], 0.34, rough=0.6, gaps=0.4)
    b = sh.run(
        8.6 + rng.normal(0, 0.08, 24), np.linspace(left(1.9), left(-0.8), 24), 1.5, n=600, blur=0.03, width=0.08, fill=1.8
    )
    sh.wet(sh.merge(a, b), 4.4, "joint of lengths", film=0.5, salt=2.4, salt_in=2.0, halo=0.12)
    # soaked brickwork in the right haunch
    a = sh.blob(16.1, right(1.3), 1.5, 0.75, rough=0.55, fringe=0.5, scale=0.6)
    b = sh.run(rng.uniform(14.9, 17.2, 30), np.full(30, right(1.0)), 1.5, n=800, blur=0.035, width=0.1, fill=1.3)
    sh.wet(sh.merge(a, b), 3.6, "curtain", film=0.3, halo=0.15, uneven=0.3)
    # smaller, on the left wall
    a = sh.blob(24.6, left(0.1), 0.6, 0.5, rough=0.55, fringe=0.5)
    b = sh.run(rng.uniform(24.2, 25.0, 10), np.full(10, left(-0.1)), 0.9, n=350, blur=0.03, width=0.06, fill=1.4)
    sh.wet(sh.merge(a, b), 3.2, "curtain", film=0.2, halo=0.10, uneven=0.3)
    # the crown, from where it drips
    sh.wet(sh.blob(12.3, cr + 0.3, 0.5, 0.42, rough=0.5, fringe=0.5), 3.0, "drip", film=0.4, halo=0.10)
    # crack along the crown
    c = sh.wander(18.6, cr - 0.6, 3, 2.6, turn=0.2)
    sh.path(c, 0.012, -1.5, -0.01, 0.01)
    sh.wet(sh.seam(c, 0.16, rough=0.6, gaps=0.4), 3.2, "wet crack", film=0.2, halo=0.08)
    # lime with a wet run in it
    a = sh.run(
        22.1 + rng.normal(0, 0.06, 8), np.linspace(right(1.0), right(0.2), 8), 1.4, n=420, blur=0.025, width=0.06, fill=2.0
    )
    sh.wet(a, 4.0, "salt fringe", film=0.5, salt=3.2, salt_in=3.0, halo=0.06)
    # weep pipes that run
    for k, ln in ((3, 0.8), (8, 0.5), (13, 0.9)):
        s, u, side = pipes[k]
        part = sh.run([s], [u + side * 0.04], ln, n=320, blur=0.022, width=0.03, fill=2.2)
        sh.wet(part, 4.2, "weep pipe", film=0.5, halo=0.05)
    # damp from below
    a = sh.blob(3.9, 0.0, 1.9, 0.62, rough=0.45, fringe=0.5, scale=0.5, power=2.6)
    sh.wet(a, 2.6, "damp foot", uneven=0.35)
    # faint
    sh.wet(sh.blob(6.0, right(0.0), 0.55, 0.6, rough=0.5, fringe=0.7, scale=0.4), 1.9, "faint damp", uneven=0.3)
    why = "One decibel below soot whose patches differ by more; no joint of lengths and no crack runs through it."
    sh.wet(sh.blob(20.3, cr + 1.3, 0.5, 0.4, rough=0.5, fringe=0.9, scale=0.4), 1.0, "faint damp", limit=why)
    # bricks take up water each in its own way
    pick = np.clip(1 + 0.22 * rng.standard_normal(65521), 0.4, 1.5).astype(np.float32)
    sh.drop *= np.where(mortar, 1.0, pick[ident])

    things = rails(0.0, FOOT - 0.02, LENGTH)
    things += cables(sec, right(0.75), 0.10, 0.02, 2, LENGTH, rng, pitch=1.8, sag=0.05, gap=0.07)
    things.append(Tube(-2.02, -2.45, 0.05, -0.1, LENGTH + 0.1, -8.0, 0.2, 0.0))
    axis = Axis(436518.77, 5611904.02, 163.9, 17.0, 1 / 700.0, -0.010)
    inst = Instrument(const=44.0, near=1.0, power=1.4, speckle=0.4, floor=2.5, sigma=0.002, slow=0.07, spread=0.0002)
    w = Works(
        axis,
        sh,
        Floor(-7.5, 0.35, 0.03, 0.6, 1.3),
        things,
        inst,
        relief=0.07,
        depth=0.115,
        steps=12,
        seed=51,
        truth_relief=0.05,
    )
    stations = [(4.3, 0.1, -1.2), (13.6, -0.15, -1.15), (22.9, 0.05, -1.22)]
    return w, {"kind": "static", "stations": stations, "bias": [0.0, 0.4, 0.1], "step": 0.12, "cell": 0.025, "reference": False}
