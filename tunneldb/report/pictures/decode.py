"""Small versions of images. The size that decoding needs is known from the header, and limited before it."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO

from PIL import Image, ImageOps

from tunneldb.report.pictures.trouble import NO_IMAGE, TOO_LARGE, PictureError

PHOTO = 480
"""Maximum width and height of a photo, pixels: 6 cm on paper at 200 dpi."""

LOGO = 640
"""Maximum width and height of a logo, pixels."""

MAX_PIXELS = 50_000_000
"""Maximum pixels that are decoded: 200 MB. A JPEG is decoded at an eighth of its width, unless it is progressive."""

_FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP", "GIF")  # none that runs another program, as PostScript


def shrink_photo(file: BinaryIO) -> tuple[bytes, str]:
    """Return a small JPEG of a photo, rotated as the camera states, and its media type.

    Raises
    ------
    PictureError
        If it is not an image, or too large.
    """
    with opened(file, PHOTO) as image:
        upright = ImageOps.exif_transpose(image).convert("RGBA")
        upright.thumbnail((PHOTO, PHOTO))
        paper = Image.new("RGB", upright.size, "white")
        paper.paste(upright, mask=upright.getchannel("A"))
        out = io.BytesIO()
        paper.save(out, "JPEG", quality=80, optimize=True)
    return out.getvalue(), "image/jpeg"


def shrink_logo(file: BinaryIO) -> tuple[bytes, str]:
    """Return a small PNG of a logo, with its transparency, and its media type.

    Raises
    ------
    PictureError
        If it is not an image, or too large.
    """
    with opened(file, LOGO) as image:
        small = image.convert("RGBA")
        small.thumbnail((LOGO, LOGO))
        out = io.BytesIO()
        small.save(out, "PNG", optimize=True)
    return out.getvalue(), "image/png"


@contextmanager
def opened(file: BinaryIO, size: int) -> Iterator[Image.Image]:
    """Open an image of at most MAX_PIXELS, reduced to twice a size.

    Raises
    ------
    PictureError
        If it is not an image, or too large.
    """
    Image.MAX_IMAGE_PIXELS = None  # the limit here also knows at which size a JPEG is decoded
    try:
        with Image.open(file, formats=_FORMATS) as image:
            whole = image.width * image.height
            image.draft("RGB", (2 * size, 2 * size))
            decoded = whole if image.info.get("progressive") else image.width * image.height
            if decoded > MAX_PIXELS:
                raise PictureError(TOO_LARGE)
            image.thumbnail((2 * size, 2 * size))
            yield image
    except PictureError:
        raise
    except MemoryError as error:
        raise PictureError(TOO_LARGE) from error
    except Exception as error:  # decoders raise much that is no OSError; whatever it is, the report is written
        raise PictureError(NO_IMAGE) from error
