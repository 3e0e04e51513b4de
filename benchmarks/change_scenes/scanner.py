"""Beams onto the lining and the things before it; files a surveyor would hand over."""

from __future__ import annotations

import math

import laspy
import numpy as np
import pyproj

CHUNK = 60000
TOP = 0.10  # nothing of the lining stands farther in than this


class Field:
    """Values at the nodes (s, u); bilinear, periodic in u."""

    def __init__(self, lining, values):
        self.ds, self.du = lining.ds, lining.profile.du
        self.ns, self.nu = values.shape
        self.v = np.ascontiguousarray(np.c_[values, values[:, :1]], np.float32).ravel()

    def __call__(self, s, u, slope=False):
        fs, fu = np.clip(s / self.ds, 0, self.ns - 1.001), u / self.du
        i, j = fs.astype(np.int64), np.minimum(fu.astype(np.int64), self.nu - 1)
        a, b = fs - i, fu - j
        w = self.nu + 1
        k = i * w + j
        v00, v01, v10, v11 = self.v[k], self.v[k + 1], self.v[k + w], self.v[k + w + 1]
        lo, hi = v00 + (v01 - v00) * b, v10 + (v11 - v10) * b
        val = lo + (hi - lo) * a
        if slope:
            return val, (hi - lo) / self.ds, ((v01 - v00) * (1 - a) + (v11 - v10) * a) / self.du
        return val


def trace(axis, profile, field, things, length, o, d, rmax):
    """Beams o + t d (plan frame). Returns t (nan: nothing), kind (0 lining, k thing k), s, u, cos of incidence."""
    n = len(d)
    T, K = np.full(n, np.nan), np.zeros(n, np.int16)
    S, U, C = np.zeros(n), np.zeros(n), np.ones(n)
    small = max([q.reach for q in things], default=0.0)
    for c0 in range(0, n, CHUNK):
        idx = np.arange(c0, min(n, c0 + CHUNK))
        oo, dd = (o[idx] if o.ndim == 2 else o), d[idx]
        t = np.full(len(idx), 0.4)
        tl, kl = np.full(len(idx), np.nan), np.zeros(len(idx), np.int16)
        tp = t.copy()
        act = np.arange(len(idx))
        for _ in range(110):
            p = (oo[act] if oo.ndim == 2 else oo) + t[act, None] * dd[act]
            s, x, z = axis.to_local(p)
            cell = profile.cell(x, z)
            sd = profile.dist(cell)
            f = sd - TOP
            near = np.nonzero(sd < TOP + 0.03)[0]
            if len(near):
                u = profile.arc(tuple(v[near] for v in cell))
                f[near] = sd[near] - field(s[near], u)
            kind = np.zeros(len(act), np.int16)
            if things:
                w = np.nonzero(sd < small + 0.1)[0]
                far = sd - small
                m = np.ones(len(act), bool)
                m[w] = False
                f[m] = np.minimum(f[m], far[m])
                sw, xw, zw = s[w], x[w], z[w]
                best = np.full(len(w), np.inf)
                bk = np.zeros(len(w), np.int16)
                for k, q in enumerate(things, 1):
                    v = q.sdf(sw, xw, zw)
                    less = v < best
                    best[less] = v[less]
                    bk[less] = k
                less = best < f[w]
                f[w[less]] = best[less]
                kind[w[less]] = bk[less]
            hit = f < 0.0005
            ta = t[act]
            h = act[hit]
            tl[h], kl[h] = ta[hit], kind[hit]
            go = ~hit & (s > -0.3) & (s < length + 0.3) & (ta < rmax)
            back = act[go]
            tp[back] = t[back]
            t[back] = ta[go] + np.maximum(0.92 * f[go], 0.0003)
            act = back
            if not len(act):
                break
        # refinement of what hit the lining: between the last place before it and the hit
        r = np.nonzero(~np.isnan(tl) & (kl == 0))[0]
        if len(r):

            def look(t, r):
                p = (oo[r] if oo.ndim == 2 else oo) + t[:, None] * dd[r]
                s, x, z = axis.to_local(p)
                cell = profile.cell(x, z)
                u = profile.arc(cell)
                v, a, b = field(s, u, slope=True)
                return profile.dist(cell) - v, s, u, a, b

            lo, hi = tp[r].copy(), tl[r].copy()
            f = look(hi, r)[0]
            deep = f < -0.0002
            for _ in range(7):  # bisection where the last step went through an edge
                if not deep.any():
                    break
                q = np.nonzero(deep)[0]
                mid = (lo[q] + hi[q]) / 2
                fm = look(mid, r[q])[0]
                lo[q] = np.where(fm > 0, mid, lo[q])
                hi[q] = np.where(fm > 0, hi[q], mid)
            tt = hi
            for _ in range(3):
                f, s, u, a, b = look(tt, r)
                j = np.minimum((u / profile.du).astype(int), profile.n - 1)
                right, fwd = axis.frame(s)
                nrm = right * (profile.nx[j] - b * profile.tx[j])[:, None] - fwd * a[:, None]
                nrm[:, 2] = profile.nz[j] - b * profile.tz[j]
                slope = -(nrm * dd[r]).sum(1)
                tt = tt + np.clip(f / np.maximum(slope, 0.15), -0.002, 0.002)
            f, s, u, a, b = look(tt, r)
            cosi = slope / np.linalg.norm(nrm, axis=1)
            good = (np.abs(f) < 0.0003) & (s >= 0) & (s <= length) & (cosi > 0.05)
            tl[r] = np.where(good, tt, np.nan)
            S[idx[r]], U[idx[r]], C[idx[r]] = s, u, np.clip(cosi, 0.05, 1)
        r = np.nonzero(~np.isnan(tl) & (kl > 0))[0]
        if len(r):
            p = (oo[r] if oo.ndim == 2 else oo) + tl[r, None] * dd[r]
            s, x, z = axis.to_local(p)
            U[idx[r]] = profile.arc(profile.cell(x, z))
            S[idx[r]], C[idx[r]] = s, 0.75
            tl[r] = np.where((s >= 0) & (s <= length), tl[r], np.nan)
        tl[tl > rmax] = np.nan
        tl[tl < 1.5] = np.nan
        T[idx], K[idx] = tl, kl
    return T, K, S, U, C


def range_curve(r):
    """dB over range: inverse square, with the receiver blinded close by."""
    return -20 * np.log10(r) - 6.0 * np.exp(-((r / 2.0) ** 2)) - 0.02 * r


def incidence_curve(c, k):
    return 10 * k * np.log10(c)


def static_beams(step, rng):
    rows = int(math.pi / step)
    d = []
    for i in range(rows):
        th = (i + 0.5) * math.pi / rows
        if th > math.radians(155):  # tripod
            break
        m = max(8, int(2 * math.pi * math.sin(th) / step))
        a = (np.arange(m) + rng.uniform()) * 2 * math.pi / m
        d.append(np.c_[math.sin(th) * np.cos(a), math.sin(th) * np.sin(a), np.full(m, math.cos(th))])
    return np.vstack(d)


def rotation(axis_vec, angle):
    k = np.asarray(axis_vec, float) / np.linalg.norm(axis_vec)
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


class Pose:
    """Registration error: rotation about the middle of the tunnel, shift, and slow drift along s (amplitude, wave, phase) of x, z, roll."""

    def __init__(self, centre=(0, 0, 0), shift=(0, 0, 0), axis_vec=(0, 0, 1), deg=0.0, drift=None):
        self.c, self.t, self.M, self.deg, self.drift = (
            np.array(centre, float),
            np.array(shift, float),
            rotation(axis_vec, math.radians(deg)),
            deg,
            drift,
        )

    def drift_at(self, s):
        out = np.zeros((len(s), 3))
        if self.drift:
            for col, (amp, wave, ph) in zip((0, 2), self.drift):
                out[:, col] = amp * np.sin(2 * np.pi * s / wave + ph)
        return out

    def apply(self, p, s_of_pose):
        return (p - self.c) @ self.M.T + self.c + self.t + self.drift_at(s_of_pose)


def scan(scene, lining, epoch, refl, spec, rng):
    """One epoch. spec: mode, stations | (lateral, height, tilt, spacing, angle step, speed), target, sigma, amp noise, gain, pose…"""
    axis, prof, L = lining.axis, lining.profile, lining.length
    field, rf = Field(lining, epoch), Field(lining, refl)
    parts, sensors = [], []
    fz = prof.floor_z
    rmax = spec.get("rmax", 15.0)
    if spec["mode"] == "static":
        for k, (s, x, h) in enumerate(spec["stations"], 1):
            o = axis.from_local(s, x, fz + h)
            sensors.append((k, o, s))
            d = static_beams(spec["step"], rng) @ rotation((0, 0, 1), rng.uniform(0, 6)).T
            T, K, S, U, C = trace(axis, prof, field, spec["things"], L, o, d, rmax)
            parts.append(
                dict(
                    o=np.broadcast_to(o, d.shape),
                    d=d,
                    T=T,
                    K=K,
                    S=S,
                    U=U,
                    C=C,
                    src=np.full(len(d), k, np.uint16),
                    sp=np.full(len(d), s),
                    time=1000.0 * k + np.arange(len(d)) * 1e-5,
                )
            )
    else:
        lat, h, tilt, spacing, step, speed = spec["mobile"]
        n_prof = int((L + 2 * spec.get("over", 2.0)) / spacing)
        m = int(2 * math.pi / step)
        ph = rng.uniform(0, 6, 4)

        def pose_s(s):
            x = lat + 0.02 * np.sin(2 * np.pi * s / 9 + ph[0]) + 0.008 * np.sin(2 * np.pi * s / 2.3 + ph[1])
            z = fz + h + 0.008 * np.sin(2 * np.pi * s / 5 + ph[2]) + 0.003 * np.sin(2 * np.pi * s / 1.1 + ph[3])
            return axis.from_local(s, x, z)

        start = -spec.get("over", 2.0)
        for b0 in range(0, n_prof, 200):
            i = np.arange(b0, min(n_prof, b0 + 200))
            s = (start + spacing * (i[:, None] + np.arange(m) / m)).ravel()
            a = np.tile(np.arange(m) * 2 * math.pi / m, len(i))
            o = pose_s(s)
            right, fwd = axis.frame(s)
            tl = math.radians(tilt)
            d = np.cos(a)[:, None] * (right * math.cos(tl) + fwd * math.sin(tl))
            d[:, 2] += np.sin(a)
            ok = (a < math.radians(270 - 8)) | (a > math.radians(270 + 8))  # the carrier below
            s, o, d = s[ok], o[ok], d[ok]
            T, K, S, U, C = trace(axis, prof, field, spec["things"], L, o, d, rmax)
            parts.append(
                dict(o=o, d=d, T=T, K=K, S=S, U=U, C=C, src=np.ones(len(d), np.uint16), sp=s, time=5000.0 + (s - start) / speed)
            )
        st = np.arange(start - 0.5, L - start + 0.5, speed / 20)
        sensors = (5000.0 + (st - start) / speed, pose_s(st), st)
    a = {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
    del parts
    # mixed returns at edges of things
    T = a["T"]
    nxt, prv = np.roll(T, -1), T.copy()
    edge = (
        np.isfinite(T) & np.isfinite(nxt) & (a["K"] != np.roll(a["K"], -1)) & (np.abs(nxt - T) > 0.04) & (np.abs(nxt - T) < 1.0)
    )
    mix = edge & (rng.uniform(size=len(T)) < 0.3)
    T = np.where(mix, T + (nxt - T) * rng.uniform(0.1, 0.9, len(T)), T)
    K = np.where(mix, -1, a["K"])
    keep = np.isfinite(T)
    # thin where it is too dense
    ci, cj = (a["S"] / 0.2).astype(int), (a["U"] / 0.2).astype(int)
    key = ci * 1000 + cj
    cnt = np.bincount(key[keep], minlength=key.max() + 1)
    dens = cnt[key] / 0.04
    keep &= rng.uniform(size=len(T)) < spec["target"] / np.maximum(dens, 1)
    a = {k: v[keep] for k, v in a.items()}
    T, K = T[keep], K[keep]
    n = len(T)
    db = np.empty(n)
    lin = K <= 0
    db[lin] = rf(a["S"][lin], a["U"][lin])
    for k, q in enumerate(spec["things"], 1):
        w = K == k
        db[w] = q.db + rng.normal(0, 0.8, w.sum())
    amp = (
        spec["const"]
        + spec["gain"]
        + range_curve(T)
        + incidence_curve(a["C"], spec["k_inc"])
        + db
        + rng.normal(0, spec["amp_noise"], n)
    )
    sig = spec["sigma"]
    Tn = T + rng.normal(0, sig, n)
    jit = rng.normal(0, 6e-5, (n, 3))
    p = a["o"] + (a["d"] + jit) * Tn[:, None]
    pose = spec["pose"]
    p = pose.apply(p, a["sp"])
    order = np.argsort(a["time"], kind="stable")
    pts = axis.world(p)[order]
    out = dict(xyz=pts, amp=amp[order].astype(np.float32), time=a["time"][order], src=a["src"][order])
    seen = dict(S=a["S"][K == 0], U=a["U"][K == 0])
    if spec["mode"] == "static":
        rows = [(k, *axis.world(pose.apply(o[None], np.array([s])))[0]) for k, o, s in sensors]
        sens = ("stations.csv", "scan_id,x,y,z", rows)
    else:
        t, q, s = sensors
        w = axis.world(pose.apply(q, s))
        sens = ("trajectory.csv", "time,x,y,z", [(a, *b) for a, b in zip(t, w)])
    return out, sens, seen, K


def write_epoch(folder, axis, length, out, sens, spec):
    folder.mkdir(parents=True, exist_ok=True)
    head = laspy.LasHeader(version="1.4", point_format=6)
    head.add_crs(pyproj.CRS.from_epsg(25832))
    head.scales = np.full(3, 0.0005)
    head.offsets = np.floor(out["xyz"].min(0))
    head.add_extra_dim(laspy.ExtraBytesParams("Amplitude", "float32", "dB"))
    head.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    las = laspy.LasData(head)
    las.x, las.y, las.z = out["xyz"].T
    las.Amplitude = out["amp"]
    las.intensity = np.clip((out["amp"] + 20) * 1000, 0, 65535).astype(np.uint16)
    las.gps_time, las.point_source_id = out["time"], out["src"]
    las.return_number = np.ones(len(out["amp"]), np.uint8)
    las.number_of_returns = np.ones(len(out["amp"]), np.uint8)
    las.write(str(folder / "scan.laz"))
    name, cols, rows = sens
    with open(folder / name, "w") as f:
        f.write(cols + "\n")
        for r in rows:
            f.write((f"{r[0]}" if name == "stations.csv" else f"{r[0]:.4f}") + "".join(f",{v:.4f}" for v in r[1:]) + "\n")
    with open(folder / "axis.csv", "w") as f:
        f.write("x,y,z\n")
        for p in axis.world(axis.from_local(np.arange(-3.0, length + 5.9, 3.0), 0.0, 0.0)):
            f.write("{:.4f},{:.4f},{:.4f}\n".format(*p))
    with open(folder / "reference.csv", "w") as f:
        f.write("range_m,intensity_db\n")
        for r in np.arange(1.25, 20.01, 0.25):
            f.write(f"{r:.2f},{spec['const'] + spec['gain_in_reference'] + range_curve(r) + spec['reference_db']:.3f}\n")
