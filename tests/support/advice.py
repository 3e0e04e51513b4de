"""Advice in the message of a refused call."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

from tunneldb.errors import UserError


def advised(call: Callable[[], Any], advice: str) -> re.Match[str]:
    """Return the match of an advice in the message of a refused call."""
    with pytest.raises(UserError) as refused:
        call()
    found = re.search(advice, str(refused.value))
    assert found, refused.value
    return found
