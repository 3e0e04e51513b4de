"""What a round is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Scene:
    """A tunnel, its scan and its truth.

    Attributes
    ----------
    name : str
        Letters, digits and hyphens.
    lining : str
        What it is lined with: ``segments``, ``cast``, ``shotcrete``, ``brick``, ``stone``, ``rock``, ``tiles``, …
    phenomenon : str
        What is particular about it.
    description : str
        What it shows, and where such a thing is described.
    make : callable
        Writes the files into a folder that is there.
    """

    name: str
    lining: str
    phenomenon: str
    description: str
    make: Callable[[Path], None]
