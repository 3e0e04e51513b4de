"""What may have happened to a file: in its bytes, in its lines, in its numbers."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
NUMBERS = (
    b"nan",
    b"inf",
    b"-inf",
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"0",
    b"-0",
    b"-1",
    b"999999999999",
    b"1,5",
    b"0x10",
    b"",
    b"--1",
)
WORDS = (
    b"",
    b"'; DROP TABLE tunnel.tunnel; --",
    "æ–字\u202e".encode(),
    b"\x00",
    b"=1+1",
    b"x" * 70_000,
    b'"',
    b"%s",
    b"../../etc/passwd",
)

Mutation = Callable[[random.Random, bytes], bytes]


def truncate(chance: random.Random, data: bytes) -> bytes:
    """Cut the end off."""
    return data[: chance.randrange(len(data) + 1)]


def flip(chance: random.Random, data: bytes) -> bytes:
    """Change single bytes."""
    changed = bytearray(data)
    for _ in range(chance.choice((1, 1, 3, 30))):
        if changed:
            changed[chance.randrange(len(changed))] = chance.randrange(256)
    return bytes(changed)


def flip_early(chance: random.Random, data: bytes) -> bytes:
    """Change bytes where a header is."""
    return flip(chance, data[:400]) + data[400:]


def cut_out(chance: random.Random, data: bytes) -> bytes:
    """Take a piece out, or repeat it."""
    begin = chance.randrange(len(data) + 1)
    end = min(len(data), begin + chance.choice((1, 7, 64, 4096)))
    return data[:begin] + data[end:] if chance.random() < 0.5 else data[:end] + data[begin:]


def put_in(chance: random.Random, data: bytes) -> bytes:
    """Put noise in."""
    place = chance.randrange(len(data) + 1)
    return data[:place] + chance.randbytes(chance.choice((1, 8, 200))) + data[place:]


def change_number(chance: random.Random, data: bytes) -> bytes:
    """Put another in the place of a number, or lose its decimal point or its sign."""
    found = list(NUMBER.finditer(data))
    for match in sorted(chance.sample(found, min(len(found), chance.choice((1, 1, 1, 5)))), key=lambda m: -m.start()):
        text = match.group()
        other = chance.choice((*NUMBERS, text.replace(b".", b""), b"-" + text, text * 2, text.replace(b".", b",")))
        data = data[: match.start()] + other + data[match.end() :]
    return data


def change_line(chance: random.Random, data: bytes) -> bytes:
    """Take a line away, repeat it, swap two, or put a word in."""
    lines = data.split(b"\n")
    first, second = chance.randrange(len(lines)), chance.randrange(len(lines))
    way = chance.randrange(4)
    if way == 0:
        del lines[first]
    elif way == 1:
        lines.insert(first, lines[second])
    elif way == 2:
        lines[first], lines[second] = lines[second], lines[first]
    else:
        cells = lines[first].split(b",")
        cells[chance.randrange(len(cells))] = chance.choice(WORDS)
        lines[first] = b",".join(cells)
    return b"\n".join(lines)


def drop_column(chance: random.Random, data: bytes) -> bytes:
    """Take a column away, or its name."""
    lines = data.split(b"\n")
    place = chance.randrange(lines[0].count(b",") + 1)
    rows = [line.split(b",") for line in lines]
    for row in rows if chance.random() < 0.5 else rows[:1]:
        if place < len(row):
            del row[place]
    return b"\n".join(b",".join(row) for row in rows)


def encode_otherwise(chance: random.Random, data: bytes) -> bytes:
    """Write text in another encoding, with a mark, with other ends of lines, or nothing at all."""
    text = data.decode("latin-1")
    return chance.choice(
        (
            text.encode("utf-16"),
            b"\xef\xbb\xbf" + data,
            data.replace(b"\n", b"\r"),
            data.replace(b",", b";"),
            b"",
            b"\n",
            data[::-1],
        )
    )


MUTATIONS: tuple[Mutation, ...] = (truncate, flip, flip_early, cut_out, put_in, change_number, change_line, encode_otherwise)
OF_TEXT: tuple[Mutation, ...] = (
    change_number,
    change_number,
    change_number,
    change_line,
    change_line,
    drop_column,
    encode_otherwise,
)


def mutate(chance: random.Random, data: bytes, *, text: bool) -> tuple[bytes, str]:
    """Return a file to which something happened, and what it was."""
    choices = MUTATIONS + OF_TEXT if text else MUTATIONS
    done = [chance.choice(choices) for _ in range(chance.choice((1, 1, 1, 2)))]
    for mutation in done:
        data = mutation(chance, data)
    return data, "+".join(mutation.__name__ for mutation in done)
