"""PNG with the standard library alone: sizes, and pictures of 8 or 16 bits without interlacing."""

import struct
import zlib

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}


def size(data):
    """(width, height) of a PNG; raises ValueError for anything else."""
    if data[:8] != SIGNATURE or data[12:16] != b"IHDR" or len(data) < 33:
        raise ValueError("no PNG")
    width, height = struct.unpack(">II", data[16:24])
    if width == 0 or height == 0:
        raise ValueError("a PNG without pixels")
    return width, height


def _chunks(data):
    at = 8
    while at + 12 <= len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        check = data[at + 8 + length : at + 12 + length]
        if len(body) != length or check != struct.pack(">I", zlib.crc32(kind + body)):
            raise ValueError("a damaged PNG")
        yield kind, body
        if kind == b"IEND":
            return
        at += 12 + length
    raise ValueError("a PNG that breaks off")


def _unfilter(kind, row, above, step):
    """Undoes one row's filter in place; `step`: bytes a pixel."""
    if kind == 1:
        for i in range(step, len(row)):
            row[i] = (row[i] + row[i - step]) & 255
    elif kind == 2:
        for i, up in enumerate(above):
            row[i] = (row[i] + up) & 255
    elif kind == 3:
        for i, up in enumerate(above):
            left = row[i - step] if i >= step else 0
            row[i] = (row[i] + (left + up) // 2) & 255
    elif kind == 4:
        for i, up in enumerate(above):
            left, corner = (row[i - step], above[i - step]) if i >= step else (0, 0)
            to_left, to_up = abs(up - corner), abs(left - corner)
            to_corner = abs(left + up - 2 * corner)
            best = left if to_left <= to_up and to_left <= to_corner else up
            row[i] = (row[i] + (best if min(to_left, to_up) <= to_corner else corner)) & 255
    elif kind != 0:
        raise ValueError("a damaged PNG")


def read(data, max_pixels=50_000_000):
    """(width, height, channels, rows): rows of bytes, channels interleaved; of 16 the upper."""
    width, height = size(data)
    if width * height > max_pixels:
        raise ValueError(f"a PNG of {width} x {height} px; at most {max_pixels} pixels")
    depth, color, _, _, interlaced = data[24:29]
    if depth not in (8, 16) or color not in _CHANNELS or interlaced:
        raise ValueError("a PNG with a palette, few bits or interlacing")
    channels = _CHANNELS[color]
    step = channels * depth // 8
    stride = 1 + width * step
    decoder = zlib.decompressobj()
    try:
        packed = b"".join(body for kind, body in _chunks(data) if kind == b"IDAT")
        raw = decoder.decompress(packed, stride * height)
    except zlib.error:
        raise ValueError("a damaged PNG") from None
    if len(raw) != stride * height:
        raise ValueError("a PNG that breaks off")
    rows, above = [], bytes(stride - 1)
    for y in range(height):
        row = bytearray(raw[y * stride + 1 : (y + 1) * stride])
        _unfilter(raw[y * stride], row, above, step)
        rows.append(row[:: depth // 8])
        above = row
    return width, height, channels, rows


def write(width, height, channels, rows):
    """A PNG of 8 bits from rows as read() gives them."""
    color = {count: kind for kind, count in _CHANNELS.items()}[channels]
    body = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 6)
    header = struct.pack(">IIBBBBB", width, height, 8, color, 0, 0, 0)
    data = SIGNATURE
    for kind, part in ((b"IHDR", header), (b"IDAT", body), (b"IEND", b"")):
        data += struct.pack(">I", len(part)) + kind + part
        data += struct.pack(">I", zlib.crc32(kind + part))
    return data


def rgb_rows(channels, rows):
    """Rows of any number of channels as rows of three; alpha is dropped."""
    result = []
    for row in rows:
        rgb = bytearray(len(row) // channels * 3)
        for c in range(3):
            rgb[c::3] = row[(c if channels >= 3 else 0) :: channels]
        result.append(rgb)
    return result
