"""Initial circles of a fit: Taubin's, and the circle nearest to half of the points."""

from __future__ import annotations

import numpy as np

from tunneldb.arrays import Float

_TRIPLES = 300
_SAMPLE = 500  # points used to compare candidates


def taubin(xy: Float) -> Float | None:
    """Fit a circle by Taubin's algebraic method.

    Parameters
    ----------
    xy : (n, 2) float array
        Points, m, n ≥ 3.

    Returns
    -------
    (3,) float array or None
        Centre and radius, m; None if the points lie on a line.

    Notes
    -----
    Taubin (1991), by the singular value decomposition of Al-Sharadqah & Chernov (2009, section 7). Its essential bias is half
    that of Pratt's fit, and small arcs are not underestimated as by Kåsa's.
    """
    middle = xy.mean(axis=0)
    near = xy - middle
    square = np.einsum("ij,ij->i", near, near)
    mean = square.mean()
    if not mean > 0.0:
        return None
    design = np.column_stack([(square - mean) / (2.0 * np.sqrt(mean)), near])
    _, values, axes = np.linalg.svd(design, full_matrices=False)
    if values[1] < 1e-9 * values[0]:
        return None
    a = axes[2].copy()
    a[0] /= 2.0 * np.sqrt(mean)
    if abs(a[0]) < 1e-9 * np.abs(a[1:]).max() / np.sqrt(mean):
        return None
    centre = -a[1:] / (2.0 * a[0])
    return np.append(centre + middle, np.sqrt(a[1:] @ a[1:] / (4.0 * a[0] ** 2) + mean))


def nearest_to_half(xy: Float) -> Float | None:
    """Return the circle through three of many points that is nearest to half of them: centre and radius (3,), m, or None.

    Notes
    -----
    Least median of squares (Rousseeuw, 1984): up to half of the points may be outliers. The triples are drawn with a fixed
    seed, so that the same points give the same circle.
    """
    random = np.random.default_rng(len(xy))
    triples = xy[random.integers(0, len(xy), (_TRIPLES, 3))]
    first, b, c = triples[:, 0], triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0]
    cross = 2.0 * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
    wide = np.abs(cross) > 0.1 * np.abs(cross).max()
    if not wide.any() or not np.abs(cross).max() > 0.0:
        return None
    first, b, c, cross = first[wide], b[wide], c[wide], cross[wide]
    bb, cc = (b**2).sum(axis=1), (c**2).sum(axis=1)
    out = np.column_stack([c[:, 1] * bb - b[:, 1] * cc, b[:, 0] * cc - c[:, 0] * bb]) / cross[:, None]
    centres, radii = first + out, np.linalg.norm(out, axis=1)
    some = xy[random.permutation(len(xy))[:_SAMPLE]]
    off = np.abs(np.linalg.norm(some[:, None] - centres, axis=2) - radii)
    best = int(np.argmin(np.median(off, axis=0)))
    return np.append(centres[best], radii[best])
