"""Requests of people at the desk, and their times."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import httpx2
import numpy as np

from benchmarks.serve.survey import PASSWORD, SURVEY
from tunneldb.raster.tiles import EDGE


@dataclass
class Person:
    """Somebody who is signed in."""

    name: str
    client: httpx2.Client
    seconds: list[float] = field(default_factory=list)
    written: list[int] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)


def sign_in(address: str, name: str) -> Person:
    """Sign somebody in."""
    client = httpx2.Client(base_url=address, timeout=30.0)
    token = re.search(r'name="csrf" value="([^"]+)"', client.get("/login").text)
    assert token
    answer = client.post("/login", data={"user": name, "password": PASSWORD, "csrf": token[1]})
    assert answer.status_code == 303, answer.text
    page = client.get("/").text
    csrf = re.search(r'name="csrf" content="([^"]+)"', page)
    assert csrf, page
    client.headers["X-CSRF-Token"] = csrf[1]
    return Person(name, client)


def tile_seconds(person: Person, length: float, count: int) -> tuple[list[float], list[float]]:
    """Ask for tiles of all zooms at random places, each twice; return the seconds of the first and of the second time."""
    rng = np.random.default_rng(7)
    paths = []
    for n in range(count):
        zoom = 12 + n % 12
        pixel = 2 * EDGE / 256 / 2**zoom
        column = int((rng.uniform(0, length) + EDGE) // (256 * pixel))
        row = int((EDGE - rng.uniform(-8, 8)) // (256 * pixel))
        paths.append(f"/tiles/{SURVEY}/{('corrected', 'offset')[n % 2]}/{zoom}/{column}/{row}.png")
    first, second = [], []
    for path in paths:
        for seconds in (first, second):
            start = time.perf_counter()
            answer = person.client.get(path)
            seconds.append(time.perf_counter() - start)
            assert answer.status_code in (200, 204), answer.text
    return first, second


def review_all(people: Sequence[Person], each: int) -> None:
    """All review at once, each their own findings, one verdict after the other."""
    listed = people[0].client.get(f"/api/surveys/{SURVEY}/worklist?order=chainage").json()
    open_ones = [one["id"] for one in listed if one["review"] == "open"]

    def work(person: Person, ids: Sequence[int]) -> None:
        for key in ids:
            finding = person.client.get(f"/api/findings/{key}").json()
            seen = {name: finding[name] for name in ("review", "remark", "kind")}
            start = time.perf_counter()
            answer = person.client.patch(f"/api/findings/{key}", json={"seen": seen, "values": {"review": "confirmed"}})
            person.seconds.append(time.perf_counter() - start)
            if answer.status_code == 200 and answer.json()["written"]:
                person.written.append(key)
            else:
                person.errors.append(answer.text[:200])

    threads = [
        threading.Thread(target=work, args=(person, open_ones[n :: len(people)][:each])) for n, person in enumerate(people)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
