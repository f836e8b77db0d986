# SPDX-License-Identifier: Apache-2.0
"""dsgdb: asks a store of dynamic scene graphs who and what was where.

    db = dsgdb.open("store")              # folder, "unix:PATH" or "http://127.0.0.1:8080#token=..."
    m = db.map("office")
    m.where("carol", "+30s").position

Needs nothing but Python; numpy, pandas and networkx are used where they are asked for. See
docs/python.md of the project.
"""

from dsgdb.database import Database, open
from dsgdb.errors import (Aborted, AlreadyExists, Cancelled, DataLoss, DeadlineExceeded, Error,
                          FailedPrecondition, Internal, InvalidArgument, NotFound, OutOfRange,
                          PermissionDenied, ResourceExhausted, Unauthenticated, Unavailable,
                          Unimplemented)
from dsgdb.graphs import Change, Diff, Graph
from dsgdb.json_codec import FieldMask
from dsgdb.map import Map
from dsgdb.meshes import Mesh, MeshArrays
from dsgdb.rows import Rows
from dsgdb.times import TIME_MAX, TIME_MIN
from dsgdb.tracks import PoseChunk, Track, Tracks
from dsgdb.v1 import (VERSION, AttributeValue, Box, Capsule, Clock, Cuboid, Edge, GraphDelta, Node,
                      NodePattern, NodeView, Pose, PoseQuality, Quaternion, SemanticLabel, Sphere,
                      TimedPose, TriangleMesh, Vector3)
from dsgdb.writing import Session

__version__ = VERSION

__all__ = [
    "Aborted", "AlreadyExists", "AttributeValue", "Box", "Cancelled", "Capsule", "Change", "Clock",
    "Cuboid", "DataLoss", "Database", "DeadlineExceeded", "Diff", "Edge", "Error",
    "FailedPrecondition", "FieldMask", "Graph", "GraphDelta", "Internal", "InvalidArgument", "Map",
    "Mesh", "MeshArrays", "Node", "NodePattern", "NodeView", "NotFound", "OutOfRange",
    "PermissionDenied", "Pose", "PoseChunk", "PoseQuality", "Quaternion", "ResourceExhausted",
    "Rows", "SemanticLabel", "Session", "Sphere", "TIME_MAX", "TIME_MIN", "TimedPose", "Track",
    "Tracks", "TriangleMesh", "Unauthenticated", "Unavailable", "Unimplemented", "Vector3", "open",
]
