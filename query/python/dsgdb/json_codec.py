# SPDX-License-Identifier: Apache-2.0
"""Messages to and from protobuf JSON, by the annotations of their fields.

64-bit integers are strings in JSON, since they do not fit a double; bytes are base64; fields that
are not known here are skipped, so that a newer server can be asked.
"""

from __future__ import annotations

import base64
import binascii
import dataclasses
import enum
import functools
import operator
import sys
import typing
from typing import Any, Callable, Iterator, Mapping, TypeVar, Union

Message = TypeVar("Message")
Convert = Callable[[Any], Any]
_DOUBLE_INT_MAX = 2 ** 53


class ProtoEnum(str, enum.Enum):
    """Members are equal to their names: `quality == "INTERPOLATED"`. A value that is not known
    here reads as the first member, the unspecified one.
    """

    def __str__(self) -> str:
        return str(self.value)

    def __repr__(self) -> str:
        return f"{type(self).__name__}.{self.name}"

    def __format__(self, spec: str) -> str:
        return format(str(self.value), spec)


@dataclasses.dataclass(frozen=True)
class FieldMask:
    """Names of fields to write, with dots between levels: ("name", "object.size"); "*" = all."""

    paths: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True)
class _Field:
    """How one field is read and written."""

    name: str
    json_name: str
    default: Any
    is_optional: bool
    read: Convert
    write: Convert


def to_json(message: Any) -> dict[str, Any]:
    """Only the fields that are set. Raises TypeError, naming the field, for a value of a wrong
    type.
    """
    found: dict[str, Any] = {}
    for field in _fields(type(message)):
        value = getattr(message, field.name)
        if value is None and field.is_optional:
            continue
        try:
            if field.is_optional or value != field.default:
                found[field.json_name] = field.write(value)
        except _FieldError:
            raise
        except (TypeError, ValueError) as error:
            raise _FieldError(f"{type(message).__name__}.{field.json_name}: {error}") from None
    return found


def from_json(kind: type[Message], data: Mapping[str, Any]) -> Message:
    """Raises TypeError, ValueError or KeyError if `data` is no such message."""
    message = object.__new__(kind)
    values = message.__dict__
    for field in _fields(kind):
        value = data.get(field.json_name)
        if value is not None:
            values[field.name] = field.read(value)
        elif isinstance(field.default, dict):
            values[field.name] = {}
        else:
            values[field.name] = field.default
    return message


class _FieldError(TypeError):
    """Already names the field."""


_known: dict[Any, tuple[_Field, ...]] = {}


def _fields(kind: Any) -> tuple[_Field, ...]:
    """Of a message; made once."""
    found = _known.get(kind)
    if found is None:
        found = _known[kind] = tuple(_make_fields(kind))
    return found


def _make_fields(kind: Any) -> Iterator[_Field]:
    hints = typing.get_type_hints(kind, vars(sys.modules[kind.__module__]))
    for field in dataclasses.fields(kind):
        hint = hints[field.name]
        is_optional = typing.get_origin(hint) is Union
        read, write = _converters(typing.get_args(hint)[0] if is_optional else hint)
        default = (field.default if field.default_factory is dataclasses.MISSING
                   else field.default_factory())
        # Keywords of Python have an underscore behind them.
        yield _Field(field.name, field.name.rstrip("_"), default, is_optional, read, write)


def _converters(hint: Any) -> tuple[Convert, Convert]:
    """How a value of this type is read, and how it is written."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is tuple:
        read, write = _converters(arguments[0])
        return lambda v: tuple(map(read, v)), lambda v: [write(x) for x in _listed(v)]
    if origin is not None:
        read, write = _converters(arguments[1])
        return (lambda v: {k: read(x) for k, x in v.items()},
                lambda v: {_text(k): write(x) for k, x in v.items()})
    if hint is FieldMask:
        return _read_mask, _write_mask
    if issubclass(hint, ProtoEnum):
        return functools.partial(_read_enum, hint), functools.partial(_write_enum, hint)
    if dataclasses.is_dataclass(hint):
        return functools.partial(from_json, hint), functools.partial(_write_message, hint)
    return _SCALARS[hint]


def _listed(value: Any) -> Any:
    if isinstance(value, (str, bytes)):
        raise TypeError(f"{value!r} is no list")
    return value


def _whole(value: Any) -> Union[int, str]:
    if isinstance(value, bool):
        raise TypeError(f"{value!r} is no integer")
    number = operator.index(value)
    return number if abs(number) < _DOUBLE_INT_MAX else str(number)


def _number(value: Any) -> Union[float, str]:
    if isinstance(value, (bool, str)):
        raise TypeError(f"{value!r} is no number")
    number = float(value)
    if number - number == 0.0:
        return number
    # JSON has no such numbers; protobuf writes their names, and the server says what is wrong.
    return "NaN" if number != number else "Infinity" if number > 0 else "-Infinity"


def _flag(value: Any) -> bool:
    if value is not True and value is not False:
        raise TypeError(f"{value!r} is neither True nor False")
    return bool(value)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    value.encode()
    return value


def _bytes(value: Any) -> str:
    return binascii.b2a_base64(value, newline=False).decode()


def _read_enum(kind: type[ProtoEnum], value: Any) -> ProtoEnum:
    try:
        return kind(value)
    except ValueError:
        return kind(next(iter(kind)))


def _write_enum(kind: type[ProtoEnum], value: Any) -> str:
    if value in kind.__members__:
        return str(value)
    raise ValueError(f"{value!r} is none of {', '.join(kind.__members__)}")


def _write_message(kind: Any, value: Any) -> dict[str, Any]:
    if not isinstance(value, kind):
        raise TypeError(f"{value!r} is no {kind.__name__}")
    return to_json(value)


def _read_mask(value: str) -> FieldMask:
    paths = value.split(",") if value else []
    return FieldMask(tuple("".join("_" + c.lower() if c.isupper() else c for c in path)
                           for path in paths))


def _write_mask(mask: FieldMask) -> str:
    """In JSON the words of a path are joined by capitals, which map_T_node has already."""
    for path in mask.paths:
        if path != path.lower():
            raise ValueError(f"the path {path!r} cannot be said in JSON; name another field, or "
                             "replace the whole with \"*\"")
    words = [path.split("_") for path in mask.paths]
    return ",".join(first + "".join(w.capitalize() for w in rest) for first, *rest in words)


_SCALARS: dict[Any, tuple[Convert, Convert]] = {
    int: (int, _whole), float: (float, _number), bool: (bool, _flag), str: (str, _text),
    bytes: (base64.b64decode, _bytes)}
