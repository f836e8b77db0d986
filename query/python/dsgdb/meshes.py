# SPDX-License-Identifier: Apache-2.0
"""The triangles of a map, read as packed columns."""

from __future__ import annotations

import functools
from array import array
from typing import TYPE_CHECKING, Any, Iterable, NamedTuple, Optional

from dsgdb import wire
from dsgdb.packed import Fields
from dsgdb.v1 import Box, Vector3

if TYPE_CHECKING:
    import numpy

# MeshEncoding.COLUMNS.
_ENCODING = 2
# Optional columns of a vertex: field of MeshColumns, type in `array`, numbers a vertex.
_COLUMNS = {"normals": (7, "f", 3), "colors": (8, "B", 3), "labels": (9, "I", 1),
            "instance_ids": (10, "I", 1)}


class MeshArrays(NamedTuple):
    """One mesh in numpy; None where no block of the map has such values, 0 where one lacks them."""

    # (n, 3) float32, map frame, metres.
    vertices: numpy.ndarray[Any, Any]
    # (m, 3) uint32, rows of `vertices`.
    faces: numpy.ndarray[Any, Any]
    # (n, 3) uint8: red, green, blue.
    colors: Optional[numpy.ndarray[Any, Any]]
    # (n, 3) float32.
    normals: Optional[numpy.ndarray[Any, Any]]
    # (n,) uint32: semantic class; the object that the vertex belongs to.
    labels: Optional[numpy.ndarray[Any, Any]]
    instance_ids: Optional[numpy.ndarray[Any, Any]]


class Mesh:
    """The triangles of a map, or of one node, as flat arrays of the standard library.

    vertices (x y z, map frame, metres), normals (x y z), colors (red green blue, 0 to 255), labels
    and instance_ids: empty where no block of the map has such values, 0 where one lacks them.
    faces: three rows of `vertices` each.
    """

    def __init__(self, messages: Iterable[memoryview] = ()) -> None:
        """From GetMeshResponse messages with columns. Raises IndexError, TypeError and ValueError
        for what is none.
        """
        self.revision = 0
        self.vertices = array("f")
        self.normals = array("f")
        self.colors = array("B")
        self.labels = array("I")
        self.instance_ids = array("I")
        # Row of the first vertex, and the faces, of each piece.
        self._faces: list[tuple[int, array[int]]] = []
        for message in messages:
            for field, value in wire.fields(message):
                if field == 1:
                    self.revision = Fields(value).number(1)
                elif field == 3:
                    self._add(Fields(value))

    def _add(self, piece: Fields) -> None:
        first = len(self.vertices) // 3
        count = piece.number(2)
        faces = array("H")
        faces.frombytes(piece.column(13, 6, piece.number(3)))
        if faces and max(faces) >= count:
            raise IndexError(f"a face names vertex {max(faces)} of {count}")
        self._faces.append((first, faces))
        self.vertices.frombytes(piece.column(6, 12, count))
        for name, (field, _, size) in _COLUMNS.items():
            column: array[Any] = getattr(self, name)
            row_bytes = column.itemsize * size
            values = piece.column(field, row_bytes, count, is_optional=True)
            if values and not column:
                column.frombytes(bytes(first * row_bytes))
            if values or column:
                column.frombytes(values or bytes(count * row_bytes))

    @functools.cached_property
    def faces(self) -> array[int]:
        faces = array("I")
        for first, piece in self._faces:
            faces.extend([first + corner for corner in piece])
        return faces

    def to_numpy(self) -> MeshArrays:
        """Arrays in the shapes that mesh libraries take; `MeshArrays` says which. They share the
        memory of this mesh, but for the faces.
        """
        import numpy
        found: dict[str, Any] = {}
        for name, (_, kind, size) in _COLUMNS.items():
            column = getattr(self, name)
            values = numpy.frombuffer(column, kind) if column else None
            found[name] = values.reshape(-1, 3) if values is not None and size == 3 else values
        pieces = [numpy.frombuffer(piece, "u2").astype("u4") + numpy.uint32(first)
                  for first, piece in self._faces if piece]
        faces = numpy.concatenate(pieces) if pieces else numpy.empty(0, "u4")
        return MeshArrays(numpy.frombuffer(self.vertices, "f").reshape(-1, 3),
                          faces.reshape(-1, 3), **found)

    def __repr__(self) -> str:
        return (f"<Mesh: {len(self.vertices) // 3} vertices, "
                f"{sum(len(piece) for _, piece in self._faces) // 3} faces, "
                f"revision {self.revision}>")


def encode_request(map_name: str, revision_at: bytes, node: str, box: Optional[Box]) -> bytes:
    """The message GetMeshRequest; revision_at: an encoded ReadAt."""
    out = wire.text(1, map_name) + wire.block(2, revision_at)
    if box is not None:
        out += wire.block(3, wire.block(1, _vector(box.min)) + wire.block(2, _vector(box.max)))
    return out + (wire.text(4, node) if node else b"") + wire.number(8, _ENCODING)


def _vector(point: Optional[Vector3]) -> bytes:
    axes = (point.x, point.y, point.z) if point is not None else ()
    return b"".join(wire.float64(field, value) for field, value in enumerate(axes, 1))
