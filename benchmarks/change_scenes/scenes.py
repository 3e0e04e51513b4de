"""The scenes, and how they are made."""

from __future__ import annotations

import json
import math
import time
from dataclasses import dataclass, field as dc_field
from pathlib import Path

import numpy as np
from scipy import ndimage

from . import scanner, truth
from .geometry import Axis, Profile, arch_profile, circle_profile, fillet
from .lining import Lining, smoothstep
from .scanner import Pose
from .things import Box, Cable, pipe, tray


@dataclass
class Leak:
    s: float
    at: tuple  # ('r'|'l', height) or ('c', offset)
    area: float  # of the greater epoch if new/dry, else of the old one
    state: str
    ratio: float = 1.0  # new over old
    drop: float = 5.0
    aspect: float = 1.3  # extent along the profile over that along the tunnel
    run: float = 1.0  # drawn out downwards
    rim: float = 0.06
    what: str = "patch"
    drop_change: float = 0.0
    irregular: float = 0.25


@dataclass
class Dark:
    s: float
    at: tuple
    area: float
    drop: float
    kind: str
    aspect: float = 1.0
    rim: float = 0.10


@dataclass
class Move:
    kind: str  # bulge | oval | wall | spall | layer | floor
    s: float
    at: tuple = ("c", 0)
    area: float = 1.0
    mm: float = 5.0
    length: float = 3.0  # oval, wall: along the tunnel
    edge: float = 0.6  # bulge: width of the rim over its radius
    aspect: float = 1.0


def apply_leaks(lin, leaks, darks, old_db, new_db, rng):
    res = []
    for n, q in enumerate(leaks, 1):
        side, where = q.at
        u = lin.profile.at(side, where)
        r = q.ratio if q.state in ("grown", "shrunk", "same") else 1.0
        a_old, a_new = q.area, q.area * r
        if q.state == "new":
            a_old = 0.0
        if q.state == "dry":
            a_new = 0.0
        win, phi = lin.blob(
            q.s, u, q.aspect, side, max(a_old, a_new), q.irregular, q.run, np.random.default_rng(1000 + n + int(q.s * 77))
        )
        masks, drops = [], []
        core = 1 + 0.10 * lin.noise(0.25, shape=phi.shape, rng=rng)
        for e, (db, a) in enumerate(((old_db, a_old), (new_db, a_new))):
            m = phi <= lin.level(win, phi, a) if a > 0 else np.zeros(phi.shape, bool)
            drop = q.drop + (q.drop_change if e else 0.0)
            v = (lin.soft(m, q.rim) * drop * core).astype(np.float32) if a > 0 else np.zeros(phi.shape, np.float32)
            if a == 0 and q.state == "dry":
                v = (0.15 * lin.soft(masks[0], 0.2)).astype(np.float32)  # a trace is left
            db[win] -= v
            masks.append(m)
            drops.append(float(v[m].mean()) if a > 0 else 0.0)
        area = [float((m * lin.cell_area[:, win[1]]).sum()) for m in masks]
        res.append(dict(leak=q, win=win, union=masks[0] | masks[1], masks=masks, area=area, drops=drops))
    other = []
    for n, q in enumerate(darks, 1):
        u = lin.profile.at(*q.at)
        if q.kind == "repair":
            h = math.sqrt(q.area * q.aspect) / 2, math.sqrt(q.area / q.aspect) / 2
            win = lin.window(q.s, u, max(h) + 0.2)
            m = (np.abs(lin.s[win[0]][:, None] - q.s) <= h[1]) & (np.abs(lin.u[win[1]][None, :] - u) <= h[0])
        else:
            win, phi = lin.blob(q.s, u, q.aspect, q.at[0], q.area, 0.3, 1.0, np.random.default_rng(5000 + n))
            m = phi <= lin.level(win, phi, q.area)
        v = (lin.soft(m, 0.015 if q.kind == "repair" else q.rim) * q.drop).astype(np.float32)
        old_db[win] -= v
        new_db[win] -= v
        other.append(dict(dark=q, win=win, mask=m, area=float((m * lin.cell_area[:, win[1]]).sum())))
    return res, other


def apply_moves(lin, moves, new_d, new_db, rng):
    """Adds to new_d; returns (move, full mask) — masks of the local ones; ovals are found afterwards."""
    res = []
    p = lin.profile
    for n, q in enumerate(moves, 1):
        rr = np.random.default_rng(9000 + n)
        if q.kind == "bulge":
            u = p.at(*q.at)
            r0 = math.sqrt(q.area / math.pi)
            win = lin.window(q.s, u, r0 * (1 + q.edge) * max(q.aspect, 1 / q.aspect) ** 0.5 + 0.1)
            ss, uu = lin.s[win[0]][:, None] - q.s, lin.u[win[1]][None, :] - u
            rad = np.hypot(ss * math.sqrt(q.aspect), uu / math.sqrt(q.aspect))
            f = smoothstep((r0 - rad) / (2 * q.edge * r0) + 0.5)
            f = f * lin.on_lining[win[1]][None, :]
            new_d[win] += (f * q.mm / 1000).astype(np.float32)
            res.append((q, win, f >= 0.5))
        elif q.kind == "wall":
            side = q.at[0]
            z = p.z - p.floor_z
            on = smoothstep((np.where(np.abs(p.nx) > 0.7, z, 0) - 0.12) / 0.15) * smoothstep((q.at[1] - z) / 0.3 + 0.5)
            on = on * ((p.u < p.length / 2) if side == "r" else (p.u > p.length / 2)) * lin.on_lining
            along = smoothstep((q.length / 2 - np.abs(lin.s - q.s)) / 0.5 + 0.5)
            f = along[:, None] * on[None, :]
            new_d += (f * q.mm / 1000).astype(np.float32)
            i, j = np.nonzero(along > 0)[0], np.nonzero(on > 0)[0]
            win = (slice(i[0], i[-1] + 1), slice(j[0], j[-1] + 1))
            res.append((q, win, f[win] >= 0.5))
        elif q.kind == "oval":
            th = np.arctan2(p.z - q.at[1], p.x)
            along = smoothstep((q.length / 2 - np.abs(lin.s - q.s)) / 0.4 + 0.5)
            f = along[:, None] * (np.cos(2 * th) * lin.on_lining)[None, :]
            new_d += (f * q.mm / 1000).astype(np.float32)
            res.append((q, None, None))
        elif q.kind == "spall":
            u = p.at(*q.at)
            win, phi = lin.blob(q.s, u, q.aspect, q.at[0], q.area, 0.25, 1.0, rr)
            m = phi <= lin.level(win, phi, q.area)
            f = lin.soft(m, 0.04)
            rough = 1 + 0.15 * lin.noise(0.08, shape=phi.shape, rng=rr)
            new_d[win] -= (f * q.mm / 1000 * rough).astype(np.float32)
            new_db[win] += (f * 1.0).astype(np.float32)
            res.append((q, win, m))
        elif q.kind == "layer":
            u = p.at(*q.at)
            win, phi = lin.blob(q.s, u, q.aspect, q.at[0], q.area, 0.15, 1.0, rr)
            m = phi <= lin.level(win, phi, q.area)
            f = lin.soft(m, 0.12).astype(np.float32)
            own = 0.004 * lin.noise(0.09, shape=phi.shape, rng=rr) + 0.003 * lin.noise(0.35, shape=phi.shape, rng=rr)
            smooth = ndimage.gaussian_filter(new_d[win], 6)
            new_d[win] = new_d[win] * (1 - f) + f * (smooth + np.float32(q.mm / 1000) + own)
            new_db[win] += f * 0.6
            res.append((q, win, m))
        elif q.kind == "floor":
            fl = ndimage.gaussian_filter1d(p.floor.astype(np.float32), 4, mode="wrap")[None, :]
            new = rr
            new_d += fl * (q.mm / 1000 + 0.012 * (lin.noise(0.07, rng=new) - lin.noise(0.07, rng=new)) / 1.4).astype(np.float32)
            res.append((q, "floor", None))
    return res


def make(name, folder):
    t0 = time.process_time()
    cfg = SCENES[name]()
    lin = cfg["lining"]
    folder = Path(folder)
    rng = np.random.default_rng(abs(hash_(name)))
    old_d, old_db = lin.d, lin.db
    new_d, new_db = old_d.copy(), old_db.copy()
    moves = apply_moves(lin, cfg["moves"], new_d, new_db, rng)
    leaks, other = apply_leaks(lin, cfg["leaks"], cfg["darks"], old_db, new_db, rng)
    on = lin.on_lining[None, :]
    new_db += (
        cfg["moist"][0] + cfg["moist"][1] * lin.noise(5.0, rng=rng) + 0.25 * lin.noise(0.8, rng=rng) * cfg["moist"][1]
    ) * 1.0
    seens, stats = [], {}
    for ep, d, db in (("old", old_d, old_db), ("new", new_d, new_db)):
        spec = cfg[ep]
        out, sens, seen, K = scanner.scan(cfg, lin, d, db, spec, np.random.default_rng([hash_(name), ep == "new"]))
        scanner.write_epoch(folder / ep, lin.axis, lin.length, out, sens, spec)
        cov = truth.nodes_to_cover(lin, truth.coverage(lin, seen))
        seens.append(cov > 0)
        area = float((lin.cell_area * np.ones_like(d)).sum())
        lining_area = float((lin.cell_area * on * np.ones_like(d)).sum())
        stats[ep] = dict(
            points=len(out["amp"]),
            points_on_lining_and_floor=int((K == 0).sum()),
            on_things=int((K > 0).sum()),
            mixed=int((K < 0).sum()),
            mean_density=round(len(out["amp"]) / area),
            lining_seen_share=round(float((seens[-1] * on * lin.cell_area).sum()) / lining_area, 4),
            density_p5_p50_p95_of_lining=[
                round(float(v)) for v in np.percentile(cov[::8, ::8][:, lin.on_lining[::8]] / 0.0064, (5, 50, 95))
            ],
            mode=spec["mode"],
            range_noise_mm=spec["sigma"] * 1000,
            amplitude_noise_db=spec["amp_noise"],
            gain_db=spec["gain"],
            gain_in_reference_db=spec["gain_in_reference"],
            target_density=spec["target"],
            things=[f"{type(q).__name__} {getattr(q, 'r', '')}" for q in spec["things"]],
        )
    both = seens[0] & seens[1]
    write_truth(folder, name, cfg, lin, old_d, new_d, leaks, other, moves, seens, both, stats, lining_area)
    print(
        f"{name}: {stats['old']['points']} / {stats['new']['points']} points, {time.process_time() - t0:.0f} s CPU", flush=True
    )
    return lin, old_d, new_d, old_db, new_db


def hash_(name):
    import zlib

    return zlib.crc32(name.encode())


def share(lin, win, mask, seen):
    w = mask * lin.cell_area[:, win[1]]
    return float((w * seen[win]).sum() / max(w.sum(), 1e-12))


def place(lin, win, mask):
    w = mask * lin.cell_area[:, win[1]]
    return dict(
        s_m=round(float((w.sum(1) * lin.s[win[0]]).sum() / w.sum()), 3),
        chainage_from_axis_start_m=round(float((w.sum(1) * lin.s[win[0]]).sum() / w.sum()) + 3.0, 3),
        u_m=round(float((w.sum(0) * lin.u[win[1]]).sum() / w.sum()), 3),
    )


def write_truth(folder, name, cfg, lin, old_d, new_d, leaks, other, moves, seens, both, stats, lining_area):
    feats = []
    for n, r in enumerate(leaks, 1):
        q, win = r["leak"], r["win"]
        so, sn = share(lin, win, r["union"], seens[0]), share(lin, win, r["union"], seens[1])
        b = float((r["union"] * lin.cell_area[:, win[1]] * both[win]).sum() / (r["union"] * lin.cell_area[:, win[1]]).sum())
        state = "unseen" if min(so, sn) < 0.5 else q.state
        # area changed by less than what was not seen: the user's page calls that unseen as well
        hidden = [(1 - v) * float((r["union"] * lin.cell_area[:, win[1]]).sum()) for v in (so, sn)]
        may = q.state in ("new", "dry", "grown", "shrunk") and abs(r["area"][0] - r["area"][1]) < max(hidden)
        geom = truth.outline(lin, r["union"], win)
        props = dict(
            id=n,
            state=state,
            real_state=q.state,
            area_old=round(r["area"][0], 4),
            area_new=round(r["area"][1], 4),
            drop_db=round(max(r["drops"]), 2),
            drop_old_db=round(r["drops"][0], 2),
            drop_new_db=round(r["drops"][1], 2),
            phenomenon=q.what,
            rim_m=q.rim,
            seen_old=round(so, 3),
            seen_new=round(sn, 3),
            seen_both=round(b, 3),
            unseen_allowed=bool(state == "unseen" or may),
            **place(lin, win, r["union"]),
        )
        feats.append({"type": "Feature", "properties": props, "geometry": truth.lift(lin, geom, old_d)})
    truth.collection(folder / "truth_leaks.geojson", feats)
    feats = []
    for n, r in enumerate(other, 1):
        q = r["dark"]
        feats.append(
            {
                "type": "Feature",
                "properties": dict(
                    id=n, kind=q.kind, drop_db=q.drop, area=round(r["area"], 4), **place(lin, r["win"], r["mask"])
                ),
                "geometry": truth.lift(lin, truth.outline(lin, r["mask"], r["win"]), old_d),
            }
        )
    truth.collection(folder / "truth_other.geojson", feats)

    delta = new_d - old_d
    rests = {}
    if cfg["moves"]:
        for key, fl, rob in (("ls", False, False), ("l1", False, True), ("ls_floor", True, False)):
            rests[key] = truth.rigid_rest(lin, delta, both, fl, rob)
    feats = []
    step = 5
    regions = []
    for q, win, mask in moves:
        if mask is not None:
            regions.append((q, win, mask, "whole"))
        elif q.kind == "oval":
            rest = np.nan_to_num(rests["ls"])
            i = (lin.s[::step] > q.s - q.length / 2 - 0.5) & (lin.s[::step] < q.s + q.length / 2 + 0.5)
            # other movements within the same rings are kept apart
            theirs = np.zeros(delta.shape, bool)
            for q2, w2, m2 in moves:
                if m2 is not None:
                    theirs[w2] |= m2
            rest = np.where(i[:, None] & lin.on_lining[::step][None, :] & ~theirs[::step, ::step], rest, 0)
            for sign in (1, -1):
                if not (sign * rest > 0.0003).any():
                    continue
                peak = np.percentile(
                    (sign * rest)[sign * rest > 0.0003], 95
                )  # each sign by its own: the crown's share of the shift is taken out
                lab, k = ndimage.label(sign * rest >= 0.5 * peak)
                for v in range(1, k + 1):
                    small = lab == v
                    if small.sum() * (lin.ds * step) ** 2 < 0.25:
                        continue
                    big = np.repeat(np.repeat(small, step, 0), step, 1)[: lin.ns, : lin.nu]
                    big = np.roll(big, (-(step // 2), -(step // 2)), (0, 1))
                    big[:, ~lin.on_lining] = False
                    regions.append((q, (slice(0, lin.ns), slice(0, lin.nu)), big, "lobe"))
    for n, (q, win, mask, part) in enumerate(regions, 1):
        w = mask * lin.cell_area[:, win[1]]
        dl = delta[win]
        mean_abs = float((w * dl).sum() / w.sum())
        full = np.zeros(delta.shape, bool)
        full[win] = mask
        sub = full[::step, ::step]
        alt = {f"mean_{k}_m": round(float(np.nanmean(v[sub])), 5) for k, v in rests.items()}
        rel = alt["mean_ls_m"] if q.kind == "oval" else mean_abs
        if q.kind == "oval":
            g = rests["ls"][sub]
            greatest = float(g[np.nanargmax(np.abs(g))])
        else:
            greatest = float(dl[mask][np.argmax(np.abs(dl[mask]))])
        wide = float(
            (np.abs(dl) > 0.001) @ lin.cell_area[0, win[1]] @ np.ones(1)
            if False
            else ((np.abs(dl) > 0.001) * lin.cell_area[:, win[1]]).sum()
        )
        seen = share(lin, win, mask, both)
        props = dict(
            id=n,
            kind=q.kind,
            part=part,
            mean_m=round(rel, 5),
            greatest_m=round(greatest, 5),
            area=round(float(w.sum()), 4),
            mean_abs_m=round(mean_abs, 5),
            **alt,
            area_over_1mm_in_window=round(wide, 4),
            seen_both=round(seen, 3),
            demand=bool(seen >= 0.5),
            **place(lin, win, mask),
        )
        feats.append(
            {"type": "Feature", "properties": props, "geometry": truth.lift(lin, truth.outline(lin, mask, win, 0.012), old_d)}
        )
    truth.collection(folder / "truth_change.geojson", feats)

    moved = np.abs(delta) > 0.0002
    on = lin.on_lining[None, :]
    w = lin.cell_area * on
    pose = cfg["new"]["pose"]
    near = ndimage.binary_dilation(moved[::5, ::5], iterations=4)
    info = dict(
        scene=name,
        kind=cfg["kind"],
        length_m=lin.length,
        profile_length_m=round(lin.profile.length, 3),
        lining_area_m2=round(lining_area, 2),
        floor=cfg["floor"],
        floor_changed=any(q.kind == "floor" for q in cfg["moves"]),
        nothing_moved=not [q for q in cfg["moves"] if q.kind != "floor"],
        nothing_changed_at_all=cfg.get("nothing", False),
        lining_unchanged_m2=round(float((w * ~moved).sum()), 2),
        lining_unchanged_seen_by_both_m2=round(float((w * ~moved * both).sum()), 2),
        lining_changed_over_0_2mm_m2=round(float((w * moved).sum()), 2),
        pose_error_new=dict(
            shift_mm=[round(1000 * float(v), 2) for v in pose.t],
            shift_norm_mm=round(1000 * float(np.linalg.norm(pose.t)), 2),
            rotation_deg=pose.deg,
            about="a random axis through the middle of the tunnel",
            frame="shift in the plan frame at the tunnel's start: right, forward, up; axis heading %.1f deg"
            % math.degrees(lin.axis.h),
            drift=pose.drift
            and [dict(of=o, amplitude_mm=a * 1000, wave_m=wv, phase=ph) for o, (a, wv, ph) in zip("xz", pose.drift)],
        ),
        pose_error_old=0,
        axis="axis.csv starts 3.0 m before s = 0: chainage = s_m + 3.0 if it is counted from the axis's first point; the same in both epochs, not posed",
        axis_radius_m=lin.axis.R,
        axis_gradient=lin.axis.g,
        moisture_db=dict(mean=cfg["moist"][0], sd=cfg["moist"][1]),
        epochs=stats,
        cables=cfg["cables"],
        beware=cfg.get("beware", []),
        definitions=dict(
            leak="outline where the drop is half of what it is inside; area on the profile (roughness not counted)",
            state="real_state is what the water did; state is unseen where a survey saw less than half of the union (cells of 8 cm with a point)",
            unseen_allowed="true also where the area changed by less than one survey did not see",
            mean_m="bulge, wall, spall, layer: mean over the outline (half of the greatest) of new less old, against lining that did not move at all; "
            "oval: of the rest after a least-squares rigid motion (x, z, roll, yaw, pitch) of sections of 1.5 m from s = 0, lining without floor, seen by both",
            alternatives="mean_ls_m, mean_l1_m, mean_ls_floor_m: after taking out that motion by least squares, by least absolute values, by least squares with the floor",
            frame="all truth lies in the old epoch, which has no pose error",
        ),
    )
    (folder / "truth.json").write_text(json.dumps(info, indent=1))


def rigid(rng_seed, mm, deg, centre, drift=None):
    r = np.random.default_rng(rng_seed)
    v = r.normal(size=3)
    return Pose(centre, v / np.linalg.norm(v) * mm / 1000, r.normal(size=3) * [1, 1, 1.5] + [0, 0, 0.3], deg, drift)


def epoch(mode, things, pose=None, **kw):
    e = dict(
        mode=mode,
        things=things,
        pose=pose or Pose(),
        sigma=0.002,
        amp_noise=0.5,
        gain=0.0,
        gain_in_reference=0.0,
        const=22.0,
        reference_db=-3.0,
        k_inc=0.8,
        target=2000,
        step=0.0052,
    )
    e.update(kw)
    return e


def seg_move():
    ax = Axis((691234.0, 5334567.0, 512.3), 37.0, 450.0, 0.012)
    pr = Profile(circle_profile(2.9, -1.95))
    L = Lining(ax, pr, 27.0, 11)
    L.texture(-4.0, 0.4, 0.35, 0.3)
    L.segments(1.5, 6)
    L.add_rough([(0.06, 0.0004), (0.9, 0.0006)])
    L.make_floor("slab")
    at = pr.at
    common = tray(pr, at("r", 2.1), 0.10, 3, 0.02, rng=np.random.default_rng(1)) + pipe(pr, at("l", 0.7), 0.10, 0.055)
    old = common + [Box(pr, at("r", 1.2), 19.0, 0.30, 0.45, 0.55, gap=0.04, db=-5)]
    new = (
        tray(pr, at("r", 2.1) + 0.22, 0.10, 3, 0.02, phase=0.5, rng=np.random.default_rng(2))
        + pipe(pr, at("l", 0.7), 0.10, 0.055)
        + [Cable(pr, at("l", 2.6), 0.06, 0.025, sag=0.03)]
    )
    c = ax.from_local(13.5, 0, 0)
    return dict(
        kind="metro, segmental concrete, circle of 5.8 m",
        floor="slab",
        lining=L,
        moist=(-0.3, 0.25),
        cables="three cables on brackets hung 22 cm higher, one new cable at the left, pipe stays; a cabinet at s=19 right stood in the old epoch only",
        moves=[
            Move("oval", 7.15, ("c", 0.0), mm=5.0, length=4.5),
            Move("bulge", 13.2, ("l", 2.9), 1.0, 3.0),
            Move("bulge", 16.6, ("c", 0.8), 1.0, 10.0),
            Move("spall", 21.4, ("r", 3.4), 0.12, 25.0),
        ],
        leaks=[
            Leak(4.9, ("r", 3.2), 0.5, "grown", 2.0, 5.5, run=1.6),
            Leak(11.0, ("c", -0.6), 0.35, "grown", 1.5, 4.0),
            Leak(14.9, ("r", 3.2), 0.6, "shrunk", 0.5, 5.0),
            Leak(18.4, ("l", 2.0), 0.7, "same", 1.0, 6.0, run=1.8, drop_change=-0.3),
            Leak(22.9, ("c", 0.3), 0.30, "new", drop=5.0),
            Leak(24.4, ("l", 2.1), 0.4, "dry", drop=4.0, run=1.5),
            Leak(19.0, ("r", 1.2), 0.3, "same", 1.0, 6.0),
            Leak(12.4, ("r", 3.35), 0.16, "grown", 1.6, 4.5, aspect=9, rim=0.04, what="wet joint", irregular=0.12),
            Leak(2.6, ("c", 0.5), 0.45, "dry", drop=6.0),
        ],
        darks=[Dark(9.6, ("l", 3.0), 0.35, 3.5, "repair", 1.4), Dark(25.5, ("c", -1.2), 0.5, 3.0, "soot")],
        old=epoch(
            "static",
            old,
            stations=[(2.5, 0.5, 1.6), (9.5, -0.4, 1.65), (16.5, 0.4, 1.6), (23.5, -0.3, 1.6)],
            sigma=0.002,
            target=1500,
        ),
        new=epoch(
            "static",
            new,
            rigid(3, 12, 0.015, c),
            stations=[(0.8, -0.7, 1.55), (7.0, 0.6, 1.6), (14.0, -0.6, 1.6), (20.5, 0.6, 1.7), (26.0, -0.4, 1.6)],
            sigma=0.0025,
            gain=1.2,
            target=2300,
            amp_noise=0.6,
        ),
    )


def seg_nothing():
    ax = Axis((456789.0, 5712345.0, 88.7), 122.0, -600.0, -0.008)
    pr = Profile(circle_profile(3.1, -2.0))
    L = Lining(ax, pr, 28.0, 22)
    L.texture(-4.5, 0.5, 0.35, 0.4)
    L.segments(1.2, 7, step=0.002)
    L.add_rough([(0.06, 0.0004), (0.9, 0.0008)])
    L.make_floor("ballast")
    at = pr.at
    old = tray(pr, at("r", 1.7), 0.10, 4, 0.018, rng=np.random.default_rng(3)) + pipe(pr, at("l", 1.0), 0.12, 0.05)
    new = (
        tray(pr, at("r", 1.95), 0.10, 4, 0.018, phase=0.4, rng=np.random.default_rng(4))
        + pipe(pr, at("l", 1.0), 0.12, 0.05)
        + tray(pr, at("l", 2.2), 0.09, 2, 0.03, phase=0.2, rng=np.random.default_rng(5), s0=6.0)
        + [Box(pr, at("r", 3.2), 12.3, 0.25, 0.5, 0.55, gap=0.05, db=-4)]
    )
    c = ax.from_local(14.0, 0, 0)
    return dict(
        kind="metro, segmental concrete, circle of 6.2 m",
        floor="ballast",
        lining=L,
        moist=(0.2, 0.2),
        nothing=True,
        cables="tray at the right hung 25 cm higher; new tray of two at the left from s=6; new cabinet at s=12.3 right",
        moves=[],
        leaks=[
            Leak(3.4, ("r", 2.9), 0.6, "same", drop=5.0, run=1.6),
            Leak(8.2, ("c", 0.4), 0.4, "same", drop=3.0),
            Leak(12.3, ("r", 3.2), 0.35, "same", drop=6.0),
            Leak(16.4, ("l", 3.2), 1.1, "same", drop=4.5, run=1.8, drop_change=0.3),
            Leak(20.0, ("c", -0.9), 0.25, "same", drop=6.5),
            Leak(24.5, ("r", 3.4), 0.18, "same", drop=4.5, aspect=9, rim=0.04, what="wet joint", irregular=0.12),
        ],
        darks=[Dark(6.3, ("l", 3.6), 0.5, 3.0, "soot"), Dark(22.2, ("l", 3.2), 0.4, 3.0, "repair", 0.7)],
        old=epoch("mobile", old, mobile=(0.0, 1.7, 0.0, 0.021, 0.0085, 1.0), sigma=0.002, target=2100),
        new=epoch(
            "mobile",
            new,
            rigid(8, 20, 0.02, c, [(0.003, 45.0, 0.7), (0.002, 33.0, 2.0)]),
            mobile=(0.35, 1.95, 12.0, 0.028, 0.0085, 1.4),
            sigma=0.003,
            gain=-1.8,
            gain_in_reference=-1.8,
            target=1700,
            amp_noise=0.7,
        ),
    )


def smooth_move():
    ax = Axis((532100.0, 5401200.0, 341.0), 80.0, 0.0, 0.02)
    pr = Profile(arch_profile(4.1, 2.0, -1.6))
    L = Lining(ax, pr, 25.0, 33)
    L.texture(-3.5, 0.5, 0.3, 0.5)
    L.panels(8.0, 3.0)
    L.add_rough([(0.08, 0.0005), (0.7, 0.0008), (3.0, 0.003)])
    L.make_floor("slab")
    at = pr.at
    old = pipe(pr, at("r", 0.6), 0.15, 0.08) + tray(pr, at("l", 2.3), 0.12, 3, 0.025, rng=np.random.default_rng(6))
    new = (
        pipe(pr, at("r", 0.6), 0.15, 0.08)
        + tray(pr, at("l", 2.55), 0.12, 4, 0.025, phase=0.6, rng=np.random.default_rng(7))
        + [
            Cable(pr, at("c", 0.0), 0.42, 0.30, sag=0.0, s0=14.0, db=-3.0),
            Box(pr, at("c", 0.0), 14.5, 0.3, 0.02, 0.02, period=3.0, s0=14, db=-3),
        ]
    )
    c = ax.from_local(12.5, 0, 0)
    return dict(
        kind="road, smooth in-situ concrete, arch 8.2 m wide",
        floor="slab",
        lining=L,
        moist=(-0.4, 0.3),
        cables="tray at the left higher and with one cable more; new ventilation duct of 0.6 m under the crown from s=14 to the end; pipe stays",
        moves=[
            Move("bulge", 4.5, ("r", 2.4), 1.0, 5.0),
            Move("bulge", 8.6, ("c", 1.6), 1.0, 3.0),
            Move("bulge", 12.0, ("l", 3.8), 0.4, 4.0),
            Move("bulge", 17.6, ("r", 3.0), 1.0, -5.0),
            Move("bulge", 21.4, ("l", 1.3), 1.0, 10.0, edge=0.9),
        ],
        leaks=[
            Leak(6.8, ("l", 3.3), 0.8, "grown", 1.5, 4.5, run=1.7),
            Leak(3.0, ("c", 0.9), 0.25, "new", drop=5.5, aspect=5, rim=0.05, what="wet joint", irregular=0.15),
            Leak(10.3, ("r", 2.1), 0.5, "grown", 2.0, 5.0, run=2.0),
            Leak(14.3, ("l", 3.2), 1.0, "shrunk", 0.55, 6.0, run=1.5),
            Leak(20.0, ("c", 0.0), 0.3, "same", drop=6.0),
            Leak(19.8, ("r", 3.4), 0.6, "same", drop=3.5, run=1.4),
            Leak(23.2, ("r", 2.2), 0.7, "dry", drop=5.0, run=1.7),
            Leak(1.6, ("l", 2.9), 0.35, "same", drop=2.5),
        ],
        darks=[Dark(9.4, ("c", -1.8), 0.9, 3.0, "soot", rim=0.3), Dark(16.4, ("c", -2.2), 0.5, 2.5, "repair", 0.6)],
        old=epoch("mobile", old, mobile=(0.6, 2.1, 0.0, 0.024, 0.006, 1.2), sigma=0.0015, target=2000, amp_noise=0.4),
        new=epoch(
            "mobile",
            new,
            rigid(5, 8, 0.01, c, [(0.004, 38.0, 0.2), (0.0025, 60.0, 1.0)]),
            mobile=(-0.8, 2.3, 0.0, 0.024, 0.006, 1.2),
            sigma=0.002,
            gain=0.7,
            target=2000,
            amp_noise=0.5,
        ),
    )


def shot_layer():
    ax = Axis((601500.0, 5255300.0, 902.0), 250.0, 380.0, 0.03)
    pr = Profile(arch_profile(2.7, 2.2, -1.7, bow=0.25))
    L = Lining(ax, pr, 26.0, 44)
    L.texture(-5.0, 0.7, 0.6, 0.3)
    L.add_rough([(0.06, 0.003), (0.18, 0.005), (0.6, 0.007), (2.0, 0.010)])
    L.make_floor("slab")
    at = pr.at
    old = pipe(pr, at("r", 1.9), 0.18, 0.10) + [Cable(pr, at("l", 2.9), 0.08, 0.02, sag=0.05, span=2.0)]
    new = (
        pipe(pr, at("r", 1.9), 0.18, 0.10)
        + [
            Cable(pr, at("l", 2.5), 0.08, 0.02, sag=0.06, span=2.0, phase=0.7),
            Cable(pr, at("l", 2.45), 0.10, 0.03, sag=0.05, span=2.0),
        ]
        + [Box(pr, at("l", 1.1), 10.5, 0.35, 0.6, 0.7, gap=0.08, db=-4)]
    )
    c = ax.from_local(13, 0, 0)
    return dict(
        kind="adit, shotcrete, horseshoe 5.4 m wide",
        floor="slab",
        lining=L,
        moist=(-0.2, 0.4),
        cables="sagging cable at the left hung lower, a second beside it; pipe stays; a box stands at s=10.5 left in the new epoch",
        moves=[
            Move("layer", 6.0, ("r", 3.6), 4.0, 30.0, aspect=0.8),
            Move("spall", 12.2, ("c", 0.7), 0.25, 35.0),
            Move("spall", 15.4, ("l", 3.0), 0.12, 22.0),
            Move("bulge", 19.6, ("l", 2.0), 1.0, 10.0),
            Move("bulge", 22.8, ("r", 3.2), 1.0, 5.0),
        ],
        leaks=[
            Leak(3.0, ("l", 2.2), 0.9, "grown", 1.5, 5.0, run=1.7, rim=0.1),
            Leak(9.2, ("c", -0.8), 0.35, "grown", 2.0, 5.0, rim=0.08),
            Leak(15.0, ("r", 3.1), 0.8, "shrunk", 0.5, 6.0, rim=0.1),
            Leak(10.5, ("l", 1.1), 0.5, "new", drop=6.0),
            Leak(17.4, ("c", 0.5), 0.6, "same", drop=4.5, rim=0.1, drop_change=0.3),
            Leak(20.6, ("r", 3.3), 0.5, "dry", drop=4.5, rim=0.1),
            Leak(24.4, ("l", 2.6), 0.45, "new", drop=5.0, run=1.6),
            Leak(12.4, ("l", 3.4), 0.3, "same", drop=7.0),
        ],
        darks=[Dark(24.3, ("c", -0.7), 0.6, 3.5, "soot", rim=0.2), Dark(18.0, ("l", 3.4), 0.4, 2.5, "soot", rim=0.2)],
        old=epoch(
            "static",
            old,
            stations=[(2.0, 0.3, 1.5), (9.0, 0.5, 1.5), (17.0, -0.3, 1.5), (24.0, 0.2, 1.5)],
            sigma=0.003,
            target=1400,
            amp_noise=0.6,
        ),
        new=epoch(
            "static",
            new,
            rigid(6, 15, 0.02, c),
            stations=[(5.0, -0.5, 1.6), (12.5, 0.3, 1.6), (20.0, 0.5, 1.6), (25.5, 0.0, 1.5), (0.5, 0, 1.5)],
            sigma=0.0025,
            gain=-0.9,
            target=2000,
            amp_noise=0.6,
        ),
    )


def masonry():
    ax = Axis((512345.0, 5567890.0, 233.0), 15.0, -300.0, 0.005)
    pr = Profile(arch_profile(2.5, 2.3, -1.8, bow=0.15))
    L = Lining(ax, pr, 26.0, 55)
    L.texture(-6.0, 0.6, 0.6, 0.4)
    L.masonry()
    L.add_rough([(0.05, 0.0012), (0.15, 0.0012), (1.8, 0.006)])
    L.make_floor("ballast")
    at = pr.at
    old = tray(pr, at("r", 1.5), 0.08, 2, 0.022, rng=np.random.default_rng(8), span=1.5)
    new = tray(pr, at("r", 1.2), 0.08, 3, 0.022, rng=np.random.default_rng(9), span=1.5, phase=0.6) + [
        Cable(pr, at("l", 3.0), 0.05, 0.02, sag=0.03)
    ]
    old = old + [Box(pr, at("l", 1.3), 7.5, 0.30, 0.5, 0.6, gap=0.03, db=-5)]
    c = ax.from_local(13, 0, 0)
    return dict(
        kind="railway, stone masonry, horseshoe 5 m wide",
        floor="ballast",
        lining=L,
        moist=(-0.5, 0.35),
        cables="two cables at the right hung 30 cm lower, now three; one new cable high at the left; a cabinet at s=7.5 left stood in the old epoch only",
        beware=["the ballast was tamped: the floor rose by 12 mm and its stones lie anew"],
        moves=[
            Move("spall", 5.2, ("r", 2.9), 0.22, 40.0, aspect=0.6),
            Move("spall", 13.8, ("c", -0.6), 0.10, 30.0),
            Move("bulge", 10.2, ("l", 2.4), 1.0, 10.0),
            Move("bulge", 17.5, ("r", 2.7), 1.0, 5.0),
            Move("floor", 0, mm=12.0),
        ],
        leaks=[
            Leak(3.0, ("l", 2.6), 0.9, "grown", 2.0, 5.0, run=1.6, rim=0.1),
            Leak(7.5, ("l", 1.3), 0.4, "same", drop=6.0),
            Leak(8.4, ("c", 0.6), 0.4, "grown", 1.5, 6.0),
            Leak(13.2, ("r", 2.9), 1.2, "same", drop=5.0, run=1.5, rim=0.1, drop_change=-0.3),
            Leak(15.5, ("l", 3.0), 0.8, "shrunk", 0.6, 5.5, rim=0.08),
            Leak(20.3, ("c", 0.0), 0.5, "dry", drop=6.0),
            Leak(22.3, ("r", 2.7), 0.6, "new", drop=5.5, run=1.6),
            Leak(21.6, ("l", 2.3), 1.4, "same", drop=4.0, run=1.5, rim=0.12),
        ],
        darks=[Dark(18.6, ("c", 0.0), 1.2, 3.0, "soot", rim=0.3), Dark(24.6, ("l", 2.8), 0.5, 3.0, "repair", 0.8)],
        old=epoch(
            "static",
            old,
            stations=[(2.0, 0.4, 1.6), (8.5, -0.3, 1.6), (15.5, 0.4, 1.6), (22.5, -0.4, 1.6)],
            sigma=0.0025,
            target=1500,
            amp_noise=0.7,
        ),
        new=epoch(
            "mobile",
            new,
            rigid(9, 10, 0.012, c),
            mobile=(0.1, 1.9, 20.0, 0.023, 0.0075, 1.1),
            sigma=0.003,
            gain=1.6,
            gain_in_reference=1.6,
            target=2200,
            amp_noise=0.6,
            const=24.0,
        ),
    )


def box_wall():
    ax = Axis((368200.0, 5820400.0, 31.5), 300.0, 0.0, 0.004)
    w, h0, h1 = 3.0, -1.9, 2.9
    pr = Profile(fillet([(w, h0), (w, h1), (-w, h1), (-w, h0)], [0.06, 0.25, 0.25, 0.06]))
    L = Lining(ax, pr, 30.0, 66)
    L.texture(-3.8, 0.5, 0.35, 0.5)
    L.panels(5.0, 2.5, step=0.0025, groove=(0.024, 0.012))
    L.add_rough([(0.07, 0.0006), (0.8, 0.001), (2.5, 0.003)])
    L.make_floor("slab")
    at = pr.at
    old = tray(pr, at("l", 3.4), 0.12, 4, 0.02, rng=np.random.default_rng(10)) + pipe(pr, at("r", 4.1), 0.14, 0.06)
    new = (
        tray(pr, at("l", 3.1), 0.12, 4, 0.02, phase=0.7, rng=np.random.default_rng(11))
        + pipe(pr, at("r", 4.1), 0.14, 0.06)
        + tray(pr, at("l", 1.3), 0.10, 2, 0.03, rng=np.random.default_rng(12))
        + [Box(pr, at("l", 2.1), 22.0, 0.3, 0.55, 0.6, gap=0.05)]
    )
    c = ax.from_local(15, 0, 0)
    return dict(
        kind="cut and cover, box 6.0 x 4.8 m, in-situ concrete in blocks of 5 m",
        floor="slab",
        lining=L,
        moist=(0.3, 0.25),
        cables="tray at the left 30 cm lower, a second one new at 1.3 m; pipe stays; cabinet at s=22 left in the new epoch only",
        beware=[
            "the wall that was pushed in moved along with nothing else: least squares of a section give a part of it to the section"
        ],
        moves=[
            Move("wall", 12.0, ("r", 4.2), mm=4.0, length=10.0),
            Move("bulge", 22.5, ("c", 0.6), 1.0, 3.0),
            Move("bulge", 26.2, ("l", 2.2), 0.4, 4.0),
            Move("spall", 5.0, ("c", -1.2), 0.15, 20.0),
        ],
        leaks=[
            Leak(2.5, ("r", 2.6), 0.3, "grown", 2.0, 5.0, aspect=4, run=1.5, rim=0.05, what="wet joint"),
            Leak(7.5, ("c", 0.5), 0.4, "same", drop=5.0, aspect=4, rim=0.05, what="wet joint", irregular=0.15),
            Leak(10.6, ("r", 2.2), 0.8, "grown", 1.5, 4.5, run=1.8),
            Leak(15.8, ("r", 2.4), 0.6, "dry", drop=5.0, run=1.5),
            Leak(13.8, ("l", 2.2), 0.9, "shrunk", 0.5, 6.0, run=1.5),
            Leak(19.0, ("c", -0.9), 0.5, "new", drop=3.0),
            Leak(22.0, ("l", 2.1), 0.45, "new", drop=5.0),
            Leak(25.0, ("r", 2.1), 0.7, "same", drop=7.0, run=1.6, drop_change=0.4),
            Leak(28.3, ("l", 2.0), 0.5, "grown", 1.5, 5.0, run=1.4),
        ],
        darks=[Dark(9.5, ("l", 1.9), 0.6, 2.5, "repair", 0.5), Dark(28.0, ("c", 0.9), 0.7, 3.0, "soot", rim=0.2)],
        old=epoch("mobile", old, mobile=(-0.3, 2.0, 0.0, 0.024, 0.0075, 1.2), sigma=0.002, target=1900),
        new=epoch(
            "static",
            new,
            rigid(12, 18, 0.018, c),
            stations=[(1.5, 0.5, 1.6), (8.0, -0.6, 1.65), (14.5, 0.6, 1.6), (21.0, -0.5, 1.6), (28.0, 0.4, 1.6)],
            sigma=0.002,
            gain=-1.3,
            target=2000,
            amp_noise=0.5,
        ),
    )


def shot_nothing():
    ax = Axis((645300.0, 5203100.0, 1120.0), 175.0, 320.0, -0.02)
    pr = Profile(arch_profile(2.9, 2.0, -1.7, bow=0.2))
    L = Lining(ax, pr, 26.0, 77)
    L.texture(-5.0, 0.7, 0.6, 0.3)
    L.add_rough([(0.06, 0.003), (0.2, 0.005), (0.7, 0.007), (1.8, 0.008)])
    L.make_floor("slab")
    at = pr.at
    old = pipe(pr, at("r", 1.0), 0.2, 0.10) + tray(pr, at("l", 2.6), 0.12, 2, 0.02, rng=np.random.default_rng(13), span=1.6)
    new = (
        pipe(pr, at("r", 1.0), 0.2, 0.10)
        + tray(pr, at("l", 2.2), 0.14, 3, 0.02, rng=np.random.default_rng(14), span=1.6, phase=0.8)
        + [Cable(pr, at("c", 0.9), 0.12, 0.03, sag=0.08, span=2.5)]
        + pipe(pr, at("r", 2.9), 0.16, 0.07)
        + [Box(pr, at("l", 1.2), 15.0, 0.3, 0.5, 0.6, gap=0.08)]
    )
    c = ax.from_local(13, 0, 0)
    return dict(
        kind="adit, shotcrete, horseshoe 5.8 m wide, wet walls",
        floor="slab",
        lining=L,
        moist=(0.4, 0.5),
        nothing=True,
        cables="tray at the left 40 cm lower with a cable more; new pipe at the right at 2.9 m, new sagging cable at the crown, new cabinet at s=15 left",
        moves=[],
        leaks=[
            Leak(2.8, ("r", 2.0), 2.2, "same", drop=4.0, run=1.3, rim=0.12),
            Leak(7.4, ("l", 1.5), 1.6, "same", drop=5.0, run=1.2, rim=0.12),
            Leak(11.0, ("c", -0.4), 0.5, "same", drop=6.0, rim=0.08),
            Leak(15.0, ("l", 1.2), 0.4, "same", drop=6.0),
            Leak(17.5, ("r", 2.2), 1.0, "same", drop=3.0, run=1.4, rim=0.12, drop_change=0.2),
            Leak(20.6, ("c", 0.2), 0.3, "same", drop=5.0),
            Leak(23.5, ("l", 1.6), 1.8, "same", drop=5.5, run=1.2, rim=0.12, drop_change=-0.3),
        ],
        darks=[Dark(5.0, ("c", -0.8), 0.6, 3.0, "soot", rim=0.2), Dark(13.4, ("r", 3.4), 0.4, 3.0, "repair", 1.0)],
        old=epoch(
            "static",
            old,
            stations=[(1.5, 0.3, 1.5), (8.5, -0.5, 1.6), (16.0, 0.5, 1.5), (23.0, -0.3, 1.6)],
            sigma=0.004,
            target=1300,
            amp_noise=0.7,
        ),
        new=epoch(
            "static",
            new,
            rigid(15, 17, 0.02, c),
            stations=[(4.5, -0.5, 1.7), (11.5, 0.6, 1.6), (18.5, -0.6, 1.7), (25.2, 0.2, 1.6), (0.4, 0.1, 1.6)],
            sigma=0.0025,
            gain=2.0,
            target=2200,
            amp_noise=0.5,
        ),
    )


def horse_wet():
    ax = Axis((478900.0, 5489700.0, 415.0), 208.0, 500.0, 0.01)
    pr = Profile(arch_profile(3.3, 2.1, -1.7, bow=0.3))
    L = Lining(ax, pr, 27.0, 88)
    L.texture(-4.2, 0.6, 0.35, 0.7)
    L.panels(6.0, 1.0, groove=(0.022, 0.008))
    L.add_rough([(0.07, 0.0008), (0.5, 0.001), (2.5, 0.004)])
    L.make_floor("ballast")
    at = pr.at
    old = tray(pr, at("r", 2.6), 0.10, 3, 0.02, rng=np.random.default_rng(15)) + [
        Box(pr, at("r", 1.3), 16.5, 0.35, 0.55, 0.65, gap=0.05)
    ]
    new = tray(pr, at("r", 2.85), 0.10, 3, 0.02, phase=0.4, rng=np.random.default_rng(16)) + pipe(pr, at("l", 0.5), 0.12, 0.06)
    c = ax.from_local(13.5, 0, 0)
    return dict(
        kind="railway, in-situ concrete, horseshoe 6.6 m wide, wet walls",
        floor="ballast",
        lining=L,
        moist=(-0.4, 0.4),
        cables="tray at the right 25 cm higher; new pipe at the left foot; cabinet at s=16.5 right stood in the old epoch only",
        moves=[
            Move("oval", 8.0, ("c", 0.4), mm=3.0, length=6.0),
            Move("bulge", 14.6, ("l", 3.0), 1.0, 5.0),
            Move("bulge", 20.0, ("c", -1.0), 1.0, 3.0),
            Move("bulge", 23.4, ("r", 3.5), 0.4, 4.0),
        ],
        leaks=[
            Leak(3.2, ("l", 1.7), 2.0, "grown", 1.5, 5.0, run=1.2, rim=0.12),
            Leak(5.6, ("r", 1.5), 1.5, "shrunk", 0.5, 4.5, run=1.3, rim=0.1),
            Leak(11.4, ("l", 1.5), 1.8, "same", drop=6.0, run=1.2, rim=0.12, drop_change=-0.4),
            Leak(12.6, ("r", 1.7), 1.4, "dry", drop=5.0, run=1.2, rim=0.1),
            Leak(16.5, ("r", 1.3), 0.5, "same", drop=6.0),
            Leak(18.4, ("l", 1.9), 0.8, "grown", 2.0, 4.0, run=1.5, rim=0.1),
            Leak(21.4, ("r", 1.8), 1.2, "new", drop=5.0, run=1.3, rim=0.1),
            Leak(17.0, ("c", 0.2), 0.3, "new", drop=7.0),
            Leak(25.2, ("l", 1.6), 1.6, "same", drop=3.0, run=1.2, rim=0.12),
        ],
        darks=[Dark(13.0, ("c", 0.0), 1.0, 3.0, "soot", rim=0.3), Dark(23.0, ("l", 3.0), 0.45, 3.0, "repair", 0.6)],
        old=epoch(
            "static",
            old,
            stations=[(2.0, 0.6, 1.7), (8.5, -0.6, 1.7), (15.5, 0.5, 1.7), (22.5, -0.5, 1.7)],
            sigma=0.0025,
            target=1600,
            step=0.005,
        ),
        new=epoch(
            "mobile",
            new,
            Pose(),
            mobile=(-0.2, 2.0, 0.0, 0.024, 0.007, 1.2),
            sigma=0.002,
            gain=-0.6,
            gain_in_reference=-0.6,
            target=1900,
            amp_noise=0.5,
        ),
    )


SCENES = dict(
    seg_move=seg_move,
    seg_nothing=seg_nothing,
    smooth_move=smooth_move,
    shot_layer=shot_layer,
    masonry=masonry,
    box_wall=box_wall,
    shot_nothing=shot_nothing,
    horse_wet=horse_wet,
)
