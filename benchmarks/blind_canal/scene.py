"""What a round of canals is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Scene:
    """A canal, its laser and sonar scans, and its truth.

    Attributes
    ----------
    name : str
        Letters, digits and hyphens.
    description : str
        What it shows.
    make : callable
        Writes the files into a folder that is there.
    """

    name: str
    description: str
    make: Callable[[Path], None]
