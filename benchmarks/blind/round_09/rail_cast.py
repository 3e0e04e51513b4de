"""A double-track railway tunnel of cast concrete, form joints every 10 m, thirty years old. Four stations, 1550 nm."""

from __future__ import annotations

import numpy as np

from .common import blotches, cables, cast_texture, clips, dirty_foot, drip_stains, old_runs, on_wall, rails, sooty_crown
from .sheet import Sheet
from .survey import Floor, Instrument, Works
from .tube import Axis, Box, Section, Tube, arc, chain, line

LENGTH = 40.0


def section():
    lining = chain(line((-4.98, -2.6), (-5.2, 0.0)), arc(0, 0, 5.2, 180, 0), line((5.2, 0.0), (4.98, -2.6)))
    floor = chain(
        line((4.98, -2.6), (4.05, -2.62)),
        (4.05, -3.2),
        line((4.0, -3.25), (-4.0, -3.25)),
        (-4.05, -3.2),
        (-4.05, -2.62),
        (-4.98, -2.6),
    )
    return Section(lining, floor)


def build():
    sec = section()
    sh = Sheet(sec, LENGTH, -5.4, kr=0.32, seed=90301)
    rng = sh.rng
    joints = [4.3, 14.3, 24.3, 34.3]
    cast_texture(sh, joints)
    left, right = (lambda z: sh.u_of(z, -1)), (lambda z: sh.u_of(z, 1))
    cr = sh.crown
    # soot of diesel days above both tracks, dust below the springing
    sooty_crown(sh, 0.9, 1.3, -1.9)
    sooty_crown(sh, 0.8, 1.3, 1.9)
    for side in (-1, 1):
        dirty_foot(sh, side, 0.9, 0.35)
    # form joints: a chamfer on both sides
    for j in joints:
        sh.hoop(j, 0, sh.girth, 0.03, -0.8, -0.018, 0.012)
        sh.hoop(j, 0, sh.girth, 0.14, -0.25, 0.0, 0.06)
    # joint between side wall and vault
    for side in (-1, 1):
        u = sh.u_of(-0.9, side)
        for a, b in zip([0, *joints], [*joints, LENGTH]):
            uu = u + rng.normal(0, 0.03)
            sh.along(uu, a, b, 0.012, -0.6, -0.003)
    # ports through which the vault was filled, plugged with mortar
    ports = []
    for a in np.arange(1.8, LENGTH, 2.5):
        s, u = a + rng.normal(0, 0.03), cr + rng.choice([-0.7, 0.7])
        ports.append((s, u))
        sh.disc(s, u, 0.11, rng.normal(-0.5, 0.6), rng.uniform(-0.008, 0.004), 0.012, kind="plug of a port")
    # joint sealed later with a band of bitumen, over the whole arch
    sh.rect(
        4.3 - 0.075,
        4.3 + 0.075,
        left(-1.4),
        right(-1.4),
        level=-9.3,
        kr=0.12,
        ks=0.03,
        disp=0.004,
        soft=0.01,
        kind="sealing band",
    )
    # repairs
    sh.rect(8.2, 9.35, right(1.2) - 0.4, right(1.2) + 0.35, -1.3, 0.004, 0.012, kr=0.22, kind="repair mortar")
    sh.rect(21.0, 22.2, left(-0.3) - 0.45, left(-0.3) + 0.45, 1.4, 0.003, 0.012, kr=0.25, kind="repair mortar")
    sh.rect(30.6, 31.1, left(2.5) - 0.3, left(2.5) + 0.5, -1.7, -0.004, 0.012, kr=0.25, kind="repair mortar")
    sh.rect(33.9, 34.7, right(-1.7) - 0.5, right(-1.7) + 0.4, 1.0, 0.004, 0.015, kind="repair mortar")
    # an injected crack: packers in a row on both sides, the crack itself dry and smeared over
    c = sh.wander(9.6, cr - 2.9, 8, 3.4, turn=0.2)
    sh.path(c, 0.05, 1.1, 0.002, 0.02, kind="smeared crack", vary=0.3)
    for k in range(3, len(c), 4):
        sh.disc(c[k, 0], c[k, 1] + 0.07 * (-1) ** k, 0.012, -2.0, 0.008, 0.004)
    # dry cracks, fine
    for s, u, a, ln in (
        (26.5, cr + 1.1, 6, 3.2),
        (36.2, right(1.0), 80, 1.6),
        (2.0, left(0.5), 100, 1.8),
        (29.4, cr - 0.4, 175, 2.2),
    ):
        sh.path(sh.wander(s, u, a, ln), 0.006, -0.9, 0, 0.006)
    # efflorescence of former leaks, dry: white and with a brownish rim
    for s, u, n in ((27.0, left(1.6), 160), (37.8, right(2.4), 120)):
        part = sh.run(s, u, 1.1, n=n, blur=0.02, fill=2.0)
        sh.stain(part, 2.3, "dry efflorescence", record=0.45)
    # tones that mean nothing: release oil, laitance, runs of dirt from joints and ports
    blotches(sh, 16, -0.8)
    blotches(sh, 8, 0.7, kind="laitance")
    old_runs(
        sh,
        [(14.3, left(2.2)), (34.3, right(1.0)), (24.3, right(2.6)), (12.0, left(-0.9)), (39.0, left(-0.9)), (5.6, right(-0.9))],
        -1.1,
        1.4,
    )
    old_runs(sh, [ports[2], ports[11]], -0.9, 0.9)
    # brackets, rust and dirt below
    u_cab = left(-1.2)
    at = clips(sh, u_cab - 0.12, 1.5)
    drip_stains(sh, [(s, u_cab - 0.2) for s in at if rng.random() < 0.35], -0.9, 0.5, kind="rust run")
    u_rad = right(0.9)
    at = clips(sh, u_rad, 1.2, size=0.03, out=0.05)
    drip_stains(sh, [(s, u_rad + 0.05) for s in at if rng.random() < 0.15], -0.6, 0.4)
    # anchor plates of the catenary
    for s in (11.0, 31.0):
        for side in (-1, 1):
            u = cr + side * 1.95
            sh.rect(s - 0.15, s + 0.15, u - 0.2, u + 0.2, 0, 0.02, 0.005, level=-6.5, kr=0.1, ks=0.25, kind="steel plate")
    # signs and paint
    for s in (6.0, 16.0, 26.0, 36.0):
        sh.rect(s, s + 0.3, left(-1.9) - 0.1, left(-1.9) + 0.1, 0, 0.004, 0.004, level=-0.5, kr=0.75, kind="sign")
    sh.rect(12.4, 13.5, right(-1.8) - 0.06, right(-1.8) + 0.06, 0, 0, 0.01, level=-2.5, kind="paint")
    # graffiti
    for k in range(5):
        p = sh.wander(18.2 + 0.35 * k, right(-1.6) + rng.normal(0, 0.1), rng.choice([70, 110, -80]), 0.7, turn=0.5)
        sh.path(p, 0.045, -1.6, 0, 0.01, kind="graffiti")

    # --------------------------------------------------------------------------------------------------------------------- water
    # a form joint that leaks from the haunch to the foot: the usual case
    u0, u1 = right(4.2), right(-2.4)
    a = sh.seam([(14.3, u0), (14.3, u1)], 0.22, rough=0.5, gaps=0.6)
    b = sh.run(np.full(40, 14.3), np.linspace(u0, u1 - 1.5, 40), 1.6, n=700, blur=0.022, width=0.06, fill=2.2)
    sh.wet(sh.merge(a, b), 6.2, "wet joint", film=0.6, halo=0.10)
    # the same, short, at the crown; it drips
    a = sh.merge(sh.seam([(24.3, cr - 1.3), (24.3, cr + 0.5)], 0.20, rough=0.6), sh.blob(24.2, cr - 0.5, 0.3, 0.4, rough=0.5))
    sh.wet(a, 5.0, "drip", film=0.5, halo=0.12)
    # low on the left wall, with lime beside it
    a = sh.run(
        np.full(12, 34.32), np.linspace(left(0.1), left(-0.9), 12), 1.8, n=700, blur=0.022, width=0.09, fill=2.6, braid=0.4
    )
    sh.wet(a, 7.0, "salt fringe", film=0.8, salt=2.6, salt_in=1.5, halo=0.06)
    # crack along the crown, damp on both sides
    c = sh.wander(16.6, cr + 0.55, 4, 2.9, turn=0.22)
    sh.wet(sh.seam(c, 0.12, rough=0.6, gaps=0.5), 4.2, "wet crack", film=0.2, halo=0.09)
    # slanting crack in the right wall from which water runs
    c = sh.wander(19.6, right(1.1), 62, 1.5, turn=0.25)
    a = sh.seam(c, 0.08, rough=0.6)
    b = sh.run(c[4::3, 0], c[4::3, 1], 1.1, n=420, blur=0.018, fill=2.0, braid=0.4)
    sh.wet(sh.merge(a, b), 5.5, "wet crack", film=0.5, salt=1.8, halo=0.05)
    # porous concrete at the joint of wall and vault
    a = sh.blob(29.2, left(-0.95), 0.75, 0.22, rough=0.55)
    b = sh.run(np.linspace(28.7, 29.7, 20), np.full(20, left(-1.05)), 0.6, n=350, blur=0.02)
    sh.wet(sh.merge(a, b), 4.0, "patch", film=0.2, halo=0.08)
    # a port that was not tight
    s, u = ports[8]
    a = sh.blob(s, u, 0.16, 0.2, rough=0.45)
    b = sh.run([s], [u], 0.5, n=250, blur=0.02, fill=1.8, width=0.06)
    sh.wet(sh.merge(a, b), 4.6, "hole", film=0.4, halo=0.05)
    # damp that rises behind the walkway
    a = sh.blob(37.4, right(-2.6), 1.5, 0.42, rough=0.45, fringe=0.6, scale=0.4, power=2.5)
    sh.wet(a, 3.0, "damp foot", uneven=0.3)
    # small and faint ones
    sh.wet(sh.blob(6.9, right(2.9), 0.14, 0.16, rough=0.5), 3.2, "patch")
    c = sh.wander(31.2, right(0.6), 85, 1.1)
    sh.path(c, 0.006, -1.2, 0, 0.006)
    sh.wet(
        sh.merge(sh.seam(c, 0.4, rough=0.35, fringe=0.7), sh.blob(31.25, right(0.0), 0.42, 0.5, rough=0.4, fringe=0.6)),
        2.0,
        "faint damp",
        uneven=0.25,
    )
    sh.wet(sh.seam([(34.3, cr + 1.2), (34.3, cr + 3.0)], 0.12, rough=0.6, fringe=0.8), 2.6, "wet joint", halo=0.05)
    sh.wet(
        sh.run([1.9], [right(-0.9)], 1.3, n=300, blur=0.02, fill=1.8, width=0.05),
        3.8,
        "joint of wall and vault",
        film=0.2,
        halo=0.04,
    )

    things = []
    for y in (-1.95, 1.95):
        things += [Tube(y, 2.4, 0.008, -0.1, LENGTH + 0.1, -6, 0.1, 0.3), Tube(y, 3.3, 0.008, -0.1, LENGTH + 0.1, -6, 0.1, 0.3)]
        things += rails(y, -3.13, LENGTH)
        for s in (11.0, 31.0):
            things.append(Box(y, 4.1, 0.04, 0.75, s - 0.04, s + 0.04, 0.0, -7.0, 0.1, 0.1))
    things += cables(sec, u_cab, 0.09, 0.028, 4, LENGTH, rng)
    things += cables(sec, u_rad, 0.07, 0.016, 1, LENGTH, rng, pitch=1.2, sag=0.012)
    y, z = sec.at(right(-1.6))
    things.append(Tube(float(y - 0.09), float(z), 0.021, -0.1, LENGTH + 0.1, -4.5, 0.15, 0.2))  # handrail
    for s in (9.0, 19.0, 29.0, 39.0):
        things.append(on_wall(sec, right(0.1), 0.10, 0.09, 0.07, s - 0.6, s + 0.6, -3.5, 0.2))
    things.append(on_wall(sec, left(-1.95), 0.14, 0.35, 0.13, 23.0, 23.5, -4.0, 0.1))

    axis = Axis(548213.42, 5279846.17, 512.35, 63.0, 1 / 900.0, 0.006)
    inst = Instrument(const=47.0, near=1.1, speckle=0.42, floor=3.0, sigma=0.0018, curve=(0.18, 2.6, 0.12), slow=0.08)
    w = Works(
        axis,
        sh,
        Floor(-6.5, 0.35, 0.03, 0.5, 1.2, bands=[(0, 1.5, -6.0, 0.002)]),
        things,
        inst,
        relief=0.07,
        depth=0.03,
        steps=8,
        seed=31,
    )
    stations = [(4.9, -1.9, -1.55), (15.2, -1.8, -1.52), (25.1, -2.0, -1.58), (35.3, 1.9, -1.55)]
    return w, {"kind": "static", "stations": stations, "bias": [0.0, 0.25, -0.15, 0.35], "step": 0.115, "cell": 0.029}
