"""Pictures that others name: slow and hostile servers, internal addresses, special files, images that grow when decoded."""

from __future__ import annotations

import io
import ipaddress
import os
import signal
import socket
import struct
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from PIL import Image

from tunneldb.files import exit_on_sigterm
from tunneldb.report.pictures import load, trouble, web
from tunneldb.report.pictures.addresses import is_public, parse_address, parse_server
from tunneldb.report.pictures.load import Source, load_pictures
from tunneldb.report.pictures.trouble import PictureError

OK = b"HTTP/1.1 200 OK\r\n"


def drip(connection: socket.socket, begin: bytes, piece: bytes) -> None:
    connection.sendall(begin)
    while True:
        connection.sendall(piece)
        time.sleep(0.02)


def redirect(connection: socket.socket, place: str) -> None:
    connection.sendall(f"HTTP/1.1 302 Found\r\nLocation: {place}\r\nContent-Length: 0\r\n\r\n".encode())


Answer = Callable[[socket.socket, str], None]


@contextmanager
def server(answer: Answer, *, encrypted: bool = False) -> Iterator[str]:
    """Host and port of a server that reads a request and gives an answer to its path."""

    def serve(connection: socket.socket) -> None:
        with connection, suppress(OSError):
            request = b"" if encrypted else connection.recv(1 << 16)
            answer(connection, request.decode().split(" ")[1] if request else "")

    def accept() -> None:
        with suppress(OSError):
            while True:
                threading.Thread(target=serve, args=(listening.accept()[0],), daemon=True).start()

    with socket.create_server(("127.0.0.1", 0)) as listening:
        threading.Thread(target=accept, daemon=True).start()
        yield "{}:{}".format(*listening.getsockname())
        listening.shutdown(socket.SHUT_RDWR)


def one(path: str, folder: Path, *servers: str) -> str:
    (picture,) = load_pictures([path], Source(folder, servers)).values()
    assert bool(picture.url) != bool(picture.trouble)
    return picture.trouble


SLOW = {
    "body": lambda c, _: drip(c, OK + b"Content-Length: 100000\r\n\r\n", b"x"),
    "header": lambda c, _: drip(c, OK + b"A: ", b"x"),
    "headers": lambda c, _: drip(c, OK, b"A: x\r\n"),
    "continue": lambda c, _: drip(c, b"", b"HTTP/1.1 100 Continue\r\n\r\n"),
    "handshake": lambda c, _: drip(c, b"\x16\x03\x03\x40\x00", b"x"),
    "silent": lambda c, _: time.sleep(30),
}


def test_a_slow_server_ends_at_the_deadline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(load, "FETCH_SECONDS", 1.0)
    began = time.monotonic()
    with (
        server(lambda connection, path: SLOW[path[1:]](connection, path)) as place,
        server(SLOW["handshake"], encrypted=True) as tls,
    ):
        kinds = {f"http://{place}/{kind}": kind for kind in SLOW if kind != "handshake"} | {f"https://{tls}/1": "handshake"}
        found = load_pictures(kinds, Source(tmp_path, (place, tls)))
    said = {kind: found[path].trouble for path, kind in kinds.items()}
    assert said.pop("headers") in (trouble.TOO_SLOW, trouble.FAILED), "http.client reads at most 100 headers"
    assert set(said.values()) == {trouble.TOO_SLOW}
    assert time.monotonic() - began < 8.0


def test_all_slow_servers_together_end_at_their_deadline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(load, "FETCH_TOGETHER", 1.0)
    began = time.monotonic()
    with server(SLOW["body"]) as place:
        pictures = load_pictures([f"http://{place}/{n}.jpg" for n in range(40)], Source(tmp_path, (place,)))
    assert {picture.trouble for picture in pictures.values()} == {trouble.TOO_SLOW}
    assert time.monotonic() - began < 4.0


@pytest.mark.parametrize(("number", "error"), [(signal.SIGTERM, SystemExit), (signal.SIGINT, KeyboardInterrupt)])
def test_signals_end_the_wait(tmp_path: Path, number: signal.Signals, error: type[BaseException]) -> None:
    threading.Timer(0.5, os.kill, (os.getpid(), number)).start()
    began = time.monotonic()
    with server(SLOW["header"]) as place, exit_on_sigterm(), pytest.raises(error):
        one(f"http://{place}/1.jpg", tmp_path, place)
    assert time.monotonic() - began < 3.0


@pytest.mark.parametrize(
    ("text", "public"),
    [
        ("93.184.215.14", True), ("2606:2800:21f:cb07::1", True), ("::ffff:93.184.215.14", True), ("64:ff9b::5db8:d70e", True),
        ("127.0.0.1", False), ("10.1.2.3", False), ("172.16.0.1", False), ("192.168.1.1", False), ("169.254.169.254", False),
        ("100.64.0.1", False), ("0.0.0.0", False), ("224.0.0.1", False), ("239.1.1.1", False), ("255.255.255.255", False),
        ("240.0.0.1", False), ("::1", False), ("::", False), ("fe80::1", False), ("fc00::1", False), ("ff02::1", False),
        ("fec0::1", False), ("::ffff:127.0.0.1", False), ("::ffff:10.0.0.1", False), ("::127.0.0.1", False),
        ("64:ff9b::7f00:1", False), ("64:ff9b::a9fe:a9fe", False), ("2002:7f00:1::1", False), ("2002:a00:1::1", False),
        ("2001:0:7f00:1::1", False),
    ],
)  # fmt: skip
def test_public_addresses(text: str, public: bool) -> None:
    assert is_public(ipaddress.ip_address(text)) is public


def test_internal_servers_are_refused_and_not_asked(tmp_path: Path) -> None:
    asked = threading.Event()
    with server(lambda *_: asked.set()) as place:
        expected = {
            f"http://{place}/1.jpg": trouble.NOT_ENCRYPTED, f"https://{place}/1.jpg": trouble.NOT_PUBLIC,
            "https://localhost/1.jpg": trouble.NOT_PUBLIC, "https://[::1]/1.jpg": trouble.NOT_PUBLIC,
            "https://2130706433/1.jpg": trouble.NOT_PUBLIC, "https://0x7f.1/1.jpg": trouble.NOT_PUBLIC,
            "https://169.254.169.254/latest/meta-data": trouble.NOT_PUBLIC, "https://[fe80::1]/": trouble.NOT_PUBLIC,
            f"https://user:word@{place}/1.jpg": trouble.BAD_ADDRESS, "http://[": trouble.BAD_ADDRESS,
            "https://a\nb/1.jpg": trouble.BAD_ADDRESS, f"ftp://{place}/1.jpg": trouble.UNKNOWN_SCHEME,
            f"data://{place}/1.jpg": trouble.UNKNOWN_SCHEME, "https://no.such.host.invalid/1.jpg": trouble.NO_SERVER,
        }  # fmt: skip
        assert {path: found.trouble for path, found in load_pictures(expected, Source(tmp_path)).items()} == expected
    assert not asked.is_set()


def test_redirects_are_checked_like_the_first_address(tmp_path: Path) -> None:
    asked = threading.Event()
    goals: dict[str, str] = {}
    with (
        server(lambda *_: asked.set()) as other,
        server(lambda connection, path: redirect(connection, goals[path])) as allowed,
    ):
        goals |= {
            "/1": f"http://{other}/secret", "/2": f"https://{other}/secret", "/3": "file:///etc/hostname",
            "/4": f"http://{allowed}/4", "/5": f"//{other}/secret",
        }  # fmt: skip
        found = load_pictures([f"http://{allowed}{path}" for path in goals], Source(tmp_path, (allowed,)))
    assert [found[f"http://{allowed}{path}"].trouble for path in goals] == [
        trouble.NOT_ENCRYPTED, trouble.NOT_PUBLIC, trouble.UNKNOWN_SCHEME, trouble.REDIRECTED, trouble.NOT_ENCRYPTED,
    ]  # fmt: skip
    assert not asked.is_set()


def test_the_connection_goes_to_the_address_that_was_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    """A name that is public when it is checked, and internal when it is looked up again."""
    answers = iter(["93.184.215.14", "127.0.0.1", "127.0.0.1"])
    connected: list[tuple[str, int]] = []
    monkeypatch.setattr(
        socket, "getaddrinfo", lambda host, port, **_: [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (next(answers), port))]
    )

    def connect(address: tuple[str, int]) -> socket.socket:
        connected.append(address)
        raise ConnectionRefusedError

    monkeypatch.setattr(socket, "create_connection", connect)
    with pytest.raises(PictureError, match=trouble.NO_CONNECTION):
        web.fetch("https://rebinding.example.org/1.jpg", (), 1000)
    assert connected == [("93.184.215.14", 443)]
    monkeypatch.setattr(
        socket,
        "getaddrinfo",
        lambda host, port, **_: [(2, 1, 6, "", (address, port)) for address in ("93.184.215.14", "10.0.0.1")],
    )
    with pytest.raises(PictureError, match=trouble.NOT_PUBLIC):
        web.fetch("https://both.example.org/1.jpg", (), 1000)


def test_nothing_that_a_server_says_is_in_the_report(tmp_path: Path) -> None:
    answers = {
        "/1": b"HTTP/1.1 404 SECRET\r\n\r\nSECRET", "/2": b"HTTP/1.1 500 SECRET\r\nX: SECRET\r\n\r\n", "/3": b"SECRET\r\n",
        "/4": OK + b"\r\nSECRET", "/5": b"HTTP/1.1 302 SECRET\r\nLocation: https://SECRET SECRET/\r\n\r\n",
    }  # fmt: skip
    with server(lambda connection, path: connection.sendall(answers[path])) as place:
        found = load_pictures([f"http://{place}{path}" for path in answers], Source(tmp_path, (place,)))
    assert {picture.trouble for picture in found.values()} <= {text for name, text in vars(trouble).items() if name.isupper()}


def test_allowed_servers() -> None:
    assert parse_server("Photos.Example.org:8443") == "photos.example.org:8443"
    assert parse_server("[::1]:80") == "[::1]:80"
    for wrong in ("a@", "https://a", "a/b", "a:b", "user@a", "a b", "a:99999"):
        with pytest.raises(ValueError, match=r"."):
            parse_server(wrong)
    assert parse_address("http://a.example/1.jpg", ("a.example",)).allowed
    assert not parse_address("https://a.example:8443/1.jpg", ("a.example",)).allowed
    assert parse_address("https://a.example:8443/1.jpg", ("a.example:8443",)).allowed
    assert parse_address("https://bücher.example/ö 1.jpg?q=1", ()).host == "xn--bcher-kva.example"
    assert parse_address("https://bücher.example/ö 1.jpg?q=1", ()).path == "/%C3%B6%201.jpg?q=1"


def test_files_are_regular_and_in_the_folder(tmp_path: Path) -> None:
    folder = tmp_path / "photos"
    (folder / "sub").mkdir(parents=True)
    Image.new("RGB", (8, 8)).save(folder / "sub" / "a.png")
    Image.new("RGB", (8, 8)).save(tmp_path / "other.png")
    (folder / "inside.png").symlink_to("sub/a.png")
    (folder / "outside.png").symlink_to(tmp_path / "other.png")
    (folder / "circle.png").symlink_to("circle.png")
    (folder / "empty.png").touch()
    os.mkfifo(folder / "pipe.png")
    with (folder / "sparse.png").open("wb") as file:
        file.truncate(1 << 40)
    with socket.socket(socket.AF_UNIX) as there:
        there.bind(str(folder / "socket.png"))
    expected = {
        "sub/a.png": "", str(folder / "sub" / "a.png"): "", f"file://{folder}/sub/a.png": "", "inside.png": "",
        "sub/../sub/a.png": "",
        "../other.png": trouble.OUTSIDE, str(tmp_path / "other.png"): trouble.OUTSIDE, "outside.png": trouble.OUTSIDE,
        "/etc/passwd": trouble.OUTSIDE, "/no/such/file": trouble.OUTSIDE, "/proc/kmsg": trouble.OUTSIDE,
        "gone.png": trouble.NO_FILE, "a\0b": trouble.NO_FILE, "sub/a.png/x": trouble.NO_FILE,
        "sub": trouble.NO_IMAGE, "": trouble.NO_IMAGE, "empty.png": trouble.NO_IMAGE,
        "pipe.png": trouble.NOT_REGULAR, "socket.png": trouble.NOT_REGULAR, "sparse.png": trouble.TOO_LARGE,
        "x" * 5000: trouble.UNREADABLE,
    }  # fmt: skip
    pictures = load_pictures(expected, Source(folder))
    assert {path: picture.trouble for path, picture in pictures.items()} | {"circle.png": ""} == expected | {"circle.png": ""}
    assert one("circle.png", folder) in (trouble.UNREADABLE, trouble.NO_FILE)
    system = {"/proc/kmsg": trouble.NO_IMAGE, "/proc/self/mem": trouble.NO_IMAGE, "/dev/zero": trouble.NOT_REGULAR}
    found = load_pictures(system, Source(Path("/")))
    assert {path: found[path].trouble for path in system if os.path.exists(path)}.items() <= system.items()  # noqa: PTH110


def png(width: int, height: int, rows: int) -> bytes:
    """A PNG of so many pixels, grey, that is a thousandth of its size; with its first rows only."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes((width + 1) * rows), 1))


def test_images_are_limited_before_they_are_decoded(tmp_path: Path) -> None:
    (tmp_path / "huge.png").write_bytes(png(13_300, 13_300, 1))
    (tmp_path / "wide.png").write_bytes(png(2**31 - 1, 2**31 - 1, 0))
    Image.new("L", (7200, 7200)).save(tmp_path / "large.jpg")
    Image.new("L", (7200, 7200)).save(tmp_path / "progressive.jpg", progressive=True)
    (tmp_path / "cut.png").write_bytes(png(100, 100, 100)[:60])
    names = ["huge.png", "wide.png", "large.jpg", "progressive.jpg", "cut.png"]
    pictures = load_pictures(names, Source(tmp_path))
    assert [pictures[name].trouble for name in names] == [
        trouble.TOO_LARGE, trouble.TOO_LARGE, "", trouble.TOO_LARGE, trouble.NO_IMAGE,
    ]  # fmt: skip


def test_a_process_that_crashes_or_hangs_costs_one_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A decoder that is killed, as for its memory, is replaced for the next picture."""
    data = io.BytesIO()
    Image.new("RGB", (64, 64)).save(data, "PNG")
    for n in range(3):
        (tmp_path / f"{n}.png").write_bytes(data.getvalue())
    ask = load._Process.ask

    def ask_and_kill(process: load._Process, work: str, seconds: float, **request: object) -> None:
        if process.path == "1.png" and work == "decode":
            process.process.kill()
        ask(process, work, seconds, **request)  # type: ignore[arg-type]

    monkeypatch.setattr(load._Process, "ask", ask_and_kill)
    pictures = load_pictures([f"{n}.png" for n in range(3)], Source(tmp_path))
    assert [pictures[f"{n}.png"].trouble for n in range(3)] == ["", trouble.NO_IMAGE, ""]
