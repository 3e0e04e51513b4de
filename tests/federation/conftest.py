"""A hub of two databases on the tests' server, north and south, each with the example survey."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import psycopg
import pytest
from support.databases import Copies
from support.federation import Federation


def _federation(copies: Copies, template: str) -> Iterator[Federation]:
    with ExitStack() as stack:
        north, south = (stack.enter_context(copies.copy(template)) for _ in range(2))
        federation = Federation(stack.enter_context(copies.copy("template0")), north, south)
        with psycopg.connect(south) as connection:
            connection.execute("UPDATE tunnel.survey SET name = 'south-2024'")
            connection.execute("UPDATE tunnel.tunnel SET name = 'south'")
        yield federation


@pytest.fixture
def federation(copies: Copies, people: None, example_template: str) -> Iterator[Federation]:
    """Hub without servers."""
    yield from _federation(copies, example_template)


@pytest.fixture(scope="module")
def shared_federation(copies: Copies, people: None, example_template: str) -> Iterator[Federation]:
    """Hub of both servers, which the tests of a module do not change."""
    for federation in _federation(copies, example_template):
        federation.add("north")
        federation.add("south")
        yield federation
