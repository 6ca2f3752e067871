"""Look at PNG pictures before MuJoCo unpacks them: a few bytes may say that they are gigabytes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import Final

from clench.core.files.file_limits import PICTURE_PIXELS

#: The bytes that every PNG file begins with.
PNG: Final = b"\x89PNG\r\n\x1a\n"
#: Chunks that a picture needs; others (text, colour profiles) may be packed as well.
_NEEDED: Final = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")
_CHANNELS: Final = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
#: Interlaced pictures begin each line of seven smaller ones with a byte.
_LINES: Final = 8
_AT_ONCE: Final = 1 << 20


def checked_png(data: bytes) -> bytes:
    """Return a PNG file with only the parts that are needed to show it.

    Raises:
        ValueError: no PNG, too many pixels, or packed data that are more than its pixels.
    """
    chunks = list(_chunks(data))
    if not chunks or chunks[0][0] != b"IHDR" or len(chunks[0][1]) != 13:
        raise ValueError("not a PNG file")
    width, height, depth, colour = struct.unpack(">IIBB", chunks[0][1][:10])
    if not 0 < width * height <= PICTURE_PIXELS:
        raise ValueError(f"it says that it has {width} x {height} pixels; expected up to {PICTURE_PIXELS} of them")
    most = height * _LINES + height * (width + _LINES) * _CHANNELS.get(colour, 4) * max(depth, 8) // 8
    unpacker, size = zlib.decompressobj(), 0
    try:
        for kind, content in chunks:
            while kind == b"IDAT" and content:
                size += len(unpacker.decompress(content, _AT_ONCE))
                content = unpacker.unconsumed_tail
                if size > most:
                    raise ValueError(f"it unpacks to more than its {width} x {height} pixels")
    except zlib.error as error:
        raise ValueError(f"a damaged PNG file ({error})") from None
    packed = (struct.pack(">I", len(c)) + k + c + struct.pack(">I", zlib.crc32(k + c)) for k, c in chunks)
    return PNG + b"".join(packed)


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the kind and content of the chunks that are needed."""
    place = len(PNG)
    while place + 8 <= len(data):
        (length,), kind = struct.unpack(">I", data[place : place + 4]), data[place + 4 : place + 8]
        if length > len(data) - place - 8:
            raise ValueError("a damaged PNG file (a part of it is missing)")
        if kind in _NEEDED:
            yield kind, data[place + 8 : place + 8 + length]
        if kind == b"IEND":
            return
        place += 12 + length
