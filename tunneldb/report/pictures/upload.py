"""Photos that people upload: decoded, and written anew without what the camera or another program put into the file."""

from __future__ import annotations

import io
import re
from typing import BinaryIO

from PIL import Image, ImageCms, ImageOps

from tunneldb.report.pictures.decode import opened
from tunneldb.report.pictures.trouble import PictureError

STORED = 4000
"""Maximum width and height of a stored photo, pixels."""

QUALITY = 90
"""Quality of the JPEG."""

NOT_A_PHOTO = "not a JPEG, PNG or WebP picture"
HEIC = "HEIC and AVIF are not supported: set the camera to JPEG (iPhone: Formats, Most Compatible)"
SIXTEEN_BIT = "a grey picture with more than 8 bits is not supported: save it as JPEG"

_HEIC_BRANDS = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"mif1", b"msf1", b"avif", b"avis")
_EXIF, _TAKEN = 0x8769, 0x9003  # tags: EXIF directory, DateTimeOriginal
_TIME = re.compile(r"\d{4}:\d\d:\d\d \d\d:\d\d:\d\d")


def clean_photo(file: BinaryIO) -> tuple[bytes, str]:
    """Return a photo as an upright JPEG in sRGB of at most STORED pixels, and its media type.

    Of the metadata only the time at which it was taken is kept: no place, no serial number.

    Raises
    ------
    PictureError
        If it is not a JPEG, PNG or WebP picture, damaged, or too large.
    """
    _require_photo(file)
    with opened(file, STORED // 2) as image:
        if image.mode.startswith(("I", "F")):
            raise PictureError(SIXTEEN_BIT)
        taken = _time(image)
        photo = _opaque(_srgb(ImageOps.exif_transpose(image)))
        photo.info = {}  # Pillow would write comments, XMP and resolution again
        out = io.BytesIO()
        photo.save(out, "JPEG", quality=QUALITY, exif=_exif(taken))
    return out.getvalue(), "image/jpeg"


def _require_photo(file: BinaryIO) -> None:
    """Raise PictureError if the first bytes are not those of a JPEG, PNG or WebP picture."""
    head = file.read(16)
    file.seek(0)
    if head[4:8] == b"ftyp" and head[8:12] in _HEIC_BRANDS:
        raise PictureError(HEIC)
    webp = head[:4] == b"RIFF" and head[8:12] == b"WEBP"
    if not head.startswith((b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n")) and not webp:
        raise PictureError(NOT_A_PHOTO)


def _time(image: Image.Image) -> str | None:
    """Return the time at which a photo was taken, as EXIF writes it; None if it is not stated."""
    taken = image.getexif().get_ifd(_EXIF).get(_TAKEN)
    return taken if isinstance(taken, str) and _TIME.fullmatch(taken) else None


def _exif(taken: str | None) -> Image.Exif:
    exif = Image.Exif()
    if taken is not None:
        exif.get_ifd(_EXIF)[_TAKEN] = taken
    return exif


def _srgb(image: Image.Image) -> Image.Image:
    """Return an image with its colours in sRGB; phones often use a wider space. A damaged profile is ignored."""
    profile = image.info.get("icc_profile")
    if image.mode != "RGB" or not profile:
        return image
    try:
        own = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        return ImageCms.profileToProfile(image, own, ImageCms.createProfile("sRGB")) or image
    except (ImageCms.PyCMSError, OSError):
        return image


def _opaque(image: Image.Image) -> Image.Image:
    """Return an image on white paper."""
    if not image.has_transparency_data:
        return image.convert("RGB")
    colours = image.convert("RGBA")
    paper = Image.new("RGB", colours.size, "white")
    paper.paste(colours, mask=colours.getchannel("A"))
    return paper
