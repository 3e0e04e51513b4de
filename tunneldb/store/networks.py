"""Segmentation networks of owners: from a file into the database, and from there to detection."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import psycopg

from tunneldb.errors import InputError
from tunneldb.segmentation.network import Network, standard_network

PARAMETER = "detect.model"
"""Parameter whose value is the number of a network."""

NONE, STANDARD = 0, 1
"""Numbers of no network, and of that which comes with the program."""

MAX_BYTES = 50_000_000
"""Maximum size of a network's file."""


def names_network(assignment: str) -> bool:
    """Return True if a parameter set as ``name=value`` is a network's file."""
    return assignment.startswith(f"{PARAMETER}=") and assignment.endswith(".onnx")


def add_networks(conn: psycopg.Connection[Any], assignments: Sequence[str]) -> list[str]:
    """Return parameters set as ``name=value``, with the number of the stored network in the place of a network's file.

    A new network is stored and committed.

    Raises
    ------
    InputError
        If the file is none of a segmentation network.
    """
    return [f"{PARAMETER}={_add(conn, Path(one.partition('=')[2]))}" if names_network(one) else one for one in assignments]


def load_network(conn: psycopg.Connection[Any], number: int) -> Network | None:
    """Return a network by its number: NONE, STANDARD, or that of a stored one.

    Raises
    ------
    InputError
        If there is none.
    """
    if number == NONE:
        return None
    if number == STANDARD:
        return standard_network()
    row = conn.execute("SELECT version, model FROM tunnel.segmentation_network WHERE id = %s", [number]).fetchone()
    if row is None:
        raise InputError(
            f"{PARAMETER}={number}: there is no such network; tunneldb run SURVEY --set {PARAMETER}=FILE.onnx adds one"
        )
    return _network(row[0], bytes(row[1]))


def _add(conn: psycopg.Connection[Any], path: Path) -> int:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"{path}: {path.stat().st_size} bytes are too many for a network; the maximum is {MAX_BYTES}")
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    try:
        network = Network.load(content, path.stem)
    except ValueError as error:
        raise InputError(f"{path}: no segmentation network: {error}; see docs/network.md for its inputs and outputs") from None
    checksum = hashlib.sha256(content).hexdigest()
    number = int(checksum[:8], 16) >> 1  # the same in every database
    conn.execute(
        "INSERT INTO tunnel.segmentation_network (id, version, checksum, model) VALUES (%s, %s, %s, %s)"
        " ON CONFLICT (checksum) DO NOTHING",
        [number, network.version, checksum, content],
    )
    conn.commit()
    return number


@lru_cache(2)
def _network(version: str, content: bytes) -> Network:
    return Network.load(content, version)
