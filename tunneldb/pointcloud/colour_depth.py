"""Colours of a scan file: if there are any, and if they have 8 or 16 bits.

LAS demands 16 bits, but some files have 8; text files and PLY have either. The largest value decides. It is read from a sample
of the whole file, so that all kilometres of a file have the same answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from tunneldb.pointcloud.file_sample import BLOCK
from tunneldb.pointcloud.formats.table import format_of, has_colours
from tunneldb.pointcloud.points import CHUNK, MAX_COLOUR
from tunneldb.pointcloud.reader import read_header

EIGHT_BITS = 255
"""Maximum value of 8-bit colours."""

RUNS, RUN_POINTS = 20, 2_000
"""Number of runs of a sample, spread evenly over the file, and of points of a run."""

WHOLE = 200_000
"""Number of points up to which a file is read whole."""


@dataclass(frozen=True)
class ColourDepth:
    """Colours of a file.

    Attributes
    ----------
    maximum : int
        Value of full red, green or blue: EIGHT_BITS or MAX_COLOUR; 0 if no point of the sample has a colour, or colours are
        fractions of 1.
    sampled : bool
        True if the values decided, not the format.
    """

    maximum: int
    sampled: bool = True

    def __str__(self) -> str:
        bits = {0: "black or fractions of 1, not usable", EIGHT_BITS: "8 bits", MAX_COLOUR: "16 bits"}[self.maximum]
        return f"{bits}, by a sample" if self.sampled else bits

    def note(self, path: Path) -> str | None:
        """Return a note for the user on what was assumed; None if nothing was."""
        if not self.sampled or self.maximum == MAX_COLOUR:
            return None
        if not self.maximum:
            return f"{path.name}: has fields for colours, but they are black or fractions of 1; no image in colour"
        return f"{path.name}: no colour is above {EIGHT_BITS}, so colours are read as 8 bits"


def colour_depth(path: Path) -> ColourDepth | None:
    """Return the depth of the colours of a scan file; None if its points have none.

    Raises
    ------
    InputError
        If the file cannot be read or contains no points.
    """
    if not has_colours(path):
        return None
    if format_of(path).name == "E57":
        return ColourDepth(MAX_COLOUR, sampled=False)  # its header states the limits, which the reader applies
    status = path.stat()
    return _sampled(path, (status.st_size, status.st_mtime_ns))


@lru_cache(maxsize=1024)
def _sampled(path: Path, version: tuple[int, int]) -> ColourDepth:
    """Return the depth by a sample, once for each version of a file."""
    points = read_header(path).points
    begins = sorted({points * run // RUNS // BLOCK * BLOCK for run in range(RUNS)})  # beginnings of chunks of LAZ
    ranges = [(begin, begin + RUN_POINTS) for begin in begins] if points > WHOLE else None
    most = 0
    for raw in format_of(path).read(path, None, CHUNK, ranges, True):
        if raw.colour is not None:
            most = max(most, int(raw.colour.max(initial=0)))
    return ColourDepth(MAX_COLOUR if most > EIGHT_BITS else EIGHT_BITS if most > 1 else 0)
