"""Work in blocks on the threads of this process."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

import numpy as np
import pytest

from tunneldb.threads import in_blocks, threads, use_threads


@pytest.fixture(autouse=True)
def _four_threads() -> Iterator[None]:
    before = threads()
    use_threads(4)
    yield
    use_threads(before)


@pytest.mark.parametrize(("count", "size"), [(0, 3), (1, 3), (3, 3), (100, 7)])
def test_each_item_is_worked_on_once(count: int, size: int) -> None:
    seen = np.zeros(count, np.int64)

    def work(begin: int, end: int) -> None:
        seen[begin:end] += 1

    in_blocks(work, count, size)
    assert (seen == 1).all()


def test_work_inside_of_work_ends() -> None:
    """Each of the outer blocks asks for more blocks than there are threads."""
    seen = np.zeros((8, 100), np.int64)

    def outer(begin: int, end: int) -> None:
        part = seen[begin:end]

        def inner(low: int, high: int) -> None:
            part[:, low:high] += 1

        in_blocks(inner, 100, 1)

    in_blocks(outer, 8, 1)
    assert (seen == 1).all()


def test_after_an_error_no_block_is_at_work() -> None:
    ended = []

    def work(begin: int, end: int) -> None:
        if begin == 0:
            raise ValueError("block 0")
        time.sleep(0.05)
        ended.append(begin)

    with pytest.raises(ValueError, match="block 0"):
        in_blocks(work, 50, 1)
    before = len(ended)
    time.sleep(0.2)
    assert len(ended) == before < 49


def test_a_forked_process_has_threads_of_its_own() -> None:
    in_blocks(lambda begin, end: None, 8, 1)
    child = os.fork()
    if child == 0:
        seen = np.zeros(8, np.int64)
        in_blocks(lambda begin, end: seen.__setitem__(slice(begin, end), 1), 8, 1)
        os._exit(0 if seen.all() else 1)
    for _ in range(100):
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            break
        time.sleep(0.1)
    else:
        os.kill(child, 9)
        os.waitpid(child, 0)
        pytest.fail("the child waits for threads that it has not")
    assert os.waitstatus_to_exitcode(status) == 0
