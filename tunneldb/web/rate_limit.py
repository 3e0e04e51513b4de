"""Limit of failed sign-ins, by address, by user, and by both."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable

MAX_FAILURES = 5
"""Number of failures of a user from an address within PERIOD after which further attempts are refused."""

MAX_ADDRESS_FAILURES, MAX_USER_FAILURES = 20, 50
"""The same of an address for all users, and of a user from all addresses: somebody else must not lock a person out easily."""

PERIOD = 60.0
"""Time after which a failure is forgotten, s."""

MAX_NAMES = 10_000
"""Number of names whose failures are kept; the oldest are forgotten first."""


class RateLimit:
    """Recent attempts to sign in. An attempt counts as a failure until it has succeeded, so that many at once do not pass.

    Parameters
    ----------
    clock : callable
        Returns a time, s.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._failures: OrderedDict[str, list[float]] = OrderedDict()

    def attempt(self, user: str, address: str) -> bool:
        """Note an attempt; return False, without noting it, if there were too many."""
        now = self._clock()
        limits = _limits(user, address)
        with self._lock:
            recent = {name: [at for at in self._failures.get(name, ()) if now - at < PERIOD] for name in limits}
            if any(len(recent[name]) >= limit for name, limit in limits.items()):
                return False
            for name in limits:
                self._failures[name] = [*recent[name], now]
                self._failures.move_to_end(name)
            while len(self._failures) > MAX_NAMES:
                self._failures.popitem(last=False)
            return True

    def succeeded(self, user: str, address: str) -> None:
        """Take the last attempt back: it was none of a stranger."""
        with self._lock:
            for name in _limits(user, address):
                if self._failures.get(name):
                    self._failures[name].pop()


def _limits(user: str, address: str) -> dict[str, int]:
    user = user[:200]
    return {
        f"user {user} from {address}": MAX_FAILURES,
        f"address {address}": MAX_ADDRESS_FAILURES,
        f"user {user}": MAX_USER_FAILURES,
    }
