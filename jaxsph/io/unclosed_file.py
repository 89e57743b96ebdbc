"""Opening HDF5 files that are not closed: their writer was killed, or still writes.

Such a file has a mark in its superblock (HDF5 file format, version 3.0, II.A), where its length is
out of date. HDF5 opens it only for a reader that waits, for minutes on end, for a writer to mend
what looks damaged. Mark and length are put right in the bytes handed to HDF5 here; the file stays
as it is.
"""

from __future__ import annotations

import io
import struct
from pathlib import Path

import h5py

_SUPERBLOCK_SIZE = 48  # of version 3 with addresses of 8 bytes: 44 and their checksum
_WORD = 0xFFFFFFFF
_VERSION, _MARK, _LENGTH = 8, 11, 28  # offsets in the superblock


def open_to_read(path: Path) -> h5py.File:
    """The file, open to read whether closed or not.

    Raises:
        OSError: if it is not whole.
    """
    with open(path, "rb") as file:
        head = bytearray(file.read(_SUPERBLOCK_SIZE))
    if len(head) < _SUPERBLOCK_SIZE or head[_VERSION] != 3 or not head[_MARK]:
        return h5py.File(path, "r", locking="best-effort")
    head[_MARK] = 0
    head[_LENGTH : _LENGTH + 8] = struct.pack("<Q", path.stat().st_size)
    head[-4:] = struct.pack("<I", lookup3(bytes(head[:-4])))
    return h5py.File(_Patched(path, bytes(head)), "r")


class _Patched(io.RawIOBase):
    """A file with other first bytes."""

    def __init__(self, path: Path, head: bytes):
        self._file, self._head = open(path, "rb"), head  # noqa: SIM115 (closed by `close`)

    def seek(self, offset, whence=io.SEEK_SET):
        return self._file.seek(offset, whence)

    def tell(self):
        return self._file.tell()

    def readinto(self, buffer):
        start = self._file.tell()
        read = self._file.readinto(buffer)
        if read < len(buffer):
            raise OSError("the file ends before its data")
        head = self._head[start : start + read]
        buffer[: len(head)] = head
        return read

    def close(self):
        self._file.close()
        super().close()


def lookup3(data: bytes) -> int:
    """HDF5's checksum of metadata, the hash of that name by Bob Jenkins (2006)."""
    a = b = c = (0xDEADBEEF + len(data)) & _WORD
    while len(data) > 12:
        a, b, c = _add((a, b, c), data[:12])
        for bits in (4, 6, 8, 16, 19, 4):
            a = (a - c & _WORD) ^ _rotated(c, bits)
            c = c + b & _WORD
            a, b, c = b, c, a
        data = data[12:]
    a, b, c = _add((a, b, c), data)
    for bits in (14, 11, 25, 16, 4, 14, 24):
        c = (c ^ b) - _rotated(b, bits) & _WORD
        a, b, c = b, c, a
    return b


def _add(sums: tuple[int, int, int], data: bytes) -> tuple[int, ...]:
    words = struct.unpack("<3I", data.ljust(12, b"\0"))
    return tuple(x + y & _WORD for x, y in zip(sums, words, strict=True))


def _rotated(x: int, bits: int) -> int:
    return (x << bits | x >> (32 - bits)) & _WORD
