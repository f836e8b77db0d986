# SPDX-License-Identifier: Apache-2.0
"""World time: nanoseconds on a map's clock, and the forms in which Python says it."""

from __future__ import annotations

import datetime
import operator
import re
from typing import Any, Union

from dsgdb.errors import InvalidArgument
from dsgdb.v1 import Clock, MapSpec

# int: nanoseconds on the map's clock. str: "+30s" from the map's epoch, or RFC 3339. timedelta:
# from the map's epoch. datetime: with a time zone, on UNIX clocks.
Instant = Union[int, str, datetime.datetime, datetime.timedelta]
# int: nanoseconds. str: "500ms".
Duration = Union[int, str, datetime.timedelta]

# The open begin and the open end of an interval.
TIME_MIN = -2 ** 63
TIME_MAX = 2 ** 63 - 1
NS_PER_S = 1_000_000_000

_UNITS = {"": NS_PER_S, "ns": 1, "us": 10 ** 3, "ms": 10 ** 6, "s": NS_PER_S, "m": 60 * NS_PER_S,
          "min": 60 * NS_PER_S, "h": 3600 * NS_PER_S, "d": 86400 * NS_PER_S}
_NUMBER = re.compile(r"(\d+)(?:\.(\d*))?|\.(\d+)")
_DATE = re.compile(r"(\d{4}-\d\d-\d\d)[Tt](\d\d:\d\d:\d\d)(?:\.(\d+))?([Zz]|[+-]\d\d:\d\d)")
_UNIX_EPOCH = datetime.datetime(1970, 1, 1, tzinfo=datetime.timezone.utc)
_MICROSECOND = datetime.timedelta(microseconds=1)


def instant_ns(value: Instant, spec: MapSpec, what: str = "at") -> int:
    """Nanoseconds on the map's clock. `what` names the argument in errors.

    Raises InvalidArgument: for a datetime without a time zone, a date on a clock other than UNIX, a
    float, a number in a string that may mean seconds.
    """
    if value != value:
        raise _refused(value, what, "is no time")
    if isinstance(value, datetime.datetime):
        time_ns = _from_datetime(value, spec, what)
    elif isinstance(value, datetime.timedelta):
        time_ns = spec.epoch_ns + _timedelta_ns(value)
    elif isinstance(value, str):
        time_ns = _from_text(value, spec, what)
    else:
        time_ns = _whole(value, what, "\"+12.5s\", a timedelta or an aware datetime")
    if not TIME_MIN <= time_ns <= TIME_MAX:
        raise _refused(value, what, "does not fit 64 bits of nanoseconds")
    return time_ns


def duration_ns(value: Duration, what: str) -> int:
    """Nanoseconds, more than 0. Raises InvalidArgument."""
    if value != value:
        raise _refused(value, what, "is no duration")
    if isinstance(value, datetime.timedelta):
        length_ns = _timedelta_ns(value)
    elif isinstance(value, str):
        length_ns = _scaled(value, value, what, "\"0.5s\" or \"200ms\"")
    else:
        length_ns = _whole(value, what, "\"0.5s\" or a timedelta")
    if not 0 < length_ns <= TIME_MAX:
        raise _refused(value, what, "is not a positive duration; write \"0.5s\" or \"200ms\"")
    return length_ns


def _whole(value: Any, what: str, forms: str) -> int:
    try:
        if isinstance(value, bool):
            raise TypeError
        return int(operator.index(value))
    except TypeError:
        raise _refused(value, what, f"is neither an int of nanoseconds, nor {forms}") from None


def _timedelta_ns(value: datetime.timedelta) -> int:
    # Those of pandas, and differences of its timestamps, count nanoseconds besides.
    return value // _MICROSECOND * 1000 + int(getattr(value, "nanoseconds", 0))


def _from_datetime(value: datetime.datetime, spec: MapSpec, what: str) -> int:
    _check_dates(value, spec, what)
    if value.utcoffset() is None:
        raise _refused(value, what, "has no time zone; write "
                       "value.replace(tzinfo=datetime.timezone.utc), or the zone that it is of")
    return _timedelta_ns(value - _UNIX_EPOCH)


def _check_dates(value: Any, spec: MapSpec, what: str) -> None:
    if spec.clock == Clock.CLOCK_UNIX:
        return
    clock = ("TAI, some seconds ahead of UTC" if spec.clock == Clock.CLOCK_PTP_TAI
             else "that of its log, which has no dates")
    raise _refused(value, what, f"is a date, and the clock of map {spec.name} is {clock}; write "
                   "\"+12.5s\" or a timedelta, from the epoch of the map")


def _from_text(text: str, spec: MapSpec, what: str) -> int:
    forms = "\"+12.5s\" from the map's epoch, or RFC 3339 like \"2014-06-25T16:58:44.9Z\""
    date = _DATE.fullmatch(text)
    if date:
        _check_dates(text, spec, what)
        day, clock, fraction, zone = date.groups()
        zone = "+00:00" if zone in "Zz" else zone
        try:
            second = datetime.datetime.fromisoformat(f"{day}T{clock}{zone}")
        except ValueError as error:
            raise _refused(text, what, f"is no date ({error})") from None
        return _timedelta_ns(second - _UNIX_EPOCH) + int((fraction or "").ljust(9, "0")[:9])
    # "-30" may be meant as nanoseconds.
    if text[:1] == "+" or (text[:1] == "-" and not text[1:].isdigit()):
        offset = _scaled(text[1:], text, what, forms)
        return spec.epoch_ns + (offset if text[0] == "+" else -offset)
    if re.fullmatch(r"\d+ns", text):
        return int(text[:-2])
    raise _refused(text, what, f"is no time; write {forms}; an int is nanoseconds on the clock")


def _scaled(text: str, whole: str, what: str, forms: str) -> int:
    """"12.5s" in nanoseconds, exactly."""
    number = _NUMBER.match(text)
    unit = _UNITS.get(text[number.end():]) if number else None
    if number is None or unit is None:
        raise _refused(whole, what, f"is not understood; write {forms}")
    digits, decimals, only_decimals = number.groups()
    fraction = (decimals or only_decimals or "")[:15]
    scale: int = 10 ** len(fraction)
    return int(digits or 0) * unit + int(fraction or 0) * unit // scale


def _refused(value: Any, what: str, why: str) -> InvalidArgument:
    shown = value if isinstance(value, str) else repr(value)
    return InvalidArgument(f"{what} \"{shown}\" {why}", "FIELD_INVALID",
                           {"field": what, "value": str(value)})
