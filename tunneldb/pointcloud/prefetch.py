"""Work done ahead in threads, a few pieces at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from queue import Queue
from threading import Event, Thread
from typing import TypeVar

T = TypeVar("T")


def prefetch(items: Iterable[T], ahead: int = 1) -> Generator[T, None, None]:
    """Yield items while a thread makes the next ones.

    A caller that may leave before the end must close it (`contextlib.closing`), which also ends the thread.
    """
    queue: Queue[tuple[bool, T | BaseException | None]] = Queue(ahead)
    stopped = Event()

    def fill() -> None:
        try:
            for item in items:
                queue.put((True, item))
                if stopped.is_set():
                    return
            queue.put((False, None))
        except BaseException as error:
            queue.put((False, error))

    thread = Thread(target=fill, name="prefetch", daemon=True)
    thread.start()
    try:
        while True:
            good, item = queue.get()
            if good:
                yield item  # type: ignore[misc]
            elif isinstance(item, BaseException):
                try:
                    raise item
                finally:
                    # Else this frame and the traceback refer to each other, and what the thread made is freed by the garbage
                    # collector in any order: objects of PROJ after their context, which corrupts memory.
                    del item
            else:
                return
    finally:
        stopped.set()
        while thread.is_alive():
            while not queue.empty():
                queue.get()
            thread.join(0.01)


def in_order(count: int, work: Callable[[int, int], T], parts: Iterable[tuple[int, int]]) -> Iterator[T]:
    """Yield the results of parts in their order, computed by ``count`` threads only slightly ahead of the caller."""
    if count == 1:
        yield from (work(*part) for part in parts)
        return
    waiting: deque[Future[T]] = deque()
    with ThreadPoolExecutor(count, "filter") as pool:
        for part in parts:
            waiting.append(pool.submit(work, *part))
            if len(waiting) > count:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
