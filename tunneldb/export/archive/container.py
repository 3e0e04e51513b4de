"""File of an archive: a ZIP (ZIP64) with Zstandard frames as members, and a manifest that describes each of them.

Nothing is unpacked to disk: members are asked for by the names that the database's own tables give them. The
manifest of a file is compared with its content, and no more is read than it announces.
"""

from __future__ import annotations

import hashlib
import json
import math
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from types import TracebackType
from typing import Any

import zstandard

from tunneldb.errors import InputError

FORMAT = 1
"""Version of the format; archives with another version are refused."""

MANIFEST = "manifest.json"
_MANIFEST_BYTES = 64 << 20
_RATIO = 1000  # rows are packed to a half or a tenth; what was nothing but repeats is no survey
_SLACK = 1 << 20
_LEVEL = 3
_CHUNK = 1 << 20


@dataclass(frozen=True)
class Member:
    """Manifest entry of a member: rows, unpacked bytes, their SHA-256, and names and types of the columns."""

    rows: int
    bytes: int
    sha256: str
    columns: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Manifest:
    """Manifest of the archive.

    Attributes
    ----------
    format : int
        Version of the format.
    tunneldb, schema : str
        Version of the program that wrote it, and revision of the schema that its rows are of.
    exported_at : str
        Time of the export, ISO 8601.
    survey, tunnel : str
        Their names.
    survey_id, tunnel_id : int
        Their numbers there, as in the rows.
    srid : int
        SRID of the tunnel.
    members : mapping
    """

    format: int
    tunneldb: str
    schema: str
    exported_at: str
    survey: str
    survey_id: int
    tunnel: str
    tunnel_id: int
    srid: int
    members: Mapping[str, Member]


class ArchiveWriter:
    """Writes an archive, member after member; the manifest comes last.

    Members have no time, since ZIP cannot state one of a clock that is set before 1980.
    """

    def __init__(self, path: Path) -> None:
        self._zip = zipfile.ZipFile(path, "w", zipfile.ZIP_STORED, allowZip64=True)
        self._members: dict[str, Member] = {}

    def __enter__(self) -> ArchiveWriter:
        """Return the writer."""
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        """Close the file."""
        self._zip.close()

    def add(self, name: str, columns: Iterable[tuple[str, str]], chunks: Iterable[bytes | bytearray | memoryview]) -> None:
        """Write a member; `counted` sets its number of rows."""
        digest, size = hashlib.sha256(), 0
        with self._zip.open(zipfile.ZipInfo(name), "w", force_zip64=True) as file:
            packer = zstandard.ZstdCompressor(level=_LEVEL, write_checksum=False).chunker(chunk_size=_CHUNK)
            for chunk in chunks:
                digest.update(chunk)
                size += len(chunk)
                for packed in packer.compress(chunk):
                    file.write(packed)
            for packed in packer.finish():  # type: ignore[no-untyped-call]
                file.write(packed)
        self._members[name] = Member(0, size, digest.hexdigest(), tuple(columns))

    def counted(self, name: str, rows: int) -> None:
        """Note how many rows a member has."""
        self._members[name] = replace(self._members[name], rows=rows)

    def finish(self, manifest: Manifest) -> None:
        """Write the manifest, with the entries of all members."""
        text = json.dumps({**asdict(manifest), "members": {k: asdict(m) for k, m in self._members.items()}}, indent=1)
        self._zip.writestr(zipfile.ZipInfo(MANIFEST), text, zipfile.ZIP_DEFLATED)


class ArchiveReader:
    """Reader of an archive; nothing in the archive is trusted.

    Raises
    ------
    InputError
        If the file is no archive, is incomplete, has another version of the format, or is inconsistent.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._zip = zipfile.ZipFile(path)
        except FileNotFoundError:
            raise InputError(f"{path}: there is no such file") from None
        except (zipfile.BadZipFile, zlib.error, OSError, ValueError, NotImplementedError) as error:
            raise InputError(f"{path} is no archive of a survey, or is cut off: {error}") from None
        try:
            self.manifest = self._manifest()
            self._require_members()
        except BaseException:
            self._zip.close()
            raise

    def __enter__(self) -> ArchiveReader:
        """Return the reader."""
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        """Close the file."""
        self._zip.close()

    def chunks(self, name: str) -> Iterator[bytes]:
        """Yield the unpacked bytes of a member, chunk by chunk.

        Raises
        ------
        InputError
            At the end, if they differ from the manifest; earlier, as soon as they are more.
        """
        member = self.manifest.members[name]
        digest, size = hashlib.sha256(), 0
        try:
            with (
                self._zip.open(name) as file,
                zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(file) as packed,
            ):
                while chunk := packed.read(_CHUNK):
                    size += len(chunk)
                    if size > member.bytes:
                        raise self.wrong(f"{name} is larger than its manifest entry")
                    digest.update(chunk)
                    yield chunk
        except (
            zstandard.ZstdError,
            zipfile.BadZipFile,
            zlib.error,
            EOFError,
            OSError,
            NotImplementedError,
            RuntimeError,
        ) as error:
            raise self.wrong(f"{name} cannot be read: {error}") from None
        if size != member.bytes or digest.hexdigest() != member.sha256:
            raise self.wrong(f"the checksum of {name} does not match the manifest")

    def wrong(self, what: str) -> InputError:
        """Return an error about the file."""
        return InputError(f"{self.path}: {what}; the file is damaged or was changed. Nothing was imported")

    def _manifest(self) -> Manifest:
        try:
            info = self._zip.getinfo(MANIFEST)
            if info.file_size > _MANIFEST_BYTES:
                raise ValueError("it is too large")
            with self._zip.open(info) as file:
                said = json.loads(file.read(_MANIFEST_BYTES))
            if said["format"] != FORMAT:
                raise InputError(
                    f"{self.path} has version {str(said['format'])[:20]} of the format, this tunneldb reads version {FORMAT}:"
                    " use the tunneldb that wrote it"
                )
            members = {str(name): _member(held) for name, held in said["members"].items()}
            manifest = Manifest(**{f.name: said[f.name] for f in fields(Manifest) if f.name != "members"}, members=members)
            _require_types(manifest)
        except KeyError as error:
            raise InputError(f"{self.path} is no archive of a survey: {error.args[0]} is missing") from None
        except (
            zipfile.BadZipFile,
            zlib.error,
            OSError,
            ValueError,
            TypeError,
            AttributeError,
            RecursionError,
            RuntimeError,
        ) as error:
            raise self.wrong(f"its manifest cannot be read: {error}") from None
        return manifest

    def _require_members(self) -> None:
        infos = self._zip.infolist()
        names = [info.filename for info in infos]
        if len(set(names)) != len(names):
            raise self.wrong("it has two members of one name")
        strange = sorted(set(names) ^ {*self.manifest.members, MANIFEST})
        if strange:
            raise self.wrong(f"{strange[0][:80]!r} is in the file or in its manifest, not in both")
        for info in infos:
            member = self.manifest.members.get(info.filename)
            if member is None:
                continue
            if info.compress_type != zipfile.ZIP_STORED or info.flag_bits & 1:
                raise self.wrong(f"{info.filename} is packed in another way")
            if member.bytes > _RATIO * info.file_size + _SLACK:
                raise self.wrong(f"{info.filename} is said to unpack to {member.bytes} bytes, which no rows do")


def _member(said: Any) -> Member:
    columns = tuple((str(name), str(kind)) for name, kind in said["columns"])
    member = Member(said["rows"], said["bytes"], said["sha256"], columns)
    if any(isinstance(n, bool) or not isinstance(n, int) or n < 0 for n in (member.rows, member.bytes)):
        raise ValueError("rows and bytes must be whole numbers")
    if not isinstance(member.sha256, str):
        raise TypeError("a checksum must be text")
    return member


def _require_types(manifest: Manifest) -> None:
    for name in ("tunneldb", "schema", "exported_at", "survey", "tunnel"):
        value = getattr(manifest, name)
        if not isinstance(value, str) or len(value) > 200 or "\0" in value:
            raise ValueError(f"{name} must be text")
    for name in ("survey_id", "tunnel_id", "srid"):
        value = getattr(manifest, name)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < math.ldexp(1, 31):
            raise ValueError(f"{name} must be a whole number")
