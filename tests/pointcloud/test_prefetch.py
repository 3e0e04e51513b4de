"""Items made ahead in a thread, and errors raised there."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator

import pytest

from tunneldb.pointcloud.prefetch import prefetch


class Resource:
    """Something that a thread makes."""


def test_items_come_in_their_order() -> None:
    assert list(prefetch(iter(range(100)), ahead=3)) == list(range(100))


def test_an_error_keeps_nothing_of_the_thread() -> None:
    """Not even until the next garbage collection, which would free objects of a thread that ended in any order."""
    made: list[weakref.ref[Resource]] = []

    def items() -> Iterator[int]:
        resource = Resource()
        made.append(weakref.ref(resource))
        yield 1
        raise ValueError(f"no more of {type(resource).__name__}")

    def read() -> str:
        try:
            for _ in prefetch(items()):
                pass
        except ValueError as error:
            return str(error)
        pytest.fail("the error of the thread was not raised")

    gc.collect()
    gc.disable()
    try:
        assert read() == "no more of Resource"
        assert made[0]() is None
    finally:
        gc.enable()
