"""Limit of failed sign-ins, by address and by user."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable

MAX_FAILURES = 5
"""Number of failures within PERIOD after which further attempts are refused."""

PERIOD = 60.0
"""Time after which a failure is forgotten, s."""

MAX_NAMES = 10_000
"""Number of names whose failures are kept; the oldest are forgotten first."""


class RateLimit:
    """Failures by name.

    Parameters
    ----------
    clock : callable
        Returns a time, s.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._failures: OrderedDict[str, list[float]] = OrderedDict()

    def refuses(self, *names: str) -> bool:
        """Return True if one of these names has too many recent failures."""
        now = self._clock()
        with self._lock:
            return any(sum(now - at < PERIOD for at in self._failures.get(name, ())) >= MAX_FAILURES for name in names)

    def failed(self, *names: str) -> None:
        """Note a failure of these names."""
        now = self._clock()
        with self._lock:
            for name in names:
                recent = [at for at in self._failures.pop(name, []) if now - at < PERIOD]
                self._failures[name] = [*recent, now][-MAX_FAILURES:]
            while len(self._failures) > MAX_NAMES:
                self._failures.popitem(last=False)
