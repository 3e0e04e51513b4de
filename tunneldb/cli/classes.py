"""What the verbs that write classes have in common."""

from __future__ import annotations

from tunneldb.arrays import Int64
from tunneldb.classification.classes import PointClass
from tunneldb.cli.output import tell
from tunneldb.cli.tables import print_table


def print_classes(counts: Int64) -> None:
    """Print a table of the classes that points (256,) have, and tell of them."""
    total = int(counts.sum())
    tell(points=total, classes={klass.name.lower(): int(counts[klass]) for klass in PointClass if counts[klass]})
    rows = [
        (int(klass), klass.name.lower(), f"{int(counts[klass]):,}".replace(",", " "), f"{100.0 * counts[klass] / total:.2f} %")
        for klass in PointClass
        if counts[klass]
    ]
    print_table(("class", "", "points", "share"), rows, right=(0, 2, 3))
