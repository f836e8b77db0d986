# SPDX-License-Identifier: Apache-2.0
"""What some generated messages can do besides holding their fields."""

from __future__ import annotations

from typing import TYPE_CHECKING, Iterator, Optional

if TYPE_CHECKING:
    from dsgdb.v1 import Pose, Quaternion, Vector3


class Triple:
    """Three coordinates in order: `x, y, z = vector`, `numpy.array(list(vector))`."""

    x: float
    y: float
    z: float

    def __iter__(self) -> Iterator[float]:
        return iter((self.x, self.y, self.z))


class Located:
    """Where an agent was."""

    pose: Optional[Pose]
    orientation_unknown: bool

    @property
    def position(self) -> Optional[Vector3]:
        """In the map frame, metres; None in a gap of the track."""
        return self.pose.position if self.pose else None

    @property
    def orientation(self) -> Optional[Quaternion]:
        """Takes a point from the agent's frame into the map frame; None in a gap of the track, and
        where the source gave positions only.
        """
        return self.pose.orientation if self.pose and not self.orientation_unknown else None
