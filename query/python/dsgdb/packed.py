# SPDX-License-Identifier: Apache-2.0
"""What the calls with packed columns have in common (proto/dsg/v1/scene.proto): their requests as
bytes, and the fields of their replies.
"""

from __future__ import annotations

from typing import Mapping, Optional

from dsgdb import wire
from dsgdb.v1 import ReadAt

_NOTHING = memoryview(b"")


class Fields:
    """The fields of one message, of which none is repeated. Raises TypeError and ValueError for
    what is not as asked for.
    """

    def __init__(self, message: wire.Value) -> None:
        self._fields: Mapping[int, wire.Value] = dict(wire.fields(_part(message)))

    def number(self, field: int) -> int:
        """0 if it is left out."""
        value = self._fields.get(field, 0)
        if not isinstance(value, int):
            raise TypeError(f"field {field} is no number")
        return value

    def double(self, field: int) -> float:
        """0 if it is left out."""
        return wire.double(self.number(field))

    def text(self, field: int) -> str:
        """Empty if it is left out."""
        return bytes(_part(self._fields.get(field, _NOTHING))).decode()

    def vector(self, field: int) -> tuple[float, float, float]:
        """A Vector3; zeros if it is left out."""
        axes = Fields(self._fields.get(field, _NOTHING))
        return axes.double(1), axes.double(2), axes.double(3)

    def column(self, field: int, row_bytes: int, row_count: int,
               is_optional: bool = False) -> memoryview:
        """The bytes of a column; may be empty if it is optional."""
        value = _part(self._fields.get(field, _NOTHING))
        if len(value) != row_bytes * row_count and not (is_optional and not value):
            raise ValueError(f"column {field} of {row_count} rows has {len(value)} bytes")
        return value


def encode_read_at(read_at: Optional[ReadAt]) -> bytes:
    """The message ReadAt; empty = the newest revision."""
    if read_at is None:
        return b""
    out = b""
    for field, value in ((2, read_at.at_least_revision), (3, read_at.exact_revision),
                         (5, read_at.committed_at_ns)):
        if value is not None:
            out += wire.present_number(field, value)
    return out + (wire.text(4, read_at.tag) if read_at.tag else b"")


def _part(value: wire.Value) -> memoryview:
    if not isinstance(value, memoryview):
        raise TypeError("a number stands where bytes or a message should")
    return value
