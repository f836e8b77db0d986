# SPDX-License-Identifier: Apache-2.0
"""Protobuf's wire format, for the messages with packed columns: their JSON would be text in base64.
Field numbers are those of proto/dsg/v1/scene.proto.
"""

from __future__ import annotations

import struct
from typing import Iterator, Union

Value = Union[int, memoryview]

_VARINT, _FIXED64, _LENGTH, _FIXED32 = 0, 1, 2, 5


def fields(message: memoryview) -> Iterator[tuple[int, Value]]:
    """The fields of a message in turn: numbers as int (fixed ones as their bits), texts, bytes and
    messages as parts of `message`. Raises ValueError for what is cut off or malformed.
    """
    at = 0
    while at < len(message):
        tag, at = _varint(message, at)
        kind = tag & 7
        if kind == _VARINT:
            value, at = _varint(message, at)
            yield tag >> 3, value
            continue
        if kind == _LENGTH:
            size, at = _varint(message, at)
        elif kind in (_FIXED64, _FIXED32):
            size = 8 if kind == _FIXED64 else 4
        else:
            raise ValueError(f"no wire type {kind}")
        if at + size > len(message):
            raise ValueError("a field is cut off")
        part = message[at:at + size]
        at += size
        yield tag >> 3, part if kind == _LENGTH else int.from_bytes(part, "little")


def signed(value: int) -> int:
    """A number of 64 bits as int64 has it."""
    return value - (1 << 64) if value >= 1 << 63 else value


def double(bits: int) -> float:
    """The float64 with these bits."""
    return float(struct.unpack("<d", bits.to_bytes(8, "little"))[0])


def number(field: int, value: int) -> bytes:
    """A field with a number, which is left out if it is 0."""
    return _encoded(field << 3) + _encoded(value) if value else b""


def present_number(field: int, value: int) -> bytes:
    """A field with a number, also if it is 0: of fields that may be unset."""
    return _encoded(field << 3) + _encoded(value)


def float64(field: int, value: float) -> bytes:
    """A field with a double."""
    return _encoded(field << 3 | _FIXED64) + struct.pack("<d", value)


def block(field: int, value: bytes) -> bytes:
    """A field with bytes or a message; an empty one is there too."""
    return _encoded(field << 3 | _LENGTH) + _encoded(len(value)) + value


def text(field: int, value: str) -> bytes:
    """A field with a text."""
    return block(field, value.encode())


def _varint(message: memoryview, at: int) -> tuple[int, int]:
    value = shift = 0
    while at < len(message) and shift < 70:
        byte = message[at]
        at += 1
        value |= (byte & 0x7f) << shift
        if byte < 0x80:
            return value & (1 << 64) - 1, at
        shift += 7
    raise ValueError("a number is cut off, or longer than ten bytes")


def _encoded(value: int) -> bytes:
    left = value & (1 << 64) - 1
    out = bytearray()
    while left >= 0x80:
        out.append(left & 0x7f | 0x80)
        left >>= 7
    out.append(left)
    return bytes(out)
