"""What stands before the lining: tubes along the tunnel and boxes, and what of them a beam meets first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .geometry import Array, Mask

Index = npt.NDArray[np.intp]
REACH = 4.0
SLACK = 0.004


@dataclass(frozen=True)
class Tube:
    """A cable or a pipe along the tunnel.

    Attributes
    ----------
    u, w : float
        Its axis in the section, in m.
    radius : float
        In m.
    start, end : float
        Chainages of its ends.
    db : float
        10 lg of its reflectance.
    gloss : float
        Share of its reflection that is a lobe about the normal.
    sag, bay : float
        By how much it hangs through between supports, and their distance.
    """

    u: float
    w: float
    radius: float
    start: float
    end: float
    db: float
    gloss: float = 0.0
    sag: float = 0.0
    bay: float = 1.2

    @property
    def centre(self) -> tuple[float, float, float]:
        """Centre of the ball about a short tube."""
        return (self.start + self.end) / 2, self.u, self.w

    @property
    def size(self) -> float:
        """Half the largest extent of its section."""
        return self.radius + self.sag

    def meet(self, p: Array, d: Array, beam: Array, rng: np.random.Generator) -> tuple[Array, Array, Array]:
        """See `Box.meet`."""
        square = np.maximum(d[:, 1] ** 2 + d[:, 2] ** 2, 1e-9)
        pu, pw = p[:, 1] - self.u, p[:, 2] - self.w
        near = -(pu * d[:, 1] + pw * d[:, 2]) / square
        if self.sag:
            phase = np.mod((p[:, 0] + near * d[:, 0] - self.start) / self.bay, 1.0)
            pw = pw + self.sag * 4 * phase * (1 - phase)
            near = -(pu * d[:, 1] + pw * d[:, 2]) / square
        miss = np.hypot(pu + near * d[:, 1], pw + near * d[:, 2])
        share = np.clip(0.5 - 0.5 * (miss - self.radius) / beam, 0.0, 1.0)
        chord = np.sqrt(np.maximum(self.radius**2 - miss**2, 0.0) / square)
        along = np.where(np.abs(d[:, 0]) < 1e-9, 1e-9, d[:, 0])
        ends = np.sort(np.stack([(self.start - p[:, 0]) / along, (self.end - p[:, 0]) / along]), axis=0)
        tau = np.maximum(near - chord, ends[0])
        share[tau > np.minimum(near + chord, ends[1])] = 0.0
        round_cos = np.sqrt(np.maximum(1 - (miss / self.radius) ** 2, 0.0)) * np.sqrt(square)
        cos = np.where(ends[0] > near - chord, np.abs(d[:, 0]), round_cos)
        return tau, share, np.maximum(cos, 0.15)


@dataclass(frozen=True)
class Box:
    """A block: lamp, bracket, walkway, rail.

    Attributes
    ----------
    c, u, w : float
        Its centre in m.
    half : tuple of float
        Half its sizes along the tunnel, along ``turn`` and square to both.
    db : float
        10 lg of its reflectance.
    turn : tuple of float
        Unit vector (u, w) of its second side.
    gloss : float
        Share of its reflection that is a lobe about the normal.
    """

    c: float
    u: float
    w: float
    half: tuple[float, float, float]
    db: float
    turn: tuple[float, float] = (1.0, 0.0)
    gloss: float = 0.0

    @property
    def start(self) -> float:
        """Chainage of its beginning."""
        return self.c - self.half[0]

    @property
    def end(self) -> float:
        """Chainage of its end."""
        return self.c + self.half[0]

    @property
    def size(self) -> float:
        """Half the largest extent of its section."""
        return float(np.hypot(self.half[1], self.half[2]))

    def meet(self, p: Array, d: Array, beam: Array, rng: np.random.Generator) -> tuple[Array, Array, Array]:
        """Where rays enter.

        Returns
        -------
        tuple of ndarray
            Distance along the ray from the lining (negative before it), share of the beam that is met, cosine of incidence.
        """
        tu, tw = self.turn
        q = np.stack([p[:, 0] - self.c, (p[:, 1] - self.u) * tu + (p[:, 2] - self.w) * tw], axis=1)
        q = np.column_stack([q, -(p[:, 1] - self.u) * tw + (p[:, 2] - self.w) * tu])
        e = np.column_stack([d[:, 0], d[:, 1] * tu + d[:, 2] * tw, -d[:, 1] * tw + d[:, 2] * tu])
        e = np.where(np.abs(e) < 1e-9, 1e-9, e)
        share = np.zeros(len(p))
        tau, cos = np.zeros(len(p)), np.ones(len(p))
        for grow, low, high in ((1.0, 0.05, 0.5), (0.0, 0.5, 0.95), (-1.0, 1.0, 1.0)):
            sides = np.maximum(np.asarray(self.half) + grow * beam[:, None], 1e-3)
            first = (-np.sign(e) * sides - q) / e
            last = (np.sign(e) * sides - q) / e
            enter = first.max(axis=1)
            hit = enter < last.min(axis=1)
            share[hit] = rng.uniform(low, high, int(hit.sum()))
            tau[hit] = enter[hit]
            face = np.take_along_axis(np.abs(e), first.argmax(axis=1)[:, None], axis=1)[:, 0]
            cos[hit] = np.clip(face, 0.15, 1.0)[hit]
        return tau, share, cos


Thing = Tube | Box


@dataclass
class Cover:
    """What lies before the lining on each ray: distance from it, share of the beam, cosine, reflectance, gloss, width."""

    tau: Array
    share: Array
    cos: Array
    db: Array
    gloss: Array


def cover(things: list[Thing], p: Array, d: Array, room: Array, beam: Array, rng: np.random.Generator) -> Cover:
    """Nearest thing on each ray.

    Parameters
    ----------
    things : list
        What stands about.
    p, d : ndarray
        Points (n, 3) where rays meet the lining, as (c, u, w), and their directions.
    room : ndarray
        Length of each ray.
    beam : ndarray
        Radius of the beam at the lining in m.
    rng : numpy.random.Generator
        For the share of beams at edges.
    """
    n = len(p)
    out = Cover(np.zeros(n), np.zeros(n), np.ones(n), np.zeros(n), np.zeros(n))
    order = np.argsort(p[:, 0])
    chain = p[order, 0]
    slant = np.maximum(np.hypot(d[:, 1], d[:, 2]), 0.05)
    for thing in things:
        near = order[np.searchsorted(chain, thing.start - REACH) : np.searchsorted(chain, thing.end + REACH)]
        ahead = _ahead(thing, p, d, slant, near)
        if not len(ahead):
            continue
        tau, share, cos = thing.meet(p[ahead], d[ahead], beam[ahead], rng)
        good = (share > 0.03) & (tau < -SLACK) & (tau > -np.minimum(REACH, room[ahead] - 0.5)) & (tau < out.tau[ahead])
        good &= (share >= 0.5) | (out.share[ahead] < 0.5)
        index = ahead[good]
        out.tau[index], out.share[index], out.cos[index] = tau[good], share[good], cos[good]
        out.db[index], out.gloss[index] = thing.db, thing.gloss
    return out


def _ahead(thing: Thing, p: Array, d: Array, slant: Array, near: Index) -> Index:
    """Of the rays ``near`` those whose line in the section passes close to the thing."""
    du, dw = d[near, 1], d[near, 2]
    miss = np.abs((p[near, 1] - thing.u) * dw - (p[near, 2] - thing.w) * du) / slant[near]
    facing: Mask = (miss < thing.size + 0.02) & ((p[near, 1] - thing.u) * du + (p[near, 2] - thing.w) * dw > -thing.size)
    ahead: Index = near[facing]
    return ahead
