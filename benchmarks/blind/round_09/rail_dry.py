"""A railway tunnel of the 1920s, concrete between boards, black of smoke and patched; dry throughout. Three stations, 905 nm, no curve."""

from __future__ import annotations

import numpy as np

from .common import blotches, cables, dirty_foot, drip_stains, old_runs, rails, random_line
from .sheet import Sheet, smooth_step
from .survey import Floor, Instrument, Works
from .tube import Axis, Section, Tube, arc, chain, line

LENGTH, R, FOOT = 30.0, 2.6, -2.7


def section():
    lining = chain(line((-2.3, FOOT), (-R, 0.0)), arc(0, 0, R, 180, 0), line((R, 0.0), (2.3, FOOT)))
    floor = chain(line((2.3, FOOT), (1.7, FOOT - 0.1)), line((1.7, FOOT - 0.1), (-1.7, FOOT - 0.1)), (-2.3, FOOT))
    return Section(lining, floor)


def build():
    sec = section()
    sh = Sheet(sec, LENGTH, -5.2, kr=0.35, seed=90813)
    rng = sh.rng
    cr = sh.crown
    left, right = (lambda z: sh.u_of(z, -1)), (lambda z: sh.u_of(z, 1))
    pours = [2.6, 8.4, 14.7, 20.3, 26.4]
    w = sh.all
    # boards along the tunnel: tone, fins between them, butts
    row = np.floor(w.u / 0.125).astype(int)
    tone = rng.normal(0, 0.30, (len(pours) + 1, int(row.max()) + 1)).astype(np.float32)
    fin = rng.normal(0, 0.002, (len(pours) + 1, int(row.max()) + 1)).astype(np.float32)
    field = np.searchsorted(pours, w.s[:, 0])
    sh.level += tone[field[:, None], row]
    sh.disp += fin[field[:, None], row]
    seam = np.abs(np.mod(w.u, 0.125) - 0.0625) > 0.0575
    sh.level -= np.where(seam, 0.35, 0).astype(np.float32)
    for k in range(len(pours) + 1):
        q = sh.window(([0.0] + pours)[k], (pours + [LENGTH])[k], 0, sh.girth)
        sh.level[q.cut] += np.float32(rng.normal(0, 0.4))
        # lean concrete at the bottom of lifts, honeycombed
        for side in (-1, 1):
            for lift in (1.3, 2.6):
                u = lift + 0.15 * random_line(sh, q) if side < 0 else sh.girth - lift + 0.15 * random_line(sh, q)
                d = np.abs(q.u - u)
                sh.level[q.cut] -= (
                    0.7 * np.exp(-((d / 0.05) ** 2)) * np.clip(0.6 + 0.8 * sh.noise(0.6, 0.1, q), 0, 1.6)
                ).astype(np.float32)
    for s in pours:  # ragged joints of the pours
        p = np.column_stack([s + 0.02 * np.cumsum(rng.normal(0, 1, 60)) * 0.35, np.linspace(0, sh.girth, 60)])
        sh.path(p, 0.025, -0.9, -0.008, 0.02)
    sh.mottle((2.4, 0.45), (0.8, 0.35), (0.22, 0.25), (0.05, 0.28))
    sh.level += np.float32(0.2) * rng.standard_normal(sh.shape).astype(np.float32)
    sh.level += 0.25 * sh.noise(0.05, 1.4) * np.clip(np.abs(sh.steep), 0, 1)[None]
    # smoke: thick in the crown with a ragged lower edge
    d = np.abs((np.arange(sh.nu) + 0.5) * sh.h - cr)[None].astype(np.float32)
    soot = 3.4 * smooth_step((2.7 - d + 0.5 * sh.noise(1.8, 0.7) + 0.15 * sh.noise(0.3, 0.2)) / 1.9)
    for _ in range(14):  # flaked off
        q, a = sh.blob(
            rng.uniform(0.5, LENGTH - 0.5), cr + rng.normal(0, 1.2), rng.uniform(0.08, 0.4), rng.uniform(0.06, 0.25), 0.6, 0.15
        )
        soot[q.cut] *= 1 - 0.85 * a
        sh.disp[q.cut] -= 0.004 * a
        sh.other("flaked soot", q, a > 0.5, many=True)
    sh.level -= soot
    for side in (-1, 1):
        dirty_foot(sh, side, 1.1, 0.45, fade=0.3)
    # runs of soot water of former days, dry since the slope above was drained
    spots = [(s, cr + side * rng.uniform(1.6, 3.2)) for s in (2.6, 8.4, 14.7, 20.3) for side in (-1, 1)]
    old_runs(sh, spots[:6], -1.7, 1.4, kind="soot run, dry", width=0.10, n=320, rim=1.4, core=2.6)
    old_runs(
        sh,
        [(5.2, left(0.6)), (11.8, right(0.4)), (17.6, left(-0.3)), (23.4, right(0.9)), (28.4, left(1.2))],
        -1.3,
        1.0,
        width=0.06,
        rim=1.2,
        core=2.0,
    )
    for s, u, n in ((14.7, left(1.4), 240), (26.4, right(1.0), 180), (6.1, right(1.9), 120)):
        part = sh.run(s + rng.normal(0, 0.06, 6), np.linspace(u - 0.1, u + 0.1, 6), 1.1, n=n, blur=0.022, width=0.05, fill=1.8)
        sh.stain(part, 3.2, "dry efflorescence", record=0.42)
    # a fire of tramps: a fan of soot that widens upwards
    q = sh.window(9.6, 12.4, 0.2, 3.4)
    x, y = (q.s - 11.0), q.u - 0.45
    a = (
        smooth_step((0.22 + 0.24 * np.clip(y, 0, None) - np.abs(x + 0.08 * sh.noise(0.5, win=q))) / 0.35 + 0.5)
        * smooth_step((2.6 - y) / 1.2)
        * smooth_step(y / 0.15 + 0.5)
    )
    sh.level[q.cut] -= (4.0 * a * (1 + 0.15 * sh.noise(0.2, win=q))).astype(np.float32)
    sh.other("soot of a fire", q, a > 0.5)
    # patches, spalls with bars and their rust
    for s0, s1, u0, u1, dl in (
        (3.4, 4.5, left(-0.5), left(-1.4), -1.6),
        (12.9, 13.6, right(0.3), right(-0.8), 1.3),
        (18.2, 19.6, right(-1.2), right(-1.9), -2.0),
        (24.2, 24.9, left(1.5), left(0.7), -1.5),
        (21.6, 22.2, cr + 0.3, cr + 1.1, 2.6),
    ):
        sh.rect(s0, s1, u0, u1, dl, 0.004, 0.012, kr=0.25, wobble=0.006, kind="repair mortar")
    for s, u in ((7.2, left(0.2)), (16.4, right(1.2)), (25.4, right(-0.6))):
        sh.rect(s, s + 0.6, u - 0.09, u + 0.09, 0.8, -0.022, 0.03, wobble=0.02, kind="spall")
        for k in (0.12, 0.36):
            sh.rect(s + k, s + k + 0.015, u - 0.09, u + 0.09, -1.8, 0.012, 0.006)
        drip_stains(sh, [(s + 0.12, u + sh.side(u) * 0.08), (s + 0.36, u + sh.side(u) * 0.08)], -1.0, 0.6, kind="rust run")
    # bands of bitumen over two joints, painted marks, graffiti
    p = np.column_stack([np.full(30, 20.3) + 0.01 * rng.normal(0, 1, 30), np.linspace(left(0.8), right(0.8), 30)])
    sh.path(p, 0.16, 0, 0.003, 0.012, level=-10.2, kind="sealing band")
    p = np.column_stack([np.full(30, 8.4), np.linspace(0.1, left(0.9), 30)])
    sh.path(p, 0.14, 0, 0.003, 0.012, level=-9.2, kind="sealing band")
    sh.rect(15.6, 16.1, right(-0.9), right(-1.4), level=-1.8, kind="white paint", soft=0.01)
    sh.rect(15.72, 15.98, right(-1.03), right(-1.27), level=-10.0, kind="black paint", soft=0.01)
    for k in range(7):
        p = sh.wander(
            4.9 + 0.33 * k, right(-1.3) + rng.normal(0, 0.12), rng.choice([70, 110, -80, 20]), rng.uniform(0.5, 1.0), turn=0.5
        )
        sh.path(p, 0.05, rng.choice([-3.0, 2.2]), 0, 0.012, kind="graffiti")
    # tar thrown from a brush, and a can that was emptied against the wall
    for s, u in ((22.4, left(-1.0)), (13.0, right(-1.5))):
        for _ in range(70):
            r = rng.exponential(0.012) + 0.006
            x, y = rng.normal(0, 0.35), rng.normal(0, 0.25)
            sh.disc(s + x, u + y, min(r, 0.06), -3.2, 0, 0.008)
        q = sh.window(s - 0.9, s + 0.9, u - 0.7, u + 0.7)
        sh.other("tar spatter", q, np.hypot((q.s - s) / 0.8, (q.u - u) / 0.6) < 1)
    blotches(sh, 8, -0.8, size=(0.15, 0.7), zone=(0.6, left(0.8)))
    blotches(sh, 8, -0.8, size=(0.15, 0.7), zone=(right(0.8), sh.girth - 0.6))
    blotches(sh, 6, 0.9, kind="laitance")
    for s, u, a, ln in ((13.4, cr + 0.5, 4, 3.4), (1.2, left(-0.4), 75, 1.5), (22.6, right(-0.2), 80, 1.8)):
        sh.path(sh.wander(s, u, a, ln), 0.007, -1.2, -0.002, 0.006)
    hooks = np.arange(0.8, LENGTH, 1.5)
    for s in hooks:
        sh.rect(s - 0.02, s + 0.02, left(0.35) - 0.06, left(0.35) + 0.04, 0, 0.06, 0.005, level=-8.0, kr=0.1, ks=0.1)
    drip_stains(sh, [(s, left(0.3)) for s in hooks if rng.random() < 0.5], -1.1, 0.5, kind="rust run")

    things = rails(0.0, FOOT - 0.02, LENGTH)
    things += cables(sec, left(0.35), 0.09, 0.022, 3, LENGTH, rng, pitch=1.5, sag=0.04, gap=0.07)
    things.append(Tube(1.98, -2.35, 0.06, -0.1, LENGTH + 0.1, -8.0, 0.2, 0.0))
    axis = Axis(602871.31, 5178332.74, 688.05, 254.0, 0.0, 0.024)
    inst = Instrument(const=46.0, near=1.5, power=1.6, speckle=0.45, floor=2.5, sigma=0.002, slow=0.1, spot=0.0015)
    w = Works(axis, sh, Floor(-6.5, 0.35, 0.03, 0.6, 1.2), things, inst, relief=0.07, depth=0.03, steps=8, seed=81)
    stations = [(5.0, 0.15, -1.25), (15.2, -0.1, -1.2), (25.1, 0.1, -1.28)]
    return w, {
        "kind": "static",
        "stations": stations,
        "bias": [0.0, 0.3, -0.1],
        "step": 0.12,
        "cell": 0.026,
        "reference": False,
    }
