"""Photos as cameras write them, for uploads."""

from __future__ import annotations

import io
import struct
import zlib

from PIL import Image

RED, BLUE = (200, 30, 30), (30, 30, 200)
TAKEN = "2026:11:01 10:11:12"
SERIAL = "SERIAL-4711"


def photo(kind: str = "JPEG", size: tuple[int, int] = (400, 300), *, turned: bool = False, seed: int = 0) -> bytes:
    """Return a picture whose left half is red and whose right half is blue, with place, time and serial number.

    Parameters
    ----------
    kind : str
        Format of Pillow.
    size : tuple of int
        Width and height, pixels.
    turned : bool
        True for a camera that was held upright: a viewer turns the picture clockwise.
    seed : int
        Grey value of a corner, by which photos differ.
    """
    image = Image.new("RGB", size, BLUE)
    image.paste(RED, (0, 0, size[0] // 2, size[1]))
    image.paste((seed, seed, seed), (0, 0, 40, 40))
    exif = Image.Exif()
    exif[0x10F] = "Maker of phones"
    exif[0x112] = 6 if turned else 1
    exif.get_ifd(0x8769).update({0x9003: TAKEN, 0xA431: SERIAL})
    exif.get_ifd(0x8825).update({1: "N", 2: (46.0, 3.0, 2.5), 3: "E", 4: (14.0, 30.0, 1.5)})
    out = io.BytesIO()
    xmp = f"<x:xmpmeta><exif:GPSLatitude>46,3</exif:GPSLatitude>{SERIAL}</x:xmpmeta>".encode()
    image.save(out, kind, exif=exif, quality=95, xmp=xmp, comment=SERIAL.encode(), dpi=(300, 300))
    return out.getvalue()


def bomb(width: int, height: int, text: int = 0) -> bytes:
    """Return a small PNG file of many white pixels, with a text of so many bytes."""
    rows = (
        zlib.compress(bytes(1), 9) if width * height > 1_000_000_000 else zlib.compress((b"\0" + b"\xff" * width) * height, 9)
    )
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    words = [(b"zTXt", b"a\0\0" + zlib.compress(bytes(text), 9))] if text else []
    chunks = [(b"IHDR", head), *words, (b"IDAT", rows), (b"IEND", b"")]
    parts = [struct.pack(">I", len(d)) + n + d + struct.pack(">I", zlib.crc32(n + d)) for n, d in chunks]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def opened(content: bytes) -> Image.Image:
    """Return the picture of a file, which is whole."""
    image = Image.open(io.BytesIO(content))
    image.load()
    return image


def near(pixel: object, colour: tuple[int, int, int]) -> bool:
    """Return True if a pixel has a colour, but for the losses of JPEG."""
    return all(abs(a - b) < 12 for a, b in zip(pixel, colour, strict=True))  # type: ignore[call-overload]
