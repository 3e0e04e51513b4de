"""Reasons why a picture is not available. The report translates them, so each is a fixed text without words of a server."""

from __future__ import annotations


class PictureError(Exception):
    """Picture that is not available; the message is the reason."""


NO_FILE = "no such file"
NOT_REGULAR = "not a regular file"
OUTSIDE = "outside the folder of photos (--photos)"
UNREADABLE = "cannot be read"
NO_IMAGE = "not a readable image"
TOO_LARGE = "too large an image"
TOO_MANY = "not shown: the report shows at most 2000 photos"
UNKNOWN_SCHEME = "neither a file nor https://"
NOT_ENCRYPTED = "http:// is refused: use https:// or --photo-server"
NOT_PUBLIC = "address of an internal network: refused without --photo-server"
BAD_ADDRESS = "not a valid web address"
NO_SERVER = "could not be fetched: no such server"
NO_CONNECTION = "could not be fetched: no connection"
NOT_TRUSTED = "could not be fetched: no trusted TLS connection"
NOT_FOUND = "could not be fetched: the server does not have it"
DENIED = "could not be fetched: the server denies access"
FAILED = "could not be fetched: the server does not answer as expected"
REDIRECTED = "could not be fetched: too many redirects"
TOO_SLOW = "could not be fetched: out of time"
OUT_OF_TIME = "could not be read in time"
