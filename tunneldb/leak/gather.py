"""From scan files at full density to the sums of a kilometre's image."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tunneldb.errors import UserError
from tunneldb.job.sources import Source
from tunneldb.leak.image import Accumulator
from tunneldb.leak.seen import Eye, Span
from tunneldb.scan.reader import Points, read_chunks

Counts = dict[str, Any]


def gather(eye: Eye, files: list[Source], image: Accumulator, roughness: float, progress: Callable[[float], None]) -> Counts:
    """Read the files and put their points into the image."""
    total, read, used = sum(file.points for file in files), 0, 0
    span = Span()
    reference = eye.radiometer.reference if eye.radiometer else None
    for path, points in _chunks(files):
        read += len(points)
        near = eye.near(points)
        if len(near):
            seen = eye.see(near, path.name)
            if reference:
                span.add(seen, reference)
            if seen.views is None:
                raw = corrected = np.zeros(len(near), np.float32)
            else:
                raw, corrected = seen.views.raw_db, seen.views.corrected(roughness)
            used += image.add(seen.chainage, seen.arc, seen.offset, raw, corrected, seen.use)
        progress(0.9 * read / max(total, 1))
    if reference:
        span.require(reference)
    if not used:
        raise UserError(f"no point of {', '.join(file.path.name for file in files)} lies on the lining of kilometre {eye.km}")
    return {"files": len(files), "points_read": read, "points_used": used}


def _chunks(files: list[Source]) -> Iterator[tuple[Path, Points]]:
    for file in files:
        for points in read_chunks(file.path, file.dimension):
            yield file.path, points
