# SPDX-License-Identifier: Apache-2.0
"""What goes wrong, as exceptions: one class for each status of a call."""

from __future__ import annotations

import re
from typing import Any, Mapping, Optional

# What a terminal obeys instead of showing it, and marks that turn the direction of writing.
_UNSEEN = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")


class Error(Exception):
    """A call failed. The text says what failed, with which value, and what to do.

    code: the status in the words of the Connect protocol, such as "not_found".
    reason: why, from proto/dsg/v1/errors.proto, such as "AGENT_UNKNOWN"; "" where the server gives
        none. New reasons may come: treat one that you do not know like "".
    metadata: the values that the reason is about, as text.
    """

    code = "unknown"

    def __init__(self, message: str, reason: str = "",
                 metadata: Optional[Mapping[str, str]] = None) -> None:
        super().__init__(message)
        self.message = message
        self.reason = reason
        self.metadata = dict(metadata or {})

    def __str__(self) -> str:
        text = f"{self.message} [{self.reason}]" if self.reason else self.message
        return _UNSEEN.sub(lambda mark: f"\\u{ord(mark.group()):04x}", text)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.message, self.reason, self.metadata)


class InvalidArgument(Error, ValueError):
    """The question is wrong in itself; ask another one."""

    code = "invalid_argument"


class NotFound(Error, LookupError):
    """No such map, node, agent, class, relation, tag or path."""

    code = "not_found"


class OutOfRange(Error, LookupError):
    """A time outside of a track, or a revision that is not readable."""

    code = "out_of_range"


class AlreadyExists(Error):
    """What is to be written is there already, with other content."""

    code = "already_exists"


class FailedPrecondition(Error):
    """The store or the map is not in a state that allows this."""

    code = "failed_precondition"


class Aborted(Error):
    """Somebody else wrote meanwhile; read again, then try again."""

    code = "aborted"


class Unavailable(Error):
    """No server answers, or it cannot answer now; try again later."""

    code = "unavailable"


class DeadlineExceeded(Error, TimeoutError):
    """The answer did not come in time; ask for less, or give a longer timeout."""

    code = "deadline_exceeded"


class ResourceExhausted(Error):
    """A limit of the server: too many calls, too large a request, a full disk."""

    code = "resource_exhausted"


class PermissionDenied(Error):
    """The server does not let this caller do this; writing needs `dsg-server --http-write`."""

    code = "permission_denied"


class Unauthenticated(Error):
    """The token is missing or wrong; it is what dsg-server prints behind `#token=`."""

    code = "unauthenticated"


class Unimplemented(Error):
    """The server does not know this call; it may be of another version."""

    code = "unimplemented"


class DataLoss(Error):
    """Stored bytes are not what was written; `dsg verify` says which."""

    code = "data_loss"


class Cancelled(Error):
    """The call was given up."""

    code = "canceled"


class Internal(Error):
    """A fault of the server or of this package."""

    code = "internal"


# By the code of the Connect protocol; the class `Error` itself is "unknown".
BY_CODE: Mapping[str, type[Error]] = {
    kind.code: kind for kind in (
        InvalidArgument, NotFound, OutOfRange, AlreadyExists, FailedPrecondition, Aborted,
        Unavailable, DeadlineExceeded, ResourceExhausted, PermissionDenied, Unauthenticated,
        Unimplemented, DataLoss, Cancelled, Internal)}
