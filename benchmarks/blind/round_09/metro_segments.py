"""A metro tunnel of precast segments, 5.5 m inside, scanned by a profiler on a trolley. 1500 nm."""

from __future__ import annotations

import numpy as np

from .common import cables, drip_stains, old_runs, on_wall, rails
from .sheet import Sheet
from .survey import Floor, Instrument, Works
from .tube import Axis, Box, Section, Tube, arc, chain, line

LENGTH, R, RING = 36.0, 2.75, 1.2
SLAB = -1.9
LOW = float(np.degrees(np.arcsin(SLAB / R)))  # angle of the feet, below the horizontal
LOW_SPAN = 90.0 - LOW  # degrees from the crown to a foot


def section():
    lining = arc(0, 0, R, 180 - LOW, LOW)
    foot = R * np.cos(np.radians(LOW))
    floor = chain(
        line((foot, SLAB), (1.25, SLAB)),
        (1.25, SLAB - 0.03),
        line((1.25, SLAB - 0.03), (-1.25, SLAB - 0.03)),
        (-1.25, SLAB),
        (-foot, SLAB),
    )
    return Section(lining, floor)


def build():
    sec = section()
    sh = Sheet(sec, LENGTH, -4.9, kr=0.25, seed=90101)
    rng = sh.rng
    cr = sh.crown

    def at(deg):  # arc length at an angle from the crown, to the right
        return cr + np.radians(deg) * R

    n = int(round(LENGTH / RING))
    # joints of ring k lie at k * RING; its segments are turned by half a bolt spacing from ring to ring
    turns = [11.25 if k % 2 else -11.25 for k in range(n)]
    cuts = (-145, -77.5, -10, 10, 77.5, 145)
    for k in range(n):
        s0, s1 = k * RING, (k + 1) * RING
        edges = [-200, *[c + turns[k] for c in cuts], 200]
        for a, b in zip(edges[:-1], edges[1:]):
            ua, ub = np.clip([at(a), at(b)], 0, sh.girth)
            if ub - ua < 0.02:
                continue
            w = sh.window(s0, s1, ua, ub)
            sh.level[w.cut] += np.float32(rng.normal(0, 0.33))
            sh.disp[w.cut] += np.float32(rng.normal(0, 0.0015))
            mid = (max(a, -LOW_SPAN) + min(b, LOW_SPAN)) / 2
            if abs(mid) < LOW_SPAN - 8:
                sh.disc((s0 + s1) / 2, at(mid), 0.03, rng.normal(-0.7, 0.5), -0.008, 0.008)
    sh.mottle((1.6, 0.22), (0.5, 0.18), (0.15, 0.16), (0.05, 0.18))
    sh.level += np.float32(0.15) * rng.standard_normal(sh.shape).astype(np.float32)
    # brake dust: what looks upwards, streaky, and a veil at the height of the wheels
    facing = np.clip(-np.cos(np.radians((np.arange(sh.nu) * sh.h - cr) / R * 57.2958)), 0, 1)
    sh.level -= (2.2 * facing[None] * (1 + 0.35 * sh.noise(2.5, 0.15) + 0.2 * sh.noise(0.1, 0.7))).astype(np.float32)
    for side in (-1, 1):
        d = (np.arange(sh.nu) * sh.h - at(side * 112)) / 0.35
        sh.level -= (0.7 * np.exp(-(d**2))[None] * (1 + 0.3 * sh.noise(1.5, 0.2))).astype(np.float32)
    # joints and pockets
    pockets = []
    for k in range(n):
        s0 = k * RING
        if k:
            sh.hoop(s0, 0, sh.girth, 0.012, -1.8, -0.012, 0.008)
            for deg in np.arange(-168.75, 180, 22.5):
                if abs(deg) < LOW_SPAN - 4:
                    pockets += [(s0 + 0.17, at(deg), 0.09, 0.075), (s0 - 0.17, at(deg), 0.09, 0.075)]
        for c in cuts:
            deg = c + turns[k]
            if abs(deg) > LOW_SPAN - 2:
                continue
            sh.along(at(deg), s0, s0 + RING, 0.012, -1.6, -0.012, 0.008)
            for ds in (0.35, 0.85):
                pockets += [(s0 + ds, at(deg) - 0.19, 0.10, 0.10), (s0 + ds, at(deg) + 0.19, 0.10, 0.10)]
    filled = set(rng.choice(len(pockets), len(pockets) // 14, replace=False).tolist())
    for k, (s, u, a, b) in enumerate(pockets):
        if k in filled:
            sh.rect(s - a, s + a, u - b, u + b, rng.normal(0.6, 0.5), -0.004, 0.01, kind="filled pocket", many=True)
            continue
        sh.rect(s - a, s + a, u - b, u + b, rng.normal(-1.4, 0.4), -0.065, 0.03, kind="bolt pocket", many=True)
        sh.disc(s, u, 0.022, 0, 0.03, 0.008, level=-7.5, ks=0.2)
    # joints caulked anew: bands of one width, dark or pale, that follow the joint exactly
    sh.rect(
        6 * RING - 0.045,
        6 * RING + 0.045,
        at(-95),
        at(60),
        level=-8.6,
        kr=0.1,
        ks=0.05,
        disp=0.003,
        soft=0.008,
        kind="sealing band",
    )
    sh.rect(17 * RING - 0.05, 17 * RING + 0.05, at(-30), at(100), 1.6, 0.003, 0.02, wobble=0.012, kind="caulk")
    sh.rect(
        23 * RING,
        24 * RING,
        at(-77.5 + turns[23]) - 0.05,
        at(-77.5 + turns[23]) + 0.05,
        level=-8.2,
        kr=0.1,
        ks=0.05,
        disp=0.003,
        soft=0.008,
        kind="sealing band",
    )
    # carbon strips glued on a damaged segment
    for ds in (0.2, 0.5, 0.8):
        sh.rect(
            11 * RING + ds,
            11 * RING + ds + 0.1,
            at(-2),
            at(48),
            level=-10.5,
            kr=0.05,
            ks=0.12,
            disp=0.004,
            soft=0.006,
            kind="carbon strip",
        )
    # smears of cement from injections; dry lime of leaks that were stopped
    for s, u in ((3 * RING, at(72)), (14 * RING, at(-84)), (26 * RING, at(95))):
        part = sh.run(
            np.full(10, s) + rng.normal(0, 0.03, 10), np.linspace(u - 0.2, u + 0.2, 10), 0.7, n=260, blur=0.025, fill=1.8
        )
        sh.stain(part, 1.9, "cement run", record=0.45)
    old_runs(sh, [(9 * RING, at(50)), (20 * RING, at(-60)), (28 * RING, at(70)), (5 * RING + 0.6, at(-80))], -1.0, 0.9)
    # spalled corners
    for k, deg in ((4, 21.25), (15, -66), (22, 66.25)):
        sh.disc(k * RING + 0.05, at(deg), 0.09, 0.9, -0.02, 0.04, kind="spall")
    # ring numbers, signs
    for k in range(2, n, 5):
        sh.rect(k * RING + 0.45, k * RING + 0.72, at(-52), at(-52) + 0.14, -2.4, 0, 0.01, wobble=0.02, kind="painted number")
        sh.rect(k * RING + 0.3, k * RING + 0.6, at(74), at(74) + 0.18, 0, 0.004, 0.005, level=0.5, kr=0.8, kind="sign")
    for s in np.arange(0.6, LENGTH, 1.2):  # brackets of the cables
        for a, b in ((84, 106), (-74, -66)):
            sh.rect(s - 0.025, s + 0.025, at(a), at(b), 0, 0.03, 0.006, level=-7.0, kr=0.1, ks=0.1)
    drip_stains(sh, [(s, at(106)) for s in np.arange(0.6, LENGTH, 1.2) if rng.random() < 0.4], -0.7, 0.35, kind="rust run")

    # ---------------------------------------------------------------------------------------------------------------------- water
    j = 8 * RING  # a ring joint on the right, from the shoulder to behind the cables
    a = sh.seam([(j, at(38)), (j, at(88))], 0.16, rough=0.55, gaps=0.5)
    b = sh.run(np.full(20, j), np.linspace(at(55), at(80), 20), 1.3, n=520, blur=0.02, width=0.05, fill=2.0)
    sh.wet(sh.merge(a, b), 6.3, "wet joint", film=0.6, halo=0.07)
    j = 13 * RING  # crossing of joints, with lime
    a = sh.blob(j, at(-66.25), 0.16, 0.16, rough=0.5)
    b = sh.run(np.full(6, j), np.full(6, at(-68)), 1.5, n=520, blur=0.02, width=0.07, fill=2.2, braid=0.35)
    sh.wet(sh.merge(a, b), 6.5, "joint crossing", film=0.7, salt=2.2, salt_in=1.2, halo=0.05)
    k = 18  # the long joint at the springing
    u = at(77.5 + turns[k])
    a = sh.seam([(k * RING + 0.05, u), (k * RING + 1.15, u)], 0.16, rough=0.5)
    b = sh.run(np.linspace(k * RING + 0.1, k * RING + 1.1, 24), np.full(24, u), 0.7, n=520, blur=0.02, fill=2.0)
    sh.wet(sh.merge(a, b), 5.2, "wet joint", film=0.4, halo=0.05)
    k = 21  # a hole for grouting
    mid = at((-77.5 - 10) / 2 + turns[k])
    a = sh.blob(k * RING + 0.6, mid, 0.12, 0.13, rough=0.4)
    b = sh.run([k * RING + 0.6], [mid], 0.9, n=300, blur=0.018, width=0.04, fill=1.8)
    sh.wet(sh.merge(a, b), 5.0, "grout hole", film=0.4, halo=0.05)
    # a bolt pocket
    s, u = 24 * RING - 0.17, at(33.75)
    a = sh.blob(s, u, 0.14, 0.14, rough=0.35)
    b = sh.run([s], [u + 0.08], 0.8, n=320, blur=0.02, width=0.06, fill=2.0)
    sh.wet(sh.merge(a, b), 5.5, "bolt pocket", film=0.5, halo=0.05)
    # damp to both sides of a ring joint over the crown
    sh.wet(
        sh.seam([(27 * RING, at(-34)), (27 * RING, at(18))], 0.17, rough=0.55, gaps=0.6, fringe=0.8),
        3.0,
        "wet joint",
        halo=0.04,
    )
    # low on the left, below the walkway
    j = 4 * RING
    a = sh.run(np.full(14, j), np.linspace(at(-104), at(-118), 14), 1.0, n=520, blur=0.025, width=0.08, fill=2.4)
    sh.wet(a, 4.6, "wet joint", film=0.4, halo=0.06)
    # at the foot on the right
    a = sh.blob(16.1 * RING, sh.girth, 0.9, 0.42, rough=0.5, fringe=0.5, power=2.4)
    sh.wet(a, 3.6, "damp foot", uneven=0.3)
    # damp about a crack of a segment; a joint already injected that sweats
    c = sh.wander(10 * RING + 0.25, at(-35), 80, 0.6)
    sh.path(c, 0.006, -1.0, 0, 0.006)
    sh.wet(sh.seam(c, 0.2, rough=0.5), 3.2, "wet crack", halo=0.04)
    sh.wet(sh.seam([(14 * RING, at(-84)), (14 * RING, at(-40))], 0.34, rough=0.4, fringe=0.9), 1.7, "faint damp", uneven=0.25)
    sh.wet(sh.blob(29 * RING, at(52), 0.11, 0.13, rough=0.4), 3.4, "joint crossing")

    things = rails(0.0, SLAB + 0.08, LENGTH)
    for u, r, c in ((at(88), 0.024, 3), (at(97), 0.018, 2), (at(104), 0.03, 1)):
        things += cables(sec, u, 0.10, r, c, LENGTH, rng, pitch=1.2, sag=0.018, gap=0.11)
    things += cables(sec, at(-70), 0.08, 0.016, 2, LENGTH, rng, pitch=1.2, sag=0.015, gap=0.09)
    things.append(Tube(2.28, -1.35, 0.08, -0.1, LENGTH + 0.1, -5.5, 0.1, 0.1))
    things.append(Box(-2.2, -0.88, 0.38, 0.03, -0.1, LENGTH + 0.1, 0.0, -5.5, 0.2, 0.0))
    things.append(Box(0.0, 2.22, 0.045, 0.055, -0.1, LENGTH + 0.1, 0.0, -4.0, 0.1, 0.4))
    for s in np.arange(3.0, LENGTH, 8.0):
        things.append(Box(0.0, 2.5, 0.04, 0.25, s - 0.04, s + 0.04, 0.0, -5.0, 0.2, 0.1))
    for s in np.arange(2.0, LENGTH, 6.0):
        things.append(on_wall(sec, at(-46), 0.07, 0.07, 0.05, s - 0.3, s + 0.3, -3.5, 0.2))
    things.append(on_wall(sec, at(-92), 0.12, 0.2, 0.10, 19.4, 19.8, -4.5, 0.1))

    axis = Axis(461377.84, 5429652.31, 98.42, 128.0, -1 / 400.0, -0.012)
    inst = Instrument(
        const=44.0,
        near=1.6,
        power=1.8,
        speckle=0.45,
        floor=3.0,
        sigma=0.001,
        curve=(0.22, 2.2, -0.1),
        slow=0.12,
        spot=0.0025,
        spread=0.0002,
    )
    w = Works(
        axis,
        sh,
        Floor(-6.8, 0.25, 0.004, 0.5, 0.4, puddles=[(20.5, 2.0, 1.6, 0.28)]),
        things,
        inst,
        relief=0.05,
        depth=0.08,
        steps=9,
        seed=11,
    )
    return w, {"kind": "mobile", "passes": [(0.02, -0.52, 1.2, 1)], "rate": 58.0, "spacing": 0.021, "tilt": 0.0, "wander": 0.03}
