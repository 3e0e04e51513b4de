"""Faults of scan files, each as one line."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from tunneldb.errors import InputError, UserError
from tunneldb.pointcloud.points import Ranges


@contextmanager
def decoding(path: Path, kind: str) -> Iterator[None]:
    """Turn any error of the decoder into a UserError of one line; `kind` is the expected format."""
    try:
        yield
    except UserError:
        raise
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or line_of(error)}") from error
    except Exception as error:
        raise InputError(f"{path}: truncated, corrupt or not {kind} file: {line_of(error)}") from error
    except BaseException as error:
        if type(error).__name__ != "PanicException":  # a panic of the LAZ decoder, written in Rust
            raise
        raise InputError(f"{path}: truncated or corrupt: {line_of(error)}") from error


def line_of(error: BaseException) -> str:
    """Return the first line of an error's text, or its name."""
    return str(error).strip().split("\n", 1)[0] or type(error).__name__


def require_dimension(
    path: Path, dimension: str | None, dimensions: Collection[str], use: str | None = None, remedy: str | None = None
) -> None:
    """Raise an InputError that lists the file's dimensions unless `dimension`, needed for `use`, is one of them.

    `remedy` with the most similar dimension is the command to type.
    """
    if dimension is None or dimension in dimensions:
        return
    alike = next((name for name in dimensions if name.lower() == dimension.lower()), None)
    needed = f", which {use} needs" if use else ""
    near = alike or next(iter(difflib.get_close_matches(dimension, dimensions, 1)), None)
    meant = f" (did you mean {near!r}?{' capitals matter' if alike else ''})" if near else ""
    typed = f": {remedy} {near or 'DIMENSION'}" if remedy else ""
    available = ", ".join(dimensions) or "none"
    raise InputError(f"{path}: no dimension {dimension!r}{needed}{meant}; the file has {available}{typed}")


def check_ranges(path: Path, ranges: Ranges | None, count: int) -> Ranges:
    """Return the ranges to read: the whole file if none are given.

    Raises
    ------
    InputError
        If a range extends beyond the file's points.
    """
    if ranges is None:
        return [(0, count)]
    for begin, end in ranges:
        if not 0 <= begin <= end:
            raise ValueError(f"({begin}, {end}) is not a range of point numbers")
        if end > count:
            raise InputError(f"{path}: truncated or changed: its header states {count} points, points up to {end} requested")
    return ranges
