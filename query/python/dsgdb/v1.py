# SPDX-License-Identifier: Apache-2.0
# Written by generate_api.py from proto/dsg/v1; do not edit.
"""The messages of dsg.v1 as frozen dataclasses, and `Api`, one method for each RPC.

Frames are right-handed with z up; units are metres, radians, and nanoseconds on the map's clock;
quaternions are Hamilton, x y z w. Intervals are half-open, [from_ns, to_ns). A field that is None
is unset; `from` is written `from_`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Iterator, Mapping, Optional

from dsgdb.connect import Caller
from dsgdb.json_codec import FieldMask, ProtoEnum
from dsgdb.mixins import Located, Triple

# The version of the project that this file was written for.
VERSION = "0.1.0"


class Reason(ProtoEnum):
    """A reason exists only where a caller can act on it. The list grows: clients treat an unknown
    reason as REASON_UNSPECIFIED and use the status code. A comment names the metadata that callers
    can rely on; there may be more.
    """

    REASON_UNSPECIFIED = "REASON_UNSPECIFIED"
    # A field of the request has a value that it cannot have. metadata: field, value.
    FIELD_INVALID = "FIELD_INVALID"
    # The name of a map has characters that docs/conventions.md does not allow. metadata: value.
    MAP_NAME_INVALID = "MAP_NAME_INVALID"
    # What should be a node id is not a letter and a number. metadata: value.
    NODE_ID_INVALID = "NODE_ID_INVALID"
    # An interval ends where it begins, or before. metadata: from_ns, to_ns.
    TIME_RANGE_INVERTED = "TIME_RANGE_INVERTED"
    # A box has its min above its max on some axis. metadata: field.
    BOX_INVERTED = "BOX_INVERTED"
    # A number is NaN, infinite or larger than any map.
    NUMBER_NOT_FINITE = "NUMBER_NOT_FINITE"
    # A page token belongs to another question, or was changed: begin without one. metadata: field.
    PAGE_TOKEN_MISMATCH = "PAGE_TOKEN_MISMATCH"
    # A delta contradicts itself or the map. metadata: missing_nodes, if it refers to nodes that do
    # not exist.
    DELTA_INVALID = "DELTA_INVALID"
    # A file does not have the content that its format asks for. metadata: file.
    FILE_MALFORMED = "FILE_MALFORMED"
    # A query does not follow docs/search.md. metadata: position (bytes from 0), expected.
    QUERY_MALFORMED = "QUERY_MALFORMED"
    # A time is implausibly far from all others of the map. metadata: map, what, time_ns, first_ns,
    # last_ns.
    TIME_IMPLAUSIBLE = "TIME_IMPLAUSIBLE"
    # The store has no such map. metadata: map.
    MAP_UNKNOWN = "MAP_UNKNOWN"
    # The map has no such node at the revision. metadata: map, node.
    NODE_UNKNOWN = "NODE_UNKNOWN"
    # The map has no such agent at the revision. metadata: map, agent.
    AGENT_UNKNOWN = "AGENT_UNKNOWN"
    # The map has no such layer. metadata: layer.
    LAYER_UNKNOWN = "LAYER_UNKNOWN"
    # The map has no asset with this hash at the revision. metadata: map, asset.
    ASSET_UNKNOWN = "ASSET_UNKNOWN"
    # No node of the map has this class, kind or name. metadata: class.
    CLASS_UNKNOWN = "CLASS_UNKNOWN"
    # No edge of the map has this relation. metadata: relation.
    RELATION_UNKNOWN = "RELATION_UNKNOWN"
    # The places do not lead from the start to the goal. metadata: from, to, why.
    NO_PATH = "NO_PATH"
    # No revision of the map has this tag. metadata: map, tag.
    TAG_UNKNOWN = "TAG_UNKNOWN"
    # Two maps have too little in common to find the transform between them. metadata: why.
    NO_REGISTRATION = "NO_REGISTRATION"
    # The agent has no pose at that time. metadata: first_ns, last_ns of its track.
    TIME_OUTSIDE_TRACK = "TIME_OUTSIDE_TRACK"
    # The map has no such revision yet. metadata: map, oldest, newest.
    REVISION_IN_FUTURE = "REVISION_IN_FUTURE"
    # The revision has been compacted away. metadata: map, oldest, newest.
    REVISION_COMPACTED = "REVISION_COMPACTED"
    # A time is more years from the epoch of the map than a map can hold: check the clock. metadata:
    # map, time_ns.
    TIME_OUTSIDE_MAP = "TIME_OUTSIDE_MAP"
    # The store has a map of this name. metadata: map.
    MAP_EXISTS = "MAP_EXISTS"
    # A pose is not later than the stored end of its track: send a correction to change the past.
    # metadata: agent, time_ns.
    TRACK_CONFLICT = "TRACK_CONFLICT"
    # A different delta was committed with the same session and sequence. metadata: map, session_id,
    # sequence, revision.
    SEQUENCE_REUSED = "SEQUENCE_REUSED"
    # A newer build wrote the map or the file: use that one. metadata: format.
    FORMAT_TOO_NEW = "FORMAT_TOO_NEW"
    # An older build wrote the map: run `dsg upgrade`. metadata: map, format.
    FORMAT_TOO_OLD = "FORMAT_TOO_OLD"
    # The file or folder is no map, or no store.
    NOT_A_STORE = "NOT_A_STORE"
    # The store is on a network file system, where a crash can corrupt it. metadata: store.
    NETWORK_FILE_SYSTEM = "NETWORK_FILE_SYSTEM"
    # The process may not write where the map is. metadata: map.
    READ_ONLY = "READ_ONLY"
    # The policy would leave nothing in the map. metadata: map, policy.
    POLICY_MATCHES_ALL = "POLICY_MATCHES_ALL"
    # Two maps have different clocks or frames. metadata: map, other, field.
    FRAMES_INCOMPATIBLE = "FRAMES_INCOMPATIBLE"
    # The policies would remove a larger share of the map than the caller allows. metadata: map,
    # policy, share, share_max.
    POLICY_TAKES_TOO_MUCH = "POLICY_TAKES_TOO_MUCH"
    # Another commit came in between.
    PARENT_REVISION_STALE = "PARENT_REVISION_STALE"
    # Deltas of the session are missing before this one: send them first. metadata: map, session_id,
    # last_sequence.
    SEQUENCE_GAP = "SEQUENCE_GAP"
    # The map's file was replaced during a watch: start a new watch.
    MAP_REPLACED = "MAP_REPLACED"
    # Another process writes the map. metadata: holder.
    WRITER_LOCKED = "WRITER_LOCKED"
    # The server is stopping.
    SHUTTING_DOWN = "SHUTTING_DOWN"
    # The disk failed during a commit: send the same delta again, which applies it once. metadata:
    # map, sequence.
    COMMIT_OUTCOME_UNKNOWN = "COMMIT_OUTCOME_UNKNOWN"
    # The server is at one of its limits. metadata: retry_after_ms, if waiting helps.
    OVERLOADED = "OVERLOADED"
    # There is no space for what the call writes, and nothing was written.
    DISK_FULL = "DISK_FULL"
    # The request, its answer or what it needs is larger than the server allows: ask for less at
    # once.
    LIMIT_EXCEEDED = "LIMIT_EXCEEDED"
    # The map has reached its size limit: prune it. metadata: map, quota_bytes.
    QUOTA_EXCEEDED = "QUOTA_EXCEEDED"
    # Stored bytes differ from what was written. metadata: map, table, key.
    STORE_CORRUPT = "STORE_CORRUPT"


@dataclass(frozen=True)
class ErrorDetail:
    """Sent beside the status code and message: in serialized form in the trailer "dsg-error-bin",
    and as a detail of the google.rpc.Status in the trailer "grpc-status-details-bin".
    """

    reason: Reason = Reason.REASON_UNSPECIFIED
    # Always "dsg".
    domain: str = ""
    # Names and values that the error is about. A value is cut to 256 bytes, and pairs that would
    # make all of it longer than 768 bytes are left out.
    metadata: Mapping[str, str] = field(default_factory=dict)


class Provenance(ProtoEnum):
    """Where the information about a node came from."""

    PROVENANCE_UNSPECIFIED = "PROVENANCE_UNSPECIFIED"
    # Seen by sensors.
    PROVENANCE_PERCEIVED = "PROVENANCE_PERCEIVED"
    # Read from a scene graph that another program made.
    PROVENANCE_IMPORTED = "PROVENANCE_IMPORTED"
    # Inferred, not seen.
    PROVENANCE_PREDICTED = "PROVENANCE_PREDICTED"
    # Written by a person.
    PROVENANCE_MANUAL = "PROVENANCE_MANUAL"


class Clock(ProtoEnum):
    """The clock of a map's world times."""

    CLOCK_UNSPECIFIED = "CLOCK_UNSPECIFIED"
    # Nanoseconds since 1970-01-01 UTC, without leap seconds.
    CLOCK_UNIX = "CLOCK_UNIX"
    # Nanoseconds since 1970-01-01 TAI.
    CLOCK_PTP_TAI = "CLOCK_PTP_TAI"
    # Nanoseconds since an instant that only the log defines. Not named CLOCK_MONOTONIC because that
    # is a macro of <time.h>, which generated C++ cannot avoid.
    CLOCK_LOG_MONOTONIC = "CLOCK_LOG_MONOTONIC"


class TrajectoryCodec(ProtoEnum):
    """How a map stores its trajectories."""

    TRAJECTORY_CODEC_UNSPECIFIED = "TRAJECTORY_CODEC_UNSPECIFIED"
    # Positions within 0.1 mm and orientations within 6e-5 rad of the committed ones; times exact.
    # About 11 bytes per pose on disk.
    TRAJECTORY_CODEC_QUANTIZED = "TRAJECTORY_CODEC_QUANTIZED"
    # Bit-exact doubles.
    TRAJECTORY_CODEC_LOSSLESS = "TRAJECTORY_CODEC_LOSSLESS"


@dataclass(frozen=True)
class Vector3(Triple):
    """A point or a direction, in the frame that the containing field names."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True)
class Quaternion:
    """A unit quaternion (Hamilton)."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    # The real part.
    w: float = 0.0


@dataclass(frozen=True)
class Pose:
    """A rigid transform. An unset orientation is the identity."""

    # Origin of the body in the outer frame, metres. Unset = the origin.
    position: Optional[Vector3] = None
    # Rotation from the frame of the body to the outer frame. Unset = the identity.
    orientation: Optional[Quaternion] = None


@dataclass(frozen=True)
class Box:
    """An axis-aligned box in the frame that the containing field names."""

    # The corner with the smallest coordinates, metres.
    min: Optional[Vector3] = None
    # The corner with the largest coordinates, metres; on each axis at least that of min.
    max: Optional[Vector3] = None


@dataclass(frozen=True)
class Polygon:
    """An outline in the plane, closed from the last corner to the first."""

    # Corners in order; x and y in metres, interleaved: x0 y0 x1 y1 ...
    xy: tuple[float, ...] = ()


@dataclass(frozen=True)
class Layer:
    """A level of abstraction: all nodes of one layer."""

    # Unique in the map and fixed for its life; 1 to 7 are the layers that every map begins with.
    id: int = 0
    # Unique in the map, at most 64 bytes.
    name: str = ""
    # A higher rank is more abstract: mesh 100, objects 200, places 300, rooms 400, buildings 500.
    rank: int = 0


@dataclass(frozen=True)
class SemanticLabel:
    """A semantic class of the map."""

    # Unique in the map; the labels of mesh vertices refer to it.
    id: int = 0
    # What people call the class: "mug"; at most 1024 bytes.
    name: str = ""


@dataclass(frozen=True)
class AttributeValue:
    """The value of an attribute that the model does not know itself."""

    # Finite; the unit is told by the name of the attribute.
    number: Optional[float] = None
    # UTF-8, at most 64 KiB.
    text: Optional[str] = None
    # Compared as a flag, and never as a number.
    flag: Optional[bool] = None


@dataclass(frozen=True)
class Color:
    """A colour of an object."""

    # Each component 0 to 255.
    red: int = 0
    green: int = 0
    blue: int = 0
    alpha: int = 0


@dataclass(frozen=True)
class ObjectComponent:
    """What only objects have."""

    # SHA-256 of the CAD model's asset, 32 bytes; empty while the shape is unknown.
    model_sha256: bytes = b""
    # Pose of the CAD model in the map frame; set together with model_sha256.
    map_T_model: Optional[Pose] = None
    # Root mean square distance of the registration, metres.
    registration_residual_m: float = 0.0
    color: Optional[Color] = None
    # Edge lengths of the object, metres.
    size: Optional[Vector3] = None
    # Mesh vertices with this instance id belong to the object. 0 = none.
    mesh_instance_id: int = 0


@dataclass(frozen=True)
class AgentComponent:
    """What only agents have: people and robots, whose poses are in a track."""

    # SHA-256 of the body model or CAD asset, 32 bytes; may be empty.
    body_model_sha256: bytes = b""
    # Shape coefficients of the body model (10 for SMPL); may be empty.
    shape_coefficients: tuple[float, ...] = ()
    # State of the tracker, free text: "tracked", "lost", "merged".
    track_state: str = ""
    # Consecutive poses further apart than this are a gap and are not interpolated. 0 = the map's
    # default.
    gap_ns_max: int = 0
    # SHA-256 of assets of keyframes that places are known again by (docs/odometry.md), 32 bytes
    # each; may be empty.
    place_memory_sha256: tuple[bytes, ...] = ()


@dataclass(frozen=True)
class PlaceComponent:
    """What only places have: free space that can be traversed."""

    # Distance to the nearest obstacle, metres.
    clearance_m: float = 0.0
    # Obstacle-free box around the place, in the node's frame.
    free_box: Optional[Box] = None
    # Number of obstacle points that are equally near, at the clearance.
    basis_point_count: int = 0


@dataclass(frozen=True)
class StructureComponent:
    """What only structures have: the fixed parts of a building."""

    # "wall", "floor", "ceiling" or "pillar".
    structure_type: str = ""
    # Plane n.x + d = 0 in the map frame: its unit normal n. Zero = unknown.
    plane_normal: Optional[Vector3] = None
    # Offset d of that plane, metres.
    plane_offset_m: float = 0.0
    # Mesh vertices with this instance id belong to the structure. 0 = none.
    mesh_instance_id: int = 0


@dataclass(frozen=True)
class RegionComponent:
    """Component of rooms, buildings and custom layers above them."""

    # Outline on the floor, in the map frame.
    footprint: Optional[Polygon] = None
    # Height of the floor in the map frame, metres.
    z_min_m: float = 0.0
    # Height of the ceiling in the map frame, metres.
    z_max_m: float = 0.0
    # Probability, 0 to 1, of each class that the region may be of, by name.
    class_probabilities: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Node:
    """An entity of the world in one layer, with what the map knows of it."""

    # A letter and a number: "O42". Stable for the life of the map and never reused.
    id: str = ""
    # Name of the layer.
    layer: str = ""
    # "object", "human", "robot", "place", "structure", "room", "building" or a custom name.
    kind: str = ""
    # What people call it, at most 1024 bytes; may be empty, and several nodes may have the same.
    name: str = ""
    # Unset = no class.
    semantic_class: Optional[SemanticLabel] = None
    # Pose of the node in the map frame; of an agent, its last one or that at the time asked for.
    map_T_node: Optional[Pose] = None
    # Axis-aligned in the node's frame; unset if the node has no extent.
    bounding_box: Optional[Box] = None
    # When the node existed in the world. An unset end is open.
    valid_from_ns: Optional[int] = None
    valid_to_ns: Optional[int] = None
    # World time of the first observation. Unset = unknown.
    first_observed_ns: Optional[int] = None
    # World time of the last observation. Unset = unknown.
    last_observed_ns: Optional[int] = None
    observation_count: int = 0
    # 0 to 1; unset = not estimated.
    confidence: Optional[float] = None
    provenance: Provenance = Provenance.PROVENANCE_UNSPECIFIED
    object: Optional[ObjectComponent] = None
    agent: Optional[AgentComponent] = None
    place: Optional[PlaceComponent] = None
    structure: Optional[StructureComponent] = None
    region: Optional[RegionComponent] = None
    attributes: Mapping[str, AttributeValue] = field(default_factory=dict)
    # The revision that wrote this version of the node. Output only.
    revision: int = 0
    # Input only: which fields to write; see GraphDelta.nodes.
    update_mask: Optional[FieldMask] = None


@dataclass(frozen=True)
class Edge:
    """A relation from one node to another; the three names together are its identity."""

    source: str = ""
    # CONTAINS, TRAVERSABLE, ADJACENT, NEAREST_PLACE, ON, IN, NEAR, CO_VISIBLE, LARGER_THAN,
    # ATTACHED_TO, ENCLOSES, SAME_AS, HELD_BY or a custom name.
    relation: str = ""
    target: str = ""
    # The meaning depends on the relation; clearance in metres for TRAVERSABLE.
    weight: float = 0.0
    valid_from_ns: Optional[int] = None
    valid_to_ns: Optional[int] = None
    attributes: Mapping[str, AttributeValue] = field(default_factory=dict)
    # The revision that wrote this version of the edge. Output only.
    revision: int = 0
    # Input only: which fields to write; see GraphDelta.nodes.
    update_mask: Optional[FieldMask] = None


@dataclass(frozen=True)
class TimedPose:
    """A pose of an agent at one time."""

    time_ns: int = 0
    pose: Optional[Pose] = None
    # Bit flags: 1 = the source gave no orientation; 2 = corrected by a later estimate; 4 =
    # predicted.
    flags: int = 0
    # Upper triangle of the 6x6 covariance, row by row, translation before rotation: 21 numbers, or
    # none.
    covariance: tuple[float, ...] = ()


@dataclass(frozen=True)
class TrajectoryAppend:
    """New poses at the end of an agent's track."""

    agent: str = ""
    # Strictly ascending in time and later than every stored pose of the agent.
    poses: tuple[TimedPose, ...] = ()


@dataclass(frozen=True)
class TrajectoryCorrection:
    """Replaces the agent's poses in [from_ns, to_ns) by `poses`."""

    agent: str = ""
    from_ns: int = 0
    to_ns: int = 0
    poses: tuple[TimedPose, ...] = ()


@dataclass(frozen=True)
class PoseFactor:
    """A constraint of a pose graph between two poses, or on a single pose (a prior: both times are
    equal).
    """

    # "odometry", "zero_velocity", "motion", "detection_prior", "loop_closure" or
    # "loop_closure_rejected" (measured but rejected: not used for the trajectory).
    type: str = ""
    # World time of the pose that it begins at.
    from_time_ns: int = 0
    # World time of the pose that it ends at.
    to_time_ns: int = 0
    # The other agent of an inter-robot factor. Empty = the same agent.
    to_agent: str = ""
    # from_T_to: the pose at to_time_ns in the agent's frame at from_time_ns; metres and unit
    # quaternion. For a prior: map_T_agent.
    relative_pose: Optional[Pose] = None
    # Upper triangle of the 6x6 information matrix (inverse covariance), row by row, translation
    # (1/m^2) before rotation (1/rad^2): 21 numbers, or none.
    information: tuple[float, ...] = ()


@dataclass(frozen=True)
class FactorAppend:
    """New factors of an agent."""

    agent: str = ""
    factors: tuple[PoseFactor, ...] = ()


@dataclass(frozen=True)
class BodyShape:
    """The shape of a body at one time: model coefficients, joints, mesh vertices. Each may be
    empty.
    """

    time_ns: int = 0
    # Rotation vector (axis times angle) of each joint relative to its parent, radians; 72 numbers
    # for SMPL.
    pose_coefficients: tuple[float, ...] = ()
    # 10 numbers for SMPL.
    shape_coefficients: tuple[float, ...] = ()
    # x y z interleaved, agent frame, metres; the topology asset has the faces.
    vertices: tuple[float, ...] = ()
    # x y z interleaved, agent frame, metres; 24 joints for SMPL.
    joints: tuple[float, ...] = ()


@dataclass(frozen=True)
class ShapeAppend:
    """New body shapes of an agent. A shape with the time of a stored one replaces it from this
    revision on.
    """

    agent: str = ""
    # SHA-256 of the asset with the faces, 32 bytes (media type application/x-topology), or empty.
    topology_sha256: bytes = b""
    # Strictly ascending in time.
    shapes: tuple[BodyShape, ...] = ()


@dataclass(frozen=True)
class Stay:
    """An interval during which an agent was in one place and one room."""

    agent: str = ""
    # Node id; may be empty.
    place: str = ""
    # Node id; may be empty.
    room: str = ""
    # World time from which the agent is there; with the agent, the identity of the stay.
    enter_ns: int = 0
    # The largest int64 until the agent has been observed to leave.
    exit_ns: int = 0


@dataclass(frozen=True)
class MeshBlock:
    """The part of the mesh in one cube of the map. A face belongs to the block of its first vertex;
    vertices that it shares with neighbours are in both. Lists by vertex are as long as that of the
    positions, or empty.
    """

    # Index of the block on this axis, which covers [index, index + 1) times the block size of the
    # map.
    x: int = 0
    y: int = 0
    z: int = 0
    # x y z interleaved, map frame, metres.
    positions: tuple[float, ...] = ()
    # x y z interleaved, map frame, unit vectors, one per vertex, or none.
    normals: tuple[float, ...] = ()
    # 0xRRGGBB, one per vertex, or none.
    colors: tuple[int, ...] = ()
    # SemanticLabel.id, one per vertex, or none.
    labels: tuple[int, ...] = ()
    # ObjectComponent.mesh_instance_id or that of a structure, one per vertex, or none. 0 = no
    # instance.
    instance_ids: tuple[int, ...] = ()
    # World time of the first observation of each vertex, or none.
    first_seen_ns: tuple[int, ...] = ()
    # World time of the last observation of each vertex, or none.
    last_seen_ns: tuple[int, ...] = ()
    # Indices of vertices in this block, three per face.
    faces: tuple[int, ...] = ()


@dataclass(frozen=True)
class MeshBlockIndex:
    """Names a block; see MeshBlock.x."""

    x: int = 0
    y: int = 0
    z: int = 0


@dataclass(frozen=True)
class Asset:
    """A file that the map refers to by its hash: a CAD model, a body model, a topology."""

    # SHA-256 of content, 32 bytes; the store verifies it.
    sha256: bytes = b""
    # "model/ply", "model/obj", "application/x-topology", ...
    media_type: str = ""
    # The bytes of the file.
    content: bytes = b""


@dataclass(frozen=True)
class Retirement:
    """The end of a node, of its edges and of its stays."""

    # The node that ends.
    id: str = ""
    # When the node left the world. Unset: the node never existed, and its row ends with this
    # revision.
    valid_to_ns: Optional[int] = None


@dataclass(frozen=True)
class EdgeKey:
    """Names an edge."""

    source: str = ""
    relation: str = ""
    target: str = ""


@dataclass(frozen=True)
class TrackSpan:
    """A half-open interval of one agent's track."""

    agent: str = ""
    from_ns: int = 0
    to_ns: int = 0


@dataclass(frozen=True)
class StayKey:
    """Names a stay."""

    agent: str = ""
    # See Stay.enter_ns.
    enter_ns: int = 0


@dataclass(frozen=True)
class GraphDelta:
    """A set of changes to one map, applied as a whole or not at all."""

    map: str = ""
    # Together with sequence: the identity of the delta. A delta that was applied before is
    # acknowledged and not applied again.
    session_id: str = ""
    # Starts at 1 and has no gaps within a session.
    sequence: int = 0
    # If set, the commit fails with ABORTED unless this is the newest revision.
    parent_revision: Optional[int] = None
    author: str = ""
    # One line about the change, at most 64 KiB; in the record of the revision.
    message: str = ""
    config_digest: str = ""
    layers: tuple[Layer, ...] = ()
    labels: tuple[SemanticLabel, ...] = ()
    # Merged into the stored nodes with the same ids. Without `update_mask`, the fields that are set
    # are written, including set fields of submessages and entries of maps; all other fields keep
    # their values. Numbers and strings without presence count as set if they are not 0 and not
    # empty. A non-empty list replaces the stored list. With `update_mask`, exactly its paths are
    # written, which can also clear a field; "*" replaces the whole node. Edges follow the same
    # rules.
    nodes: tuple[Node, ...] = ()
    retirements: tuple[Retirement, ...] = ()
    edges: tuple[Edge, ...] = ()
    # Ends these edges with this revision.
    edge_removals: tuple[EdgeKey, ...] = ()
    appends: tuple[TrajectoryAppend, ...] = ()
    corrections: tuple[TrajectoryCorrection, ...] = ()
    factors: tuple[FactorAppend, ...] = ()
    shapes: tuple[ShapeAppend, ...] = ()
    # To close an open stay, commit it again with the same agent and enter_ns.
    stays: tuple[Stay, ...] = ()
    mesh_blocks: tuple[MeshBlock, ...] = ()
    # Removes these blocks from this revision on.
    mesh_removals: tuple[MeshBlockIndex, ...] = ()
    assets: tuple[Asset, ...] = ()
    # Removes the agent's factors with an end in the span. Applied before `factors`.
    factor_removals: tuple[TrackSpan, ...] = ()
    # Removes the agent's body shapes with a time in the span. Applied before `shapes`.
    shape_removals: tuple[TrackSpan, ...] = ()
    # Removes stays; a missing one is not an error. Applied before `stays`.
    stay_removals: tuple[StayKey, ...] = ()
    # The delta may use the space reserved for pruning. It must contain only retirements, removals,
    # corrections, stays and mesh blocks. IngestService.Commit ignores this field.
    is_forgetting: bool = False


@dataclass(frozen=True)
class MapSpec:
    """What a map is created with, fixed for its life."""

    # [a-z0-9][a-z0-9_-]{0,63}
    name: str = ""
    # Name of the frame of all poses in the map.
    frame: str = ""
    # World time at which relative times and logs without a clock start.
    epoch_ns: int = 0
    clock: Clock = Clock.CLOCK_UNSPECIFIED
    codec: TrajectoryCodec = TrajectoryCodec.TRAJECTORY_CODEC_UNSPECIFIED
    # Consecutive poses of an agent further apart than this are a gap. Default 2 s.
    gap_ns_max: int = 0
    # Edge length of a mesh block, metres. Default 2.
    mesh_block_size_m: float = 0.0


@dataclass(frozen=True)
class Revision:
    """The record of one commit."""

    # From 1, without gaps.
    revision: int = 0
    # Time of the commit on the writer's wall clock, nanoseconds since 1970 UTC.
    committed_ns: int = 0
    author: str = ""
    # See GraphDelta.message.
    message: str = ""
    session_id: str = ""
    sequence: int = 0
    # SHA-256 over the parent revision's digest and this revision's content; 32 bytes.
    digest: bytes = b""
    node_count: int = 0
    edge_count: int = 0
    agent_count: int = 0
    pose_count: int = 0
    config_digest: str = ""


@dataclass(frozen=True)
class CommitRequest:
    delta: Optional[GraphDelta] = None


@dataclass(frozen=True)
class CommitResponse:
    # The revision that contains the delta.
    revision: int = 0
    # True if the delta had been applied before.
    replayed: bool = False


@dataclass(frozen=True)
class GetSessionRequest:
    map: str = ""
    session_id: str = ""


@dataclass(frozen=True)
class GetSessionResponse:
    # The sequence of its last delta, so that the next one has one more. 0 = unknown session.
    last_sequence: int = 0
    # The revision of that delta.
    last_revision: int = 0
    # The revision of the session's first delta; everything in earlier revisions is older than the
    # session.
    first_revision: int = 0


class PoseQuality(ProtoEnum):
    """How a pose was obtained from the track."""

    POSE_QUALITY_UNSPECIFIED = "POSE_QUALITY_UNSPECIFIED"
    # A stored pose has exactly this time.
    EXACT = "EXACT"
    # Interpolated between two stored poses no further apart than the gap limit.
    INTERPOLATED = "INTERPOLATED"
    # Between two stored poses further apart than the gap limit; no pose is given.
    IN_GAP = "IN_GAP"


class NodeView(ProtoEnum):
    """Which fields of a node to send."""

    # = FULL
    NODE_VIEW_UNSPECIFIED = "NODE_VIEW_UNSPECIFIED"
    # id, layer, kind, name, class, validity.
    NODE_VIEW_BASIC = "NODE_VIEW_BASIC"
    # BASIC, and pose and box.
    NODE_VIEW_GEOMETRY = "NODE_VIEW_GEOMETRY"
    # All fields.
    NODE_VIEW_FULL = "NODE_VIEW_FULL"
    # The id only; of edges their key.
    NODE_VIEW_ID = "NODE_VIEW_ID"


@dataclass(frozen=True)
class ReadAt:
    """The revision to read. Unset = latest."""

    # The newest revision.
    latest: Optional[bool] = None
    # The newest revision; fails with OUT_OF_RANGE if it is older than this one.
    at_least_revision: Optional[int] = None
    # Exactly this revision.
    exact_revision: Optional[int] = None
    # The revision with this tag; see SetTag.
    tag: Optional[str] = None
    # The newest revision that was committed at or before this time of the writer's wall clock,
    # nanoseconds since 1970 UTC; fails with OUT_OF_RANGE if there is none.
    committed_at_ns: Optional[int] = None


@dataclass(frozen=True)
class ResponseHeader:
    """Which state of the map an answer is about."""

    # The revision that the answer was read from.
    read_revision: int = 0
    # The newest revision.
    head_revision: int = 0
    # The oldest revision that can be read.
    oldest_revision: int = 0
    # Identifies the instance of the map. It changes when the map is restored or created anew;
    # revisions, ids and page tokens of an earlier incarnation are then invalid. Opaque.
    incarnation: str = ""


@dataclass(frozen=True)
class NodeFilter:
    """Which nodes to take; all conditions that are set must hold."""

    # Name of the layer. Empty = any.
    layer: str = ""
    # Kind of the node, see Node.kind. Empty = any.
    kind: str = ""
    class_name: str = ""
    # Only children of this node by CONTAINS.
    parent_id: str = ""
    # Only nodes whose boxes touch this box; map frame.
    box: Optional[Box] = None
    # Only nodes that are valid at this world time. Agents are listed if it lies between their first
    # and last pose, with their pose at that time; in a gap of the track they are listed without a
    # pose, and match no box and no distance.
    at_ns: Optional[int] = None
    # Exact name. Empty = any.
    name: str = ""


class PruneStrength(ProtoEnum):
    """How much of what a policy matches is removed."""

    # Same as RETIRE.
    PRUNE_STRENGTH_UNSPECIFIED = "PRUNE_STRENGTH_UNSPECIFIED"
    # New revisions do not contain the data; older revisions still do.
    RETIRE = "RETIRE"
    # No revision contains the data, and neither the database file nor its log holds the bytes.
    # Older backups still do.
    ERASE = "ERASE"


@dataclass(frozen=True)
class PrunePolicy:
    """What to remove. Times are world times. Ages count back from the newest observation that
    another observation of the map supports, so that a single fast clock makes nothing old.
    """

    # Name in reports.
    name: str = ""
    # A node by id or name, and everything that it contains.
    branch: Optional[str] = None
    # Nodes with their position inside, and poses and mesh inside.
    region_map: Optional[Box] = None
    # Poses, shapes, factors and stays that end before this time, and nodes whose validity ended
    # before.
    before_ns: Optional[int] = None
    # As before_ns, by age.
    older_than_ns: Optional[int] = None
    # A whole layer: "mesh", or a layer's name.
    layer: Optional[str] = None
    # Nodes last observed before this time.
    unseen_since_ns: Optional[int] = None
    # As unseen_since_ns, by age.
    unseen_for_ns: Optional[int] = None
    # Revisions without a tag that were committed longer ago than this by the wall clock. Jumps of
    # that clock by more than a week count as no time.
    history_older_than_ns: Optional[int] = None
    # Revisions without a tag before this one.
    history_before_revision: Optional[int] = None
    # Only these layers; "mesh" is allowed. Empty = all layers that the policy applies to.
    layers: tuple[str, ...] = ()
    # Thins tracks instead of removing them: of the poses that `what` names (or of all), removes
    # those that linear interpolation in time reproduces within this distance, metres. 0 = remove.
    simplify_m: float = 0.0
    # With simplify_m: and within this angle, radians. 0 = 0.1.
    simplify_rad: float = 0.0
    strength: PruneStrength = PruneStrength.PRUNE_STRENGTH_UNSPECIFIED


@dataclass(frozen=True)
class PruneRequest:
    map: str = ""
    policies: tuple[PrunePolicy, ...] = ()
    # Reports what would be removed and changes nothing.
    dry_run: bool = False
    # Allows a policy to match every node or every pose of the map, or the branch of its only
    # building.
    allow_everything: bool = False
    # Author of the revisions written.
    author: str = ""
    # Largest share, 0 to 1, of the nodes without agents, and of the poses, that may be removed. 0 =
    # no limit. Above it nothing is removed, and FAILED_PRECONDITION/POLICY_TAKES_TOO_MUCH is
    # returned.
    share_max: float = 0.0


@dataclass(frozen=True)
class Amount:
    """Rows and payload bytes by type."""

    node_count: int = 0
    edge_count: int = 0
    pose_count: int = 0
    shape_count: int = 0
    factor_count: int = 0
    stay_count: int = 0
    mesh_block_count: int = 0
    asset_count: int = 0
    revision_count: int = 0
    # Bytes of payloads as stored.
    byte_count: int = 0
    # Stays that are kept but lose their room, place or beginning; no row of these is removed.
    stay_edit_count: int = 0


@dataclass(frozen=True)
class PolicyReport:
    """What one policy of a prune takes."""

    # PrunePolicy.name.
    name: str = ""
    # What the policy matched.
    matched: Optional[Amount] = None


@dataclass(frozen=True)
class PruneResponse:
    header: Optional[ResponseHeader] = None
    # One per policy, in order; complete in the first message.
    policies: tuple[PolicyReport, ...] = ()
    # What the map held before the call; in the first message.
    map_before: Optional[Amount] = None
    # 0 to 1.
    progress: float = 0.0
    # The newest revision that this call wrote. 0 = none.
    revision: int = 0
    # Set with `done`.
    map_after: Optional[Amount] = None
    # With `done`: all space that the map took on disk before the call, bytes.
    file_bytes_before: int = 0
    # With `done`: the same after the call.
    file_bytes_after: int = 0
    # With ERASE: false if data is left, of this erasure or of an earlier one that was interrupted,
    # or if a reader kept the log from being truncated; call again.
    erased: bool = False
    done: bool = False
    # The part of `file_bytes_before` that the store reuses, such as a log, bytes.
    log_bytes_before: int = 0
    # That part of `file_bytes_after`.
    log_bytes_after: int = 0
    # With ERASE: number of agents and mesh blocks that other clients kept writing or correcting
    # meanwhile, so that some of their data is left.
    left_count: int = 0
    # The first 20 of them: node ids, and blocks as x,y,z.
    left_ids: tuple[str, ...] = ()
    # With ERASE: number of nodes that other clients wrote again meanwhile. Their history is erased,
    # but they exist in the newest revision.
    rewritten_count: int = 0
    # The first 20 of them.
    rewritten_ids: tuple[str, ...] = ()
    # With `dry_run`: why the run would be refused. Empty = it would not.
    refusal: str = ""
    # Agents whose newest pose is so much later than those of all others that ages do not count from
    # it.
    implausible_ids: tuple[str, ...] = ()
    # Sentences about clocks that were considered wrong. Ages are counted without them, so that less
    # is removed.
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class CompactRequest:
    map: str = ""
    # The oldest revision that stays readable. Unset = the newest.
    keep_from_revision: Optional[int] = None


@dataclass(frozen=True)
class CompactResponse:
    progress: float = 0.0
    # The oldest revision that can be read now.
    oldest_revision: int = 0
    # Number of revisions that the call made unreadable.
    revision_count: int = 0
    # Number of rows that no readable revision shows, and that are deleted.
    row_count: int = 0
    # All space that the map took on disk before the call, bytes.
    file_bytes_before: int = 0
    # The same after the call.
    file_bytes_after: int = 0
    # False if a reader kept the file from shrinking; it shrinks later.
    shrunk: bool = False
    done: bool = False


@dataclass(frozen=True)
class RevertRequest:
    map: str = ""
    # The number of the revision.
    revision: Optional[int] = None
    # A tag of the revision; see SetTag.
    tag: Optional[str] = None
    author: str = ""
    dry_run: bool = False


@dataclass(frozen=True)
class RevertResponse:
    progress: float = 0.0
    # The newest revision written. 0 = there was nothing to do.
    revision: int = 0
    # Rows that are written back. A changed row counts among these.
    added: Optional[Amount] = None
    # Rows that are removed.
    removed: Optional[Amount] = None
    done: bool = False


@dataclass(frozen=True)
class MergeMapsRequest:
    # The map to extend.
    map: str = ""
    # The map to merge into it; not changed.
    other: str = ""
    # Transforms coordinates of `other` into those of `map`. Unset = estimated.
    map_t_other: Optional[Pose] = None
    dry_run: bool = False
    author: str = ""


@dataclass(frozen=True)
class MergeMapsResponse:
    progress: float = 0.0
    # The transform that is used: that of the request, or the estimated one.
    map_t_other: Optional[Pose] = None
    # Root mean square distance of fused objects, metres.
    residual_m: float = 0.0
    # Number of objects that agree with the transform.
    agreeing_count: int = 0
    fused_object_count: int = 0
    fused_place_count: int = 0
    fused_room_count: int = 0
    fused_mesh_block_count: int = 0
    added_node_count: int = 0
    # Objects of `map` at positions where `other` later saw free space.
    gone_count: int = 0
    # The newest revision that the merge wrote. 0 = none yet.
    revision: int = 0
    # The node ids of `other` and their ids in `map`: in the last messages, thousands in each, when
    # everything is written; at once in a dry run.
    node_ids: Mapping[str, str] = field(default_factory=dict)
    done: bool = False
    # With `done`: nodes that the merge removed.
    gone_ids: tuple[str, ...] = ()
    # With `done`: the new ids of nodes that moved, by their old ids.
    moved_ids: Mapping[str, str] = field(default_factory=dict)
    fused_structure_count: int = 0
    # Evidence against the transform: number of objects of either map that the other one observed to
    # be missing.
    missing_count: int = 0
    # Evidence against the transform: share, 0 to 1, of the places near walls of the other map that
    # lie inside a wall.
    blocked_share: float = 0.0


@dataclass(frozen=True)
class Tag:
    """A name of a revision, which keeps it readable when its neighbours are compacted."""

    # 1 to 64 letters, digits, '.', '_' and '-', not digits alone.
    name: str = ""
    # The revision that is named.
    revision: int = 0
    # When the tag was set, by the server's wall clock, nanoseconds since 1970 UTC.
    created_ns: int = 0
    # Free text, at most 1000 bytes; may be empty.
    note: str = ""


@dataclass(frozen=True)
class SetTagRequest:
    map: str = ""
    # See Tag.name.
    name: str = ""
    # Unset = the newest revision.
    revision: Optional[int] = None
    # Unset = the note of the existing tag.
    note: Optional[str] = None


@dataclass(frozen=True)
class SetTagResponse:
    tag: Optional[Tag] = None


@dataclass(frozen=True)
class RemoveTagRequest:
    map: str = ""
    # See Tag.name.
    name: str = ""


@dataclass(frozen=True)
class RemoveTagResponse:
    pass


@dataclass(frozen=True)
class ListTagsRequest:
    map: str = ""


@dataclass(frozen=True)
class ListTagsResponse:
    tags: tuple[Tag, ...] = ()


@dataclass(frozen=True)
class ReadArchiveRequest:
    map: str = ""


@dataclass(frozen=True)
class ReadArchiveResponse:
    # At most 1 MiB of the archive.
    content: bytes = b""
    progress: float = 0.0


@dataclass(frozen=True)
class DropMapRequest:
    map: str = ""
    # Drop the map only if this is its newest revision. Unset = whatever it is.
    expected_head_revision: Optional[int] = None
    # Drop only the map that answers with this ResponseHeader.incarnation. Empty = any.
    expected_incarnation: str = ""


@dataclass(frozen=True)
class DropMapResponse:
    # The newest revision of the map. Unset if the map could not be read.
    head_revision: Optional[int] = None
    # Space on disk that is free again, bytes; 0 for a store in memory.
    bytes_on_disk: int = 0


@dataclass(frozen=True)
class RenameMapRequest:
    map: str = ""
    # As MapSpec.name; no map of the store has it.
    new_name: str = ""


@dataclass(frozen=True)
class RenameMapResponse:
    # The map under its new name.
    map: Optional[MapSpec] = None


class ChangeType(ProtoEnum):
    """What happened to an entity between two revisions."""

    CHANGE_TYPE_UNSPECIFIED = "CHANGE_TYPE_UNSPECIFIED"
    # Only "after" has it.
    ADDED = "ADDED"
    # Only "before" has it.
    REMOVED = "REMOVED"
    # Both have it, with different content.
    CHANGED = "CHANGED"


@dataclass(frozen=True)
class CreateMapRequest:
    map: Optional[MapSpec] = None


@dataclass(frozen=True)
class CreateMapResponse:
    # The map as created, with defaults filled in.
    map: Optional[MapSpec] = None


@dataclass(frozen=True)
class ListMapsRequest:
    pass


@dataclass(frozen=True)
class ListMapsResponse:
    # Ascending by name.
    maps: tuple[MapSpec, ...] = ()
    # Names of maps that exist but cannot be opened; a query to such a map returns the reason.
    # Ascending.
    unreadable_maps: tuple[str, ...] = ()


@dataclass(frozen=True)
class GetMapStatsRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None


@dataclass(frozen=True)
class LayerStats:
    """The size of one layer."""

    # Layer.name.
    name: str = ""
    # Layer.rank.
    rank: int = 0
    node_count: int = 0


@dataclass(frozen=True)
class PendingErasure:
    """What an erasure still has to remove, by type."""

    node_count: int = 0
    edge_count: int = 0
    mesh_block_count: int = 0
    # Intervals of tracks.
    span_count: int = 0


@dataclass(frozen=True)
class GetMapStatsResponse:
    header: Optional[ResponseHeader] = None
    map: Optional[MapSpec] = None
    # The newest revision of the map.
    head_revision: int = 0
    # Ascending by rank, then name.
    layers: tuple[LayerStats, ...] = ()
    node_count: int = 0
    edge_count: int = 0
    agent_count: int = 0
    pose_count: int = 0
    stay_count: int = 0
    mesh_block_count: int = 0
    # Space that the map takes on disk, bytes; 0 for a store in memory.
    bytes_on_disk: int = 0
    # World time of the earliest pose of all tracks. Unset if there are none.
    first_pose_ns: Optional[int] = None
    # World time of the latest pose of all tracks. Unset if there are none.
    last_pose_ns: Optional[int] = None
    # The store format of the map on disk.
    format_version: int = 0
    # What an interrupted erasure still has to remove; unset = none is pending. Repeat the same
    # prune to finish it.
    pending_erasure: Optional[PendingErasure] = None
    # What can be read, ascending: a tag keeps its revision when those around it are compacted.
    readable_revisions: tuple[RevisionRange, ...] = ()


@dataclass(frozen=True)
class RevisionRange:
    """Revisions from `first` up to and including `last`."""

    # The oldest and the newest revision of the range; equal for a single one.
    first: int = 0
    # At least `first`.
    last: int = 0


@dataclass(frozen=True)
class ListRevisionsRequest:
    map: str = ""
    # Only revisions below this one. 0 = from the newest.
    before_revision: int = 0
    # 1 to 1000; 0 = 100.
    page_size: int = 0
    # Not all, but page_size of them at even steps, the newest and the oldest among them.
    sampled: bool = False


@dataclass(frozen=True)
class ListRevisionsResponse:
    header: Optional[ResponseHeader] = None
    revisions: tuple[Revision, ...] = ()


@dataclass(frozen=True)
class GetServerInfoRequest:
    pass


@dataclass(frozen=True)
class GetServerInfoResponse:
    # What `dsg-server --version` prints.
    version: str = ""
    # The store format that the server writes, and the newest one that it reads.
    store_format_version: int = 0


@dataclass(frozen=True)
class DiffRevisionsRequest:
    map: str = ""
    # Differences are from from_revision ("before") to to_revision ("after"); "before" may be the
    # later one.
    from_revision: int = 0
    # Unset = the newest revision.
    to_revision: Optional[int] = None
    # Only nodes of this layer, edges that touch one, and tracks of agents in it; mesh blocks only
    # for the layer "mesh". A node counts if it is in the layer in either revision.
    layer: str = ""
    view: NodeView = NodeView.NODE_VIEW_UNSPECIFIED
    page_size: int = 0
    page_token: str = ""


@dataclass(frozen=True)
class NodeChange:
    """A node that differs."""

    type: ChangeType = ChangeType.CHANGE_TYPE_UNSPECIFIED
    # Unset if type is ADDED.
    before: Optional[Node] = None
    # Unset if type is REMOVED.
    after: Optional[Node] = None


@dataclass(frozen=True)
class EdgeChange:
    """An edge that differs."""

    type: ChangeType = ChangeType.CHANGE_TYPE_UNSPECIFIED
    # Unset if type is ADDED.
    before: Optional[Edge] = None
    # Unset if type is REMOVED.
    after: Optional[Edge] = None


@dataclass(frozen=True)
class TrackChange:
    """A track that differs."""

    agent_id: str = ""
    # Number of poses in "before".
    pose_count_before: int = 0
    # Number of poses in "after".
    pose_count_after: int = 0
    # World time of the last pose in "before". 0 without poses.
    last_pose_ns_before: int = 0
    # World time of the last pose in "after". 0 without poses.
    last_pose_ns_after: int = 0
    # Poses of the earlier revision are changed or missing in the later one.
    corrected: bool = False


@dataclass(frozen=True)
class MeshChange:
    """A mesh block that differs."""

    type: ChangeType = ChangeType.CHANGE_TYPE_UNSPECIFIED
    # The block.
    index: Optional[MeshBlockIndex] = None


@dataclass(frozen=True)
class DiffRevisionsResponse:
    # read_revision is the later of the two revisions.
    header: Optional[ResponseHeader] = None
    # "Before".
    from_revision: int = 0
    # "After"; that of the request, or the newest revision.
    to_revision: int = 0
    # Ascending by id.
    nodes: tuple[NodeChange, ...] = ()
    # Ascending by source, relation, target.
    edges: tuple[EdgeChange, ...] = ()
    # Ascending by id.
    tracks: tuple[TrackChange, ...] = ()
    # Ascending by x, y, z.
    mesh_blocks: tuple[MeshChange, ...] = ()
    next_page_token: str = ""


@dataclass(frozen=True)
class WatchMapRequest:
    map: str = ""
    # The last revision that the caller knows; the first event is the next one. Unset = the head.
    after_revision: Optional[int] = None
    # Without a new revision for this long, the server sends a message with only a header as a sign
    # of life. At least 100 ms; 0 = 5 s.
    idle_period_ns: int = 0
    # Also send the changes of each revision.
    changes: bool = False
    view: NodeView = NodeView.NODE_VIEW_UNSPECIFIED


@dataclass(frozen=True)
class WatchMapResponse:
    # All revisions up to read_revision have been sent completely: pass it as after_revision to
    # resume.
    header: Optional[ResponseHeader] = None
    # Unset in a message that is only a sign of life.
    revision: Optional[Revision] = None
    # Set if requested. The changes of a large revision come in several messages with the same
    # `revision`.
    changes: Optional[DiffRevisionsResponse] = None
    # True in the last message of this revision.
    complete: bool = False


class InteractionType(ProtoEnum):
    """What happened to an object."""

    INTERACTION_TYPE_UNSPECIFIED = "INTERACTION_TYPE_UNSPECIFIED"
    # The object was removed from where it was.
    PICKED = "PICKED"
    # The object appeared where it was not before.
    PLACED = "PLACED"


@dataclass(frozen=True)
class ListEncountersRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Only encounters of this agent. Empty = of all pairs.
    agent: str = ""
    # Only encounters with this other agent.
    other_agent: str = ""
    from_ns: int = 0
    to_ns: int = 0
    # Largest distance between positions, metres. 0 = 2.
    distance_m: float = 0.0
    # Encounters shorter than this are left out.
    duration_ns_min: int = 0
    # Only while both agents are in each other's line of sight: interrupts encounters where walls,
    # floors or ceilings lie between the points 0.3 m above both positions (a position may lie on
    # the floor).
    line_of_sight: bool = False
    page_size: int = 0
    page_token: str = ""
    # With line_of_sight: an encounter continues if the agents stay near and are out of sight for at
    # most this long. 0 = 2 s.
    sight_gap_ns_max: int = 0


@dataclass(frozen=True)
class Encounter:
    """An interval in which two agents were near each other."""

    # Of the two ids, the lower one.
    agent_id: str = ""
    agent_name: str = ""
    other_agent_id: str = ""
    other_agent_name: str = ""
    # Clipped to the requested interval. The distance between interpolated positions is below the
    # limit throughout [from_ns, to_ns); gaps of either track belong to no encounter. With
    # line_of_sight: in sight except for at most sight_gap_ns_max at a time, and the least distance
    # is the one while in sight.
    from_ns: int = 0
    to_ns: int = 0
    # Least distance between the positions of the two, metres.
    distance_m_min: float = 0.0
    # World time of the least distance.
    closest_at_ns: int = 0
    # Midpoint of the two positions at closest_at_ns, map frame.
    position: Optional[Vector3] = None
    # Place and room of the agent at closest_at_ns; may be empty.
    place_id: str = ""
    room_id: str = ""


@dataclass(frozen=True)
class ListEncountersResponse:
    header: Optional[ResponseHeader] = None
    # Ascending by from_ns, then agent_id, then other_agent_id.
    encounters: tuple[Encounter, ...] = ()
    next_page_token: str = ""
    # Number of agents that were observed within the interval.
    observed_agent_count: int = 0


@dataclass(frozen=True)
class ListInteractionsRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Empty = any agent.
    agent: str = ""
    # Only this object, by node id or unique name. Empty = any.
    object: str = ""
    class_name: str = ""
    # A room, or a node of a higher layer: only objects below it when they were picked or placed.
    node_id: str = ""
    from_ns: int = 0
    to_ns: int = 0
    # Empty = all.
    types: tuple[InteractionType, ...] = ()
    # Include interactions for which the evidence names no agent.
    include_abstained: bool = False
    page_size: int = 0
    page_token: str = ""


@dataclass(frozen=True)
class Evidence:
    """A fact from the map that supports or contradicts a candidate."""

    # "hand_distance", "dwell", "visit_window", "unobserved", "delay", "held", "carried", "moved",
    # "identity" or "prior".
    kind: str = ""
    # Its contribution to the candidate's log odds.
    log_weight: float = 0.0
    # The measured quantity, in the unit that `detail` names.
    value: float = 0.0
    from_ns: int = 0
    to_ns: int = 0
    # The edge or node that the quantity was read from, such as "H3 NEAR O12" or "O12"; may be
    # empty.
    source: str = ""
    # One sentence.
    detail: str = ""


@dataclass(frozen=True)
class InteractionCandidate:
    """Who or what may explain a change of an object."""

    # Empty if `alternative` is set.
    agent_id: str = ""
    agent_name: str = ""
    # An explanation without an agent of the map: "unseen" (an agent that nobody observed) or
    # "false_change" (nothing happened). Empty if `agent_id` is set.
    alternative: str = ""
    probability: float = 0.0
    # Most likely time according to the evidence.
    at_ns: int = 0
    evidence: tuple[Evidence, ...] = ()


@dataclass(frozen=True)
class Interaction:
    """An object was picked or placed."""

    type: InteractionType = InteractionType.INTERACTION_TYPE_UNSPECIFIED
    object_id: str = ""
    object_name: str = ""
    class_name: str = ""
    room_id: str = ""
    # The last time before the change that the object was seen in its earlier state.
    earliest_ns: int = 0
    # The first time after it that the object was seen in its later state.
    latest_ns: int = 0
    # Descending probability, then id. The probabilities of all candidates, including those not
    # listed, sum to 1.
    candidates: tuple[InteractionCandidate, ...] = ()
    # The evidence names no agent; `reason` says why.
    abstained: bool = False
    # Why no agent is named, one sentence. Empty unless `abstained`.
    reason: str = ""


@dataclass(frozen=True)
class ListInteractionsResponse:
    header: Optional[ResponseHeader] = None
    # Ascending by earliest_ns, then object id.
    interactions: tuple[Interaction, ...] = ()
    next_page_token: str = ""
    # Share of the interval, 0 to 1, in which any agent or object was observed.
    observed_share: float = 0.0


@dataclass(frozen=True)
class GetSceneRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Names of layers. Empty = all.
    layers: tuple[str, ...] = ()
    # Relations of the edges. Empty = all.
    relations: tuple[str, ...] = ()
    # Send no edges. Parents are sent all the same.
    without_edges: bool = False
    # Only nodes and edges that were valid at this world time, and agents between their first and
    # last pose, where they were then. Unset = of any time, agents at their last pose.
    at_ns: Optional[int] = None
    # Of a layer with more nodes only so many are sent, evenly over its ids. 0 = no limit.
    nodes_per_layer_max: int = 0


@dataclass(frozen=True)
class SceneLayer:
    """A layer of a scene, and how much of it is sent."""

    layer: Optional[Layer] = None
    # Nodes of the layer that the request asks for.
    node_count: int = 0
    # How many of them are sent: fewer than node_count if nodes_per_layer_max was exceeded.
    sent_count: int = 0


@dataclass(frozen=True)
class SceneHead:
    """What a reader must know before the first row."""

    # Descending by rank, then by name: the order of the rows.
    layers: tuple[SceneLayer, ...] = ()
    # Positions and outlines are relative to this point of the map frame, metres.
    origin_map: Optional[Vector3] = None
    # The corners of all boxes and positions that are sent, map frame, metres. Unset without nodes.
    bounds_map: Optional[Box] = None
    # Edges of the revision: no more are sent.
    edge_count_max: int = 0


@dataclass(frozen=True)
class SceneNodes:
    """Nodes of one layer, ascending by id."""

    # Name of the layer that all of them are in.
    layer: str = ""
    # The number of the first row; rows are numbered from 0 through all messages of the stream.
    first_row: int = 0
    row_count: int = 0
    # uint64: the letter of the id in the top 8 bits, its number in the low 56.
    ids: bytes = b""
    # uint32: the row of the parent by CONTAINS; 0xffffffff = it has none, or the parent is not
    # sent.
    parents: bytes = b""
    # 3 x float32, metres from origin_map. NaN = nobody knows: an agent in a gap of its track.
    positions: bytes = b""
    # 4 x float32, x y z w of map_T_node. Empty = all are the identity.
    orientations: bytes = b""
    # 6 x float32: minimum and maximum in the node's frame, metres. NaN = no extent. Empty = none
    # has an extent.
    boxes: bytes = b""
    # The kinds that the rows have: "human", "room", ...
    kinds: tuple[str, ...] = ()
    # uint16 into kinds. Empty = all are kinds[0].
    kind_indices: bytes = b""
    # Names of semantic classes; "" stands for none.
    classes: tuple[str, ...] = ()
    # uint16 into classes. Empty = all are classes[0].
    class_indices: bytes = b""
    # 4 x uint8: red, green, blue, alpha. Alpha 0 = no colour. Empty = none has a colour.
    colors: bytes = b""
    # int64, nanoseconds; the smallest int64 = open. Empty = all are open.
    valid_from_ns: bytes = b""
    # int64, nanoseconds; the largest int64 = open. Empty = all are open.
    valid_to_ns: bytes = b""
    # uint32: the end of the row's name in `names`; it begins where that of the row before ends.
    # Empty = none has a name.
    name_ends: bytes = b""
    # The names one after the other, UTF-8.
    names: bytes = b""
    # float32, metres to the nearest obstacle. Empty = these are no places.
    clearances: bytes = b""
    # uint32: the end of the row's outline in `outlines`, in corners. Empty = none has an outline.
    outline_ends: bytes = b""
    # 2 x float32 a corner: x and y in metres from origin_map.
    outlines: bytes = b""
    # 2 x float32: heights of floor and ceiling, metres from origin_map. Empty = none has an
    # outline.
    heights: bytes = b""


@dataclass(frozen=True)
class SceneEdges:
    """Edges of one relation between nodes that are sent, ascending by source, then target."""

    relation: str = ""
    row_count: int = 0
    # uint32: the row of the node that each edge comes from.
    sources: bytes = b""
    # uint32: the row of the node that it leads to.
    targets: bytes = b""
    # float32; the meaning depends on the relation. Empty = all are 1.
    weights: bytes = b""
    # int64, nanoseconds; as of nodes.
    valid_from_ns: bytes = b""
    valid_to_ns: bytes = b""


@dataclass(frozen=True)
class GetSceneResponse:
    # Set in the first message only, as is head.
    header: Optional[ResponseHeader] = None
    head: Optional[SceneHead] = None
    # One of both, about 1 MiB; all nodes come before the first edge.
    nodes: Optional[SceneNodes] = None
    edges: Optional[SceneEdges] = None


@dataclass(frozen=True)
class GetTracksRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Node ids ("H12") or the names that the log gave ("12"), at most 10,000. Empty = all agents.
    agents: tuple[str, ...] = ()
    # Half-open. Unset = from the first pose, and up to and including the last.
    from_ns: Optional[int] = None
    to_ns: Optional[int] = None
    # If set (at least 1 ms): poses interpolated at this period, from from_ns on, or of each track
    # from its first pose on; none inside gaps.
    resample_period_ns: int = 0
    # If set: of stored poses that follow another one sooner than this only some are sent, so that
    # two are at least so far apart. The first and the last pose of a stretch without a gap are
    # always sent. Not together with resample_period_ns.
    thin_period_ns: int = 0
    # Send times and positions only.
    without_orientations: bool = False
    # Send positions and orientations as float32, in half of the bytes: positions within some
    # micrometres, relative to an origin near by.
    single_precision: bool = False


@dataclass(frozen=True)
class TrackHead:
    """An agent whose poses are sent."""

    agent_id: str = ""
    agent_name: str = ""
    # Consecutive poses further apart than this are a gap.
    gap_ns_max: int = 0
    # Poses of the whole track, whatever the request asks.
    pose_count: int = 0
    # Time of its first pose, nanoseconds; 0 without poses.
    first_pose_ns: int = 0
    # Time of its last pose, nanoseconds; 0 without poses.
    last_pose_ns: int = 0


@dataclass(frozen=True)
class TrackPoses:
    """Poses map_T_agent of one track, ascending in time."""

    # Index into tracks of the first message.
    track: int = 0
    row_count: int = 0
    # int64, nanoseconds.
    times_ns: bytes = b""
    # The size of a number in positions and orientations: 8 (float64), or 4 (float32) if
    # single_precision was asked for.
    value_bytes: int = 0
    # Positions are relative to this point of the map frame, metres; 0 with float64, so that they
    # are to the bit what GetTrajectory says.
    origin_map: Optional[Vector3] = None
    # 3 numbers a row, metres from origin_map.
    positions: bytes = b""
    # 4 numbers a row, x y z w; NaN = the source gave none. Empty = not asked for, or none is known.
    orientations: bytes = b""
    # uint32, ascending: rows before which the track has a gap.
    gaps: bytes = b""
    # uint8, bits as of TimedPose.flags. Empty = all are 0.
    flags: bytes = b""


@dataclass(frozen=True)
class GetTracksResponse:
    # Set in the first message only, as is tracks.
    header: Optional[ResponseHeader] = None
    # Ascending by id.
    tracks: tuple[TrackHead, ...] = ()
    # About 1 MiB; the tracks one after the other.
    poses: tuple[TrackPoses, ...] = ()


@dataclass(frozen=True)
class GetTimelineRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Half-open. Unset = from the first pose of all tracks, and up to and including the last.
    from_ns: Optional[int] = None
    to_ns: Optional[int] = None
    # Bins of equal length, 1 to 2000; 0 = 200.
    bin_count: int = 0


@dataclass(frozen=True)
class GetTimelineResponse:
    header: Optional[ResponseHeader] = None
    # Ends of the first and the last bin; equal if there are no poses.
    from_ns: int = 0
    to_ns: int = 0
    # Of each bin: agents with a pose in it, or an interpolated one.
    agent_counts: tuple[int, ...] = ()
    # Of each bin: stored poses of all agents.
    pose_counts: tuple[int, ...] = ()


@dataclass(frozen=True)
class ListMeshBlocksRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Only blocks whose cubes touch this box in the map frame. Unset = all.
    box: Optional[Box] = None
    # 1 to 1000; 0 = 100.
    page_size: int = 0
    page_token: str = ""


@dataclass(frozen=True)
class MeshBlockVersion:
    """Which version of a mesh block a revision has."""

    index: Optional[MeshBlockIndex] = None
    # The revision that wrote the block: a reader that has it of this revision need not ask again.
    revision: int = 0


@dataclass(frozen=True)
class ListMeshBlocksResponse:
    header: Optional[ResponseHeader] = None
    # Ascending by x, y, z.
    blocks: tuple[MeshBlockVersion, ...] = ()
    next_page_token: str = ""


@dataclass(frozen=True)
class MeshColumns:
    """A block of a mesh, or a piece of a large one, as columns with a row for each vertex or face.
    See MeshBlock. An empty column of a vertex = none has one, or it was not asked for.
    """

    index: Optional[MeshBlockIndex] = None
    vertex_count: int = 0
    face_count: int = 0
    # 0 = positions are float32, metres, map frame. Else they are uint16, and a vertex is at
    # origin_map + step_m x its numbers, at most half a step from where it is stored on each axis.
    step_m: float = 0.0
    # Metres, map frame; unset with positions of 32 bits.
    origin_map: Optional[Vector3] = None
    # 3 x float32 or 3 x uint16, as step_m says.
    positions: bytes = b""
    # Unit vectors, map frame: 3 x float32, or with positions of 16 bits 3 x int8 in 1/127.
    normals: bytes = b""
    # 3 x uint8: red, green, blue.
    colors: bytes = b""
    # uint32: SemanticLabel.id.
    labels: bytes = b""
    # uint32; 0 = no instance.
    instance_ids: bytes = b""
    # int64: world time of the first observation of each vertex, nanoseconds.
    first_seen_ns: bytes = b""
    # int64: world time of the last observation of each vertex, nanoseconds.
    last_seen_ns: bytes = b""
    # 3 x uint16: rows of the vertices. A piece has at most 20,000 vertices.
    faces: bytes = b""


class Comparison(ProtoEnum):
    """How an attribute is compared with a value."""

    # = EQUAL
    COMPARISON_UNSPECIFIED = "COMPARISON_UNSPECIFIED"
    # The attribute is the value.
    EQUAL = "EQUAL"
    # The attribute exists and is another value.
    NOT_EQUAL = "NOT_EQUAL"
    # The attribute is below the value.
    LESS = "LESS"
    # The attribute is at most the value.
    LESS_OR_EQUAL = "LESS_OR_EQUAL"
    # The attribute is above the value.
    GREATER = "GREATER"
    # The attribute is at least the value.
    GREATER_OR_EQUAL = "GREATER_OR_EQUAL"
    # The attribute exists, with any value.
    EXISTS = "EXISTS"


@dataclass(frozen=True)
class NodePattern:
    """Conditions on a node; all that are set must hold. An empty pattern matches any node."""

    # "object", "human", "place", "room", ... or a custom kind.
    kind: str = ""
    # Name of the layer.
    layer: str = ""
    # Name of the semantic class; case is ignored.
    class_name: str = ""
    # Name of the node; case is ignored and "*" matches any text.
    name: str = ""
    # One of red, orange, yellow, green, cyan, blue, purple, pink, brown, black, grey, white.
    color: str = ""
    attributes: tuple[AttributeCondition, ...] = ()
    relations: tuple[RelationCondition, ...] = ()
    # Exactly this node.
    id: str = ""
    # All of them must hold, as all of the above: "(cup or mug) and not (red or blue)" has two.
    alternatives: tuple[Alternatives, ...] = ()


@dataclass(frozen=True)
class Alternatives:
    """The node matches at least one of these patterns: "or". Each counts as one of the 64
    conditions, and as one of the 8 levels.
    """

    # At least one.
    any_of: tuple[NodePattern, ...] = ()
    # The node matches none of them: "not".
    negated: bool = False


@dataclass(frozen=True)
class AttributeCondition:
    """A node without the attribute, or with a value of another type, fails every comparison."""

    # Name of the attribute, as in Node.attributes.
    name: str = ""
    comparison: Comparison = Comparison.COMPARISON_UNSPECIFIED
    # Numbers compare as numbers and text by its bytes; flags support only EQUAL and NOT_EQUAL.
    value: Optional[AttributeValue] = None


@dataclass(frozen=True)
class RelationCondition:
    """The node has this relation to a node that matches `other`."""

    # A relation of the map (ON, NEAR, ADJACENT, ...), or INSIDE: below the other node in the
    # hierarchy at any depth. IN matches an edge IN as well as INSIDE. Agents are INSIDE the place
    # and the room of their stays (ListPresence), and what is above these, while they stay.
    relation: str = ""
    # The node at the other end.
    other: Optional[NodePattern] = None
    # The edge points from the other node to this one. No effect for ADJACENT, NEAR, CO_VISIBLE,
    # SAME_AS and TRAVERSABLE, which are symmetric: their edges are stored once, in a direction that
    # means nothing.
    reversed: bool = False
    # No such node exists.
    negated: bool = False


@dataclass(frozen=True)
class SearchNodesRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # The query language of docs/search.md: cup and color = red on table in (room "Dining room")
    query: Optional[str] = None
    pattern: Optional[NodePattern] = None
    # The conditions hold at this world time. Agents are found if their tracks hold it, where they
    # were then; in a gap of its track an agent has no pose. Unset = now or at any earlier time; for
    # stays of agents, any time of the revision.
    at_ns: Optional[int] = None
    # Sort by distance from this point to the boxes, then by id; map frame, metres. Unset =
    # ascending id.
    near: Optional[Vector3] = None
    # With `near` only: nodes further away are left out, metres. 0 = no limit.
    max_distance_m: float = 0.0
    # Only nodes whose boxes touch this box; map frame.
    box: Optional[Box] = None
    view: NodeView = NodeView.NODE_VIEW_UNSPECIFIED
    page_size: int = 0
    page_token: str = ""
    # Return the query plan.
    explain: bool = False
    # Return the number of hits and no hits; there are no pages then.
    count_only: bool = False


@dataclass(frozen=True)
class SearchHit:
    """A node that matches."""

    node: Optional[Node] = None
    # Set if the request has `near`.
    distance_m: Optional[float] = None
    # The node's ancestors in the hierarchy, nearest first; of an agent at an instant, the place or
    # room where it stayed then, and what is above it.
    ancestor_ids: tuple[str, ...] = ()
    # For each relation of the pattern, in order, one node that satisfies it; empty if negated.
    # Relations of its alternatives are not among them.
    related_ids: tuple[str, ...] = ()


@dataclass(frozen=True)
class SearchStep:
    """A step of the query plan, in order of execution."""

    # "class index", "name index", "children", "box", "nearest", "filter", "join", ...
    operation: str = ""
    # What the step worked on, in words.
    detail: str = ""
    # Number of input and output nodes; the input is an estimate if the step did not run to its end.
    in_count: int = 0
    out_count: int = 0


@dataclass(frozen=True)
class SearchNodesResponse:
    header: Optional[ResponseHeader] = None
    hits: tuple[SearchHit, ...] = ()
    next_page_token: str = ""
    # Set if requested.
    plan: tuple[SearchStep, ...] = ()
    # The pattern in the query language.
    canonical_query: str = ""
    # With `count_only`: the number of nodes that match.
    hit_count: int = 0


class PlanMode(ProtoEnum):
    """How a path is searched for."""

    # = HIERARCHICAL
    PLAN_MODE_UNSPECIFIED = "PLAN_MODE_UNSPECIFIED"
    # Plans over rooms first and then over the places of rooms that can lead to the goal, guided by
    # precomputed distances. Finds a path whenever one exists, at most 3 % longer than the shortest.
    HIERARCHICAL = "HIERARCHICAL"
    # A* over all places: the shortest path.
    FLAT = "FLAT"


class PredictionModel(ProtoEnum):
    """How the future of an agent is estimated."""

    # = GOALS
    PREDICTION_MODEL_UNSPECIFIED = "PREDICTION_MODEL_UNSPECIFIED"
    # Follows the places to likely goals of people; WEIGHTED_VELOCITY if the map has no places.
    GOALS = "GOALS"
    # Repeats the last step.
    CONSTANT_VELOCITY = "CONSTANT_VELOCITY"
    # Weighted mean of the last steps, later steps weighing more; smoothed and damped more strongly
    # the more the steps zigzag.
    WEIGHTED_VELOCITY = "WEIGHTED_VELOCITY"


@dataclass(frozen=True)
class PathEnd:
    """One end of a path."""

    # Map frame, metres.
    position: Optional[Vector3] = None
    # A place, a node with a place near it, or a unique name. For rooms and higher layers any of
    # their places is accepted. An agent is at its position at the request's at_ns (unset: at the
    # end of its track); if that is obstructed, the path ends near it.
    node: Optional[str] = None
    # The matching node with the shortest path, including the straight line from the last place to
    # its box: "the nearest couch".
    nearest: Optional[NodePattern] = None


@dataclass(frozen=True)
class PlanPathRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Where the path begins.
    from_: Optional[PathEnd] = None
    # Where the path ends.
    to: Optional[PathEnd] = None
    # Places and links with less clearance are not used. 0 = a point.
    robot_radius_m: float = 0.0
    # Places not to use; rooms and other nodes stand for all their places.
    blocked: tuple[str, ...] = ()
    mode: PlanMode = PlanMode.PLAN_MODE_UNSPECIFIED
    # World time of places, links and agents. Unset = now.
    at_ns: Optional[int] = None
    # Sweep a sphere of the robot's radius (at least 5 cm) along the path and report what it
    # touches, ignoring floors and the agents at the ends of the path.
    check_collision: bool = False


@dataclass(frozen=True)
class PlanPathResponse:
    header: Optional[ResponseHeader] = None
    # Places in order.
    place_ids: tuple[str, ...] = ()
    # Rooms in order, one entry each time a room is entered; places without a room are skipped.
    room_ids: tuple[str, ...] = ()
    # From start to end, map frame, metres: the requested positions and the places between them.
    # Within the free space of a single place, the straight line between the positions.
    polyline: tuple[Vector3, ...] = ()
    # Length of the polyline, metres.
    length_m: float = 0.0
    # Smallest clearance of places and links on the path, metres.
    clearance_m_min: float = 0.0
    # The requested node at the start, or the node chosen for `nearest`; empty for a position.
    from_node_id: str = ""
    # The same at the end.
    to_node_id: str = ""
    # Set if requested: the first contact.
    collision: Optional[CollisionResult] = None
    # Number of expanded places.
    expanded_count: int = 0
    # The mode that found the path.
    mode: PlanMode = PlanMode.PLAN_MODE_UNSPECIFIED


@dataclass(frozen=True)
class PlanPathsRequest:
    # The map of all paths, instead of their own `map`.
    map: str = ""
    # The revision for all paths, instead of their own `read_at`.
    read_at: Optional[ReadAt] = None
    # At most 1000.
    paths: tuple[PlanPathRequest, ...] = ()


@dataclass(frozen=True)
class PlanPathResult:
    """The answer to one path, or its error."""

    # 0 = answered; otherwise the gRPC status code of this path.
    status_code: int = 0
    status_message: str = ""
    # Unset if the path has an error.
    path: Optional[PlanPathResponse] = None


@dataclass(frozen=True)
class PlanPathsResponse:
    header: Optional[ResponseHeader] = None
    # In the order of the request; only this message has a header.
    results: tuple[PlanPathResult, ...] = ()


@dataclass(frozen=True)
class Sphere:
    """A sphere around the pose."""

    # Metres, above 0.
    radius_m: float = 0.0


@dataclass(frozen=True)
class Cuboid:
    """A box that turns with the pose."""

    # Edge lengths, metres; the centre is at the pose.
    size: Optional[Vector3] = None


@dataclass(frozen=True)
class Capsule:
    """A cylinder with half spheres at its ends."""

    # Of the cylinder and the half spheres, metres, above 0.
    radius_m: float = 0.0
    # Length of the axis between the centres of both half spheres, along z of the pose.
    length_m: float = 0.0


@dataclass(frozen=True)
class TriangleMesh:
    """A triangle mesh with at most 10,000 faces and 30,000 vertices. It is a surface: something
    entirely inside does not touch it.
    """

    # x y z interleaved, metres, in the frame of the body.
    vertices: tuple[float, ...] = ()
    # Indices of vertices, three per face.
    faces: tuple[int, ...] = ()


@dataclass(frozen=True)
class CollisionBody:
    """A shape that stands or moves."""

    sphere: Optional[Sphere] = None
    cuboid: Optional[Cuboid] = None
    capsule: Optional[Capsule] = None
    mesh: Optional[TriangleMesh] = None
    # map_T_body. With several poses, the body moves along straight lines from one to the next with
    # interpolated orientation. At most 1000 poses and 100 km. An unset orientation is the identity.
    poses: tuple[Pose, ...] = ()


@dataclass(frozen=True)
class CollisionScope:
    """Obstacles to consider. If none of the first five is set: all except predicted agents."""

    # Objects, as their boxes, each in its own frame; as their triangles instead if the mesh has
    # triangles with their instance id.
    objects: bool = False
    # Structures, as their triangles in the mesh (by instance id, or within 10 cm of plane and box
    # and facing it) if there are any, because boxes of walls also cover doors. Otherwise as their
    # boxes, or as the intersection of plane and box if the plane crosses the box. One triangle is
    # enough: a partly observed wall is solid only where it was observed.
    structures: bool = False
    # Triangles of the map's mesh, of any size, except those of objects that did not exist at at_ns.
    # The first such query on a map reads its whole mesh.
    mesh: bool = False
    # Agents at their positions at at_ns, as upright capsules of 0.3 m radius and 1.7 m height
    # around their poses unless their box gives other sizes; not agents in a gap. Without at_ns: at
    # their last poses, if these are no older than their gap limit relative to the newest pose of
    # all agents.
    agents: bool = False
    # Agents at their predicted positions at at_ns, which must be set, after the end of their tracks
    # and at most 10 s later: predicted with WEIGHTED_VELOCITY, enlarged by two standard deviations,
    # and not stopped by walls. For predictions with GOALS use PredictAgent.
    predicted_agents: bool = False
    # Nodes to ignore with everything below them: ids or names, at most 1000. A robot that is in the
    # map should list itself.
    ignored: tuple[str, ...] = ()
    # Ignore structures that are floors, and triangles on them. Set it to sweep wheels.
    ignore_floor: bool = False


@dataclass(frozen=True)
class CheckCollisionRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # At most 1000 bodies with 10,000 poses in total.
    bodies: tuple[CollisionBody, ...] = ()
    scope: Optional[CollisionScope] = None
    # World time. Unset = now.
    at_ns: Optional[int] = None
    # A distance up to this counts as a hit, metres. Below 100.
    margin_m: float = 0.0
    # Clearances are computed up to this distance, metres: more than the margin and at most 100. 0 =
    # 2 m, or twice the margin. A smaller value is faster.
    clearance_m_max: float = 0.0


@dataclass(frozen=True)
class CollisionResult:
    """Exact up to rounding of doubles for bodies at rest and for moving spheres. Other moving
    bodies are sampled: no contact deeper than 0.1 mm is missed, and the clearance may be too large
    by up to 5 mm or 5 %, whichever is more.
    """

    # The body comes as near to an obstacle as the margin.
    hit: bool = False
    # Smallest distance to an obstacle on the whole path, or at the first hit, metres; at most
    # clearance_m_max; 0 if touching.
    clearance_m: float = 0.0
    # The obstacle that was hit first, otherwise the nearest; the lowest id of equals. A node id, or
    # empty for the mesh alone or for nothing.
    node_id: str = ""
    # "object", "structure", "mesh", "agent" or "predicted_agent"; empty if nothing is in reach.
    what: str = ""
    # Point on the obstacle, map frame.
    point: Optional[Vector3] = None
    # With several poses: position on the path as the index of the pose before, plus a fraction.
    at_pose: float = 0.0
    # True if the map has information around the whole body along the path up to a hit: a mesh
    # block, a place whose clearance covers it, or a triangle, object or structure within 1 m.
    # Checked every half metre: for spheres at the centre and the ends of the diameters, for other
    # bodies at the corners of their box and points between them, 1 m apart and at most 8 along an
    # edge. If false, the absence of a hit proves nothing.
    observed: bool = False


@dataclass(frozen=True)
class CheckCollisionResponse:
    header: Optional[ResponseHeader] = None
    # In the order of the bodies.
    results: tuple[CollisionResult, ...] = ()


@dataclass(frozen=True)
class PredictAgentRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    agent: str = ""
    # Data after this time is ignored. Unset = the end of the track.
    from_ns: Optional[int] = None
    # At least one period, at most 1000 periods and one day. 0 = 4.8 s.
    horizon_ns: int = 0
    # At least 1 ms. 0 = 0.4 s.
    period_ns: int = 0
    model: PredictionModel = PredictionModel.PREDICTION_MODEL_UNSPECIFIED
    # 1 to 20. 0 = 6.
    path_count_max: int = 0
    # Cut the paths of the velocity models where they would cross a wall.
    stop_at_walls: bool = False


@dataclass(frozen=True)
class PredictedPose:
    """Where an agent is expected at one time."""

    time_ns: int = 0
    # Map frame, metres.
    position: Optional[Vector3] = None
    # Covariance of the position: upper triangle row by row, square metres.
    covariance: tuple[float, ...] = ()


@dataclass(frozen=True)
class PredictedPath:
    """One way on which an agent may go."""

    probability: float = 0.0
    # The node that the path leads to; empty for the velocity models.
    goal_node_id: str = ""
    poses: tuple[PredictedPose, ...] = ()


@dataclass(frozen=True)
class PredictAgentResponse:
    header: Optional[ResponseHeader] = None
    agent_id: str = ""
    # Time of the last pose used.
    observed_ns: int = 0
    # Smoothed velocity, m/s.
    velocity: Optional[Vector3] = None
    # Descending probability.
    paths: tuple[PredictedPath, ...] = ()
    # The model used; GOALS falls back to WEIGHTED_VELOCITY if there are no places.
    model: PredictionModel = PredictionModel.PREDICTION_MODEL_UNSPECIFIED


class MeshChannel(ProtoEnum):
    """What a mesh says of its vertices."""

    MESH_CHANNEL_UNSPECIFIED = "MESH_CHANNEL_UNSPECIFIED"
    # Nothing: with this one alone, positions and faces.
    MESH_CHANNEL_NONE = "MESH_CHANNEL_NONE"
    # Unit normals, map frame.
    MESH_CHANNEL_NORMALS = "MESH_CHANNEL_NORMALS"
    # Colours, 0xRRGGBB.
    MESH_CHANNEL_COLORS = "MESH_CHANNEL_COLORS"
    # Numbers of semantic classes.
    MESH_CHANNEL_LABELS = "MESH_CHANNEL_LABELS"
    # Numbers of the objects and structures that vertices belong to.
    MESH_CHANNEL_INSTANCES = "MESH_CHANNEL_INSTANCES"
    # When vertices were seen first and last.
    MESH_CHANNEL_TIMES = "MESH_CHANNEL_TIMES"


class MeshEncoding(ProtoEnum):
    """How blocks of a mesh are sent."""

    MESH_ENCODING_UNSPECIFIED = "MESH_ENCODING_UNSPECIFIED"
    # MeshBlock: every number as it is stored.
    MESH_ENCODING_FIELDS = "MESH_ENCODING_FIELDS"
    # MeshColumns: the same numbers, as columns that can be used in place.
    MESH_ENCODING_COLUMNS = "MESH_ENCODING_COLUMNS"
    # MeshColumns in fewer bytes: positions of 16 bits, normals of 8. For pictures.
    MESH_ENCODING_COARSE_COLUMNS = "MESH_ENCODING_COARSE_COLUMNS"


class ShapePart(ProtoEnum):
    """Parts of a body's shape."""

    SHAPE_PART_UNSPECIFIED = "SHAPE_PART_UNSPECIFIED"
    # Pose and shape coefficients.
    SHAPE_PART_COEFFICIENTS = "SHAPE_PART_COEFFICIENTS"
    # Positions of the joints.
    SHAPE_PART_JOINTS = "SHAPE_PART_JOINTS"
    # Positions of the vertices.
    SHAPE_PART_VERTICES = "SHAPE_PART_VERTICES"
    # The assets with the faces between the vertices.
    SHAPE_PART_TOPOLOGY = "SHAPE_PART_TOPOLOGY"


class WordType(ProtoEnum):
    """What a word names."""

    WORD_TYPE_UNSPECIFIED = "WORD_TYPE_UNSPECIFIED"
    # A kind of nodes: "human", "room".
    WORD_TYPE_KIND = "WORD_TYPE_KIND"
    # A semantic class: "chair".
    WORD_TYPE_CLASS = "WORD_TYPE_CLASS"
    # A relation of edges: "ON".
    WORD_TYPE_RELATION = "WORD_TYPE_RELATION"


@dataclass(frozen=True)
class LocateAgentRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # A node id ("H12") or the name that the log gave ("12").
    agent: str = ""
    # World time of the pose. Required: left out, it is refused with FIELD_INVALID.
    at_ns: Optional[int] = None


@dataclass(frozen=True)
class LocateAgentResponse(Located):
    header: Optional[ResponseHeader] = None
    agent_id: str = ""
    agent_name: str = ""
    # That of the request.
    at_ns: int = 0
    # map_T_agent. Unset if quality is IN_GAP.
    pose: Optional[Pose] = None
    quality: PoseQuality = PoseQuality.POSE_QUALITY_UNSPECIFIED
    # World time of the stored pose at or before at_ns.
    before_ns: int = 0
    # World time of the stored pose at or after at_ns; equal to before_ns if EXACT.
    after_ns: int = 0
    # Place, room and building of the agent at that time; empty if unknown.
    place_id: str = ""
    room_id: str = ""
    building_id: str = ""
    # All ancestors of the place or room, nearest first, including custom layers.
    ancestor_ids: tuple[str, ...] = ()
    # 21 numbers, see TimedPose; empty if the log gave none. When interpolated, the covariance of
    # the nearer pose.
    covariance: tuple[float, ...] = ()
    # True if the source gave positions only; the orientation is then meaningless.
    orientation_unknown: bool = False


@dataclass(frozen=True)
class AgentInstant:
    """One question of a batch: where an agent is at a time."""

    agent: str = ""
    # World time of the pose. Required, as in LocateAgentRequest.
    at_ns: Optional[int] = None


@dataclass(frozen=True)
class BatchLocateAgentsRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # At most 10,000.
    instants: tuple[AgentInstant, ...] = ()


@dataclass(frozen=True)
class LocateResult:
    """The answer to one of them, or its error; see LocateAgentResponse."""

    # 0 = answered; otherwise the gRPC status code of this pair.
    status_code: int = 0
    status_message: str = ""
    agent_id: str = ""
    pose: Optional[Pose] = None
    quality: PoseQuality = PoseQuality.POSE_QUALITY_UNSPECIFIED
    place_id: str = ""
    room_id: str = ""


@dataclass(frozen=True)
class BatchLocateAgentsResponse:
    header: Optional[ResponseHeader] = None
    # In the order of the request.
    results: tuple[LocateResult, ...] = ()


@dataclass(frozen=True)
class GetTrajectoryRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    agent: str = ""
    # Half-open. Unset = from the first pose, and up to and including the last.
    from_ns: Optional[int] = None
    to_ns: Optional[int] = None
    # If set (at least 1 ms): poses interpolated at this period, starting at from_ns; none inside
    # gaps.
    resample_period_ns: int = 0


@dataclass(frozen=True)
class GetTrajectoryResponse:
    # Set in the first message only.
    header: Optional[ResponseHeader] = None
    agent_id: str = ""
    poses: tuple[TimedPose, ...] = ()


@dataclass(frozen=True)
class ListPresenceRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # A room, a place, or a node of a layer above rooms (all rooms below it).
    node_id: Optional[str] = None
    # A box in the map frame; presence is by interpolated position, without gaps.
    box: Optional[Box] = None
    from_ns: int = 0
    to_ns: int = 0
    # 1 to 1000; 0 = 100.
    page_size: int = 0
    page_token: str = ""


@dataclass(frozen=True)
class PresenceInterval:
    """An interval in which one agent was there without a break."""

    agent_id: str = ""
    agent_name: str = ""
    # World time from which it is there, clipped to the requested interval.
    enter_ns: int = 0
    # World time from which it is there no more, clipped likewise.
    exit_ns: int = 0
    # The room or place of the stay; empty for a box.
    node_id: str = ""


@dataclass(frozen=True)
class ListPresenceResponse:
    header: Optional[ResponseHeader] = None
    # Ascending by enter_ns, then agent id.
    intervals: tuple[PresenceInterval, ...] = ()
    next_page_token: str = ""
    # Number of agents that were observed within the interval. Only for these, absence from
    # `intervals` is evidence of absence.
    observed_agent_count: int = 0


@dataclass(frozen=True)
class GetNodeRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # A node id, or a name that is unique in the map.
    id: str = ""
    view: NodeView = NodeView.NODE_VIEW_UNSPECIFIED


@dataclass(frozen=True)
class GetNodeResponse:
    header: Optional[ResponseHeader] = None
    node: Optional[Node] = None
    # The node's ancestors in the hierarchy, nearest first.
    ancestor_ids: tuple[str, ...] = ()
    child_count: int = 0
    # For agents: world time of the first pose of the track.
    first_pose_ns: int = 0
    # For agents: world time of the last pose of the track.
    last_pose_ns: int = 0
    pose_count: int = 0


@dataclass(frozen=True)
class ListNodesRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    filter: Optional[NodeFilter] = None
    view: NodeView = NodeView.NODE_VIEW_UNSPECIFIED
    page_size: int = 0
    page_token: str = ""


@dataclass(frozen=True)
class ListNodesResponse:
    header: Optional[ResponseHeader] = None
    nodes: tuple[Node, ...] = ()
    next_page_token: str = ""


@dataclass(frozen=True)
class ListEdgesRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Only edges from this node, by id or unique name. Empty = any.
    source: str = ""
    # Only edges of this relation. Empty = any.
    relation: str = ""
    # Only edges to this node, by id or unique name. Empty = any.
    target: str = ""
    # Only edges that are valid at this world time. Unset = at any.
    at_ns: Optional[int] = None
    page_size: int = 0
    page_token: str = ""


@dataclass(frozen=True)
class ListEdgesResponse:
    header: Optional[ResponseHeader] = None
    edges: tuple[Edge, ...] = ()
    next_page_token: str = ""


@dataclass(frozen=True)
class ListNearestNodesRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Map frame, metres.
    position: Optional[Vector3] = None
    # 1 to 1000; 0 = 1.
    k: int = 0
    # layer, kind, class_name and at_ns are used. Agents are found only if layer or kind selects
    # them and at_ns is given; their positions are those at at_ns.
    filter: Optional[NodeFilter] = None
    # Nodes further away are left out, metres. 0 = no limit.
    max_distance_m: float = 0.0
    view: NodeView = NodeView.NODE_VIEW_UNSPECIFIED


@dataclass(frozen=True)
class NearestNode:
    """A node with its distance."""

    node: Optional[Node] = None
    # Distance from the point to the node's box (to its position if it has none); 0 inside. Metres.
    distance_m: float = 0.0


@dataclass(frozen=True)
class ListNearestNodesResponse:
    header: Optional[ResponseHeader] = None
    nodes: tuple[NearestNode, ...] = ()


@dataclass(frozen=True)
class GetMeshRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Only blocks whose cubes touch this box in the map frame. Unset = the whole mesh.
    box: Optional[Box] = None
    # Only the faces of this object, structure, room or region, by id or unique name: by its
    # instance id, else by where they lie (docs/query_semantics.md). Empty = all.
    node: str = ""
    # Only these blocks; one that is not there is left out. Empty = all. See ListMeshBlocks.
    blocks: tuple[MeshBlockIndex, ...] = ()
    # A coarser mesh: all vertices of a block within a cube of this edge length, metres, become one,
    # and faces that lose an edge by it are left out. 0 = the mesh as it is stored.
    cell_m: float = 0.0
    # What to send beside positions and faces. Empty = everything.
    channels: tuple[MeshChannel, ...] = ()
    # Unset = blocks of numbers in fields.
    encoding: MeshEncoding = MeshEncoding.MESH_ENCODING_UNSPECIFIED


@dataclass(frozen=True)
class GetMeshResponse:
    # Set in the first message only, which is also sent if there is no mesh.
    header: Optional[ResponseHeader] = None
    # Whole blocks, or what a node has of them, about 1 MiB per message. A block that is too large
    # for one message comes in pieces with the same index, each with the vertices that its faces
    # need.
    blocks: tuple[MeshBlock, ...] = ()
    # The same instead of `blocks`, if the request asks for columns.
    columns: tuple[MeshColumns, ...] = ()


@dataclass(frozen=True)
class GetAgentShapeRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # A node id ("H12") or the name that the log gave ("12").
    agent: str = ""
    # Half-open. Unset = from the first shape, and up to and including the last.
    from_ns: Optional[int] = None
    to_ns: Optional[int] = None
    # What to send; empty = everything.
    parts: tuple[ShapePart, ...] = ()


@dataclass(frozen=True)
class AgentShape:
    """One shape of an agent's body, and where the agent was."""

    # Vertices and joints are in the frame of the agent.
    shape: Optional[BodyShape] = None
    # map_T_agent at the shape's time. Unset in a gap or outside of the track.
    pose: Optional[Pose] = None
    # Unspecified outside of the track.
    quality: PoseQuality = PoseQuality.POSE_QUALITY_UNSPECIFIED
    # Number of stored vertices, whether requested or not.
    vertex_count: int = 0
    # SHA-256 of the asset with the faces, 32 bytes; may be empty.
    topology_sha256: bytes = b""


@dataclass(frozen=True)
class GetAgentShapeResponse:
    # Set in the first message only, which is also sent if there is no shape.
    header: Optional[ResponseHeader] = None
    agent_id: str = ""
    shapes: tuple[AgentShape, ...] = ()
    # Each is sent once, before the first shape that refers to it, in a message without shapes.
    topologies: tuple[Asset, ...] = ()


@dataclass(frozen=True)
class ListFactorsRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # A node id ("r0") or the name that the log gave ("body").
    agent: str = ""
    # Factors with from_ns <= from_time_ns < to_ns. Unset = from the first, and up to and including
    # the last.
    from_ns: Optional[int] = None
    to_ns: Optional[int] = None


@dataclass(frozen=True)
class ListFactorsResponse:
    # Set in the first message only, which is also sent if there is no factor.
    header: Optional[ResponseHeader] = None
    agent_id: str = ""
    # Ascending by from_time_ns. See PoseFactor for relative_pose and information.
    factors: tuple[PoseFactor, ...] = ()


@dataclass(frozen=True)
class GetAssetRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # SHA-256 of the content, 32 bytes.
    sha256: bytes = b""


@dataclass(frozen=True)
class GetAssetResponse:
    # Set in the first message only, as are media_type and size_bytes.
    header: Optional[ResponseHeader] = None
    # "model/ply", "model/obj", "application/x-topology", ...
    media_type: str = ""
    # Size of the whole content.
    size_bytes: int = 0
    # At most 1 MiB. The contents of all messages in order are the asset.
    content: bytes = b""


@dataclass(frozen=True)
class BatchGetNodesRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # At most 1000, each a node id or a name that is unique in the map.
    ids: tuple[str, ...] = ()
    view: NodeView = NodeView.NODE_VIEW_UNSPECIFIED


@dataclass(frozen=True)
class GetNodeResult:
    """One node of a batch, or its error."""

    # 0 = found; otherwise the gRPC status code of this node.
    status_code: int = 0
    status_message: str = ""
    node: Optional[Node] = None


@dataclass(frozen=True)
class BatchGetNodesResponse:
    header: Optional[ResponseHeader] = None
    results: tuple[GetNodeResult, ...] = ()


@dataclass(frozen=True)
class GetNeighborsRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # A node id, or a name that is unique in the map.
    id: str = ""
    # Empty = all.
    relations: tuple[str, ...] = ()
    # Edges from the node. If neither this nor `incoming` is set, both are sent.
    outgoing: bool = False
    # Edges to the node.
    incoming: bool = False
    # Only edges and neighbours that were valid at this time. Unset = of any time.
    at_ns: Optional[int] = None
    view: NodeView = NodeView.NODE_VIEW_UNSPECIFIED
    page_size: int = 0
    page_token: str = ""


@dataclass(frozen=True)
class Neighbor:
    """An edge of the node, with what it leads to."""

    edge: Optional[Edge] = None
    # The node at the other end of the edge.
    node: Optional[Node] = None


@dataclass(frozen=True)
class GetNeighborsResponse:
    header: Optional[ResponseHeader] = None
    # Outgoing before incoming, then by relation, then by the other end's id.
    neighbors: tuple[Neighbor, ...] = ()
    next_page_token: str = ""


@dataclass(frozen=True)
class GetSubgraphRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Node id, or a name that is unique in the map.
    root: str = ""
    # Relations to follow in their direction. Empty = CONTAINS.
    relations: tuple[str, ...] = ()
    # Follow them in both directions.
    both_directions: bool = False
    # Largest number of edges from the root. 0 = no limit.
    depth_max: int = 0
    # layer, kind, class_name, box and at_ns may be set. Nodes that do not match are neither sent
    # nor traversed. The root is always sent. With at_ns agents are where their tracks put them;
    # without a pose in a gap of the track.
    filter: Optional[NodeFilter] = None
    view: NodeView = NodeView.NODE_VIEW_UNSPECIFIED
    # Send only the traversed edges instead of all edges between the nodes.
    tree_only: bool = False


@dataclass(frozen=True)
class GetSubgraphResponse:
    # Set in the first message only.
    header: Optional[ResponseHeader] = None
    # Ascending by distance from the root in edges, then id.
    nodes: tuple[Node, ...] = ()
    # Ascending by source, relation, target; sent after the last node.
    edges: tuple[Edge, ...] = ()


@dataclass(frozen=True)
class BatchGetShapesRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # Node ids ("H12") or the names that the log gave ("12"), at most 10,000. Empty = all agents.
    agents: tuple[str, ...] = ()
    # World time, nanoseconds. Required: left out, it is refused with FIELD_INVALID.
    at_ns: Optional[int] = None
    # What to send; empty = everything.
    parts: tuple[ShapePart, ...] = ()


@dataclass(frozen=True)
class ShapeOfAgent:
    """The body of one of many agents."""

    agent_id: str = ""
    # The stored shape that is nearest in time, at most the gap limit of the track away. `pose` is
    # that at at_ns.
    shape: Optional[AgentShape] = None


@dataclass(frozen=True)
class BatchGetShapesResponse:
    # Set in the first message only, which is also sent if no agent has a shape then.
    header: Optional[ResponseHeader] = None
    # Ascending by id. An agent without a shape near at_ns, or that was not there then, is left out.
    shapes: tuple[ShapeOfAgent, ...] = ()
    # Each is sent once, before the first shape that refers to it, in a message without shapes.
    topologies: tuple[Asset, ...] = ()


@dataclass(frozen=True)
class ListNodeVersionsRequest:
    map: str = ""
    # A node id. Names change from version to version.
    id: str = ""
    view: NodeView = NodeView.NODE_VIEW_UNSPECIFIED
    # 1 to 1000; 0 = 100.
    page_size: int = 0
    page_token: str = ""


@dataclass(frozen=True)
class NodeVersion:
    """What a stretch of revisions says of a node."""

    # The version was believed from this revision on, up to and without to_revision.
    from_revision: int = 0
    # Unset = it is believed still.
    to_revision: Optional[int] = None
    node: Optional[Node] = None


@dataclass(frozen=True)
class ListNodeVersionsResponse:
    # read_revision is the newest revision.
    header: Optional[ResponseHeader] = None
    # Newest first. Between two that do not meet the node was not in the map.
    versions: tuple[NodeVersion, ...] = ()
    next_page_token: str = ""


@dataclass(frozen=True)
class ListVocabularyRequest:
    map: str = ""
    read_at: Optional[ReadAt] = None
    # 1 to 1000; 0 = 100.
    page_size: int = 0
    page_token: str = ""


@dataclass(frozen=True)
class Word:
    """A word that a search can use."""

    type: WordType = WordType.WORD_TYPE_UNSPECIFIED
    # Of kinds and classes: the layer of the nodes that are counted. Empty for relations.
    layer: str = ""
    # As a query has it: "chair", "ON".
    text: str = ""
    # Nodes of the kind or class, edges of the relation.
    count: int = 0


@dataclass(frozen=True)
class ListVocabularyResponse:
    header: Optional[ResponseHeader] = None
    # Ascending by type, layer, text.
    words: tuple[Word, ...] = ()
    next_page_token: str = ""


class Api(Caller):
    """Every RPC of the server. A timeout is the deadline of the call, seconds; None = the default
    of the connection. Errors are raised as `dsgdb.Error`; a stream raises them where it ends.
    """

    def commit(self, request: CommitRequest,
               timeout: Optional[float] = None) -> CommitResponse:
        """Applies one delta in one transaction and answers when it is on disk. Idempotent by
        (session_id, sequence): a repeated delta with the same content gets the first answer.
        Errors: INVALID_ARGUMENT/DELTA_INVALID naming the part; ABORTED/PARENT_REVISION_STALE;
        ALREADY_EXISTS/SEQUENCE_REUSED if different content was committed with this session and
        sequence; ABORTED/SEQUENCE_GAP; UNAVAILABLE/WRITER_LOCKED if another process writes the map.
        """
        return self._unary("dsg.v1.IngestService/Commit", request, CommitResponse, timeout,
                           reads=False)

    def get_session(self, request: GetSessionRequest,
                    timeout: Optional[float] = None) -> GetSessionResponse:
        """The state of a session, so that an interrupted ingestion can continue."""
        return self._unary("dsg.v1.IngestService/GetSession", request, GetSessionResponse, timeout,
                           reads=True)

    def prune(self, request: PruneRequest,
              timeout: Optional[float] = None) -> Iterator[PruneResponse]:
        """Removes what the policies match. Errors: NOT_FOUND/NODE_UNKNOWN, LAYER_UNKNOWN;
        INVALID_ARGUMENT/FIELD_INVALID; FAILED_PRECONDITION/POLICY_MATCHES_ALL unless
        `allow_everything`, POLICY_TAKES_TOO_MUCH above `share_max`.
        """
        return self._stream("dsg.v1.MaintenanceService/Prune", request, PruneResponse, timeout,
                            reads=False, lifetime="work")

    def compact(self, request: CompactRequest,
                timeout: Optional[float] = None) -> Iterator[CompactResponse]:
        """Makes old revisions unreadable, deletes the rows that only they show, and returns the
        space to the file system. Errors: OUT_OF_RANGE/REVISION_IN_FUTURE, REVISION_COMPACTED.
        """
        return self._stream("dsg.v1.MaintenanceService/Compact", request, CompactResponse, timeout,
                            reads=False, lifetime="work")

    def revert(self, request: RevertRequest,
               timeout: Optional[float] = None) -> Iterator[RevertResponse]:
        """Restores the content of an earlier revision, as new revisions. If other clients write
        meanwhile, their changes before the last of these revisions are undone and later changes are
        kept. Errors: those of Compact; NOT_FOUND/TAG_UNKNOWN.
        """
        return self._stream("dsg.v1.MaintenanceService/Revert", request, RevertResponse, timeout,
                            reads=False, lifetime="work")

    def merge_maps(self, request: MergeMapsRequest,
                   timeout: Optional[float] = None) -> Iterator[MergeMapsResponse]:
        """Merges another map of the same store into this one. Errors:
        INVALID_ARGUMENT/FIELD_INVALID if a map is merged with itself, if the transform is not
        finite and rigid or tilts z by more than 0.1 rad, or if the merged map would reach more than
        2,000 km from the origin; FAILED_PRECONDITION/FRAMES_INCOMPATIBLE;
        OUT_OF_RANGE/TIME_OUTSIDE_MAP for tracks too far from the map's epoch;
        NOT_FOUND/NO_REGISTRATION if no transform was given and none can be estimated;
        ABORTED/PARENT_REVISION_STALE if another client also writes a track that the merge extends.
        """
        return self._stream("dsg.v1.MaintenanceService/MergeMaps", request, MergeMapsResponse,
                            timeout, reads=False, lifetime="work")

    def set_tag(self, request: SetTagRequest,
                timeout: Optional[float] = None) -> SetTagResponse:
        """Names a revision; an existing tag moves. Errors: those of Compact;
        INVALID_ARGUMENT/FIELD_INVALID; RESOURCE_EXHAUSTED/QUOTA_EXCEEDED if the map has 10,000 tags
        or 2 MiB of notes.
        """
        return self._unary("dsg.v1.MaintenanceService/SetTag", request, SetTagResponse, timeout,
                           reads=False)

    def remove_tag(self, request: RemoveTagRequest,
                   timeout: Optional[float] = None) -> RemoveTagResponse:
        """Removes a tag but not its revision. Errors: NOT_FOUND/TAG_UNKNOWN."""
        return self._unary("dsg.v1.MaintenanceService/RemoveTag", request, RemoveTagResponse,
                           timeout, reads=False)

    def list_tags(self, request: ListTagsRequest,
                  timeout: Optional[float] = None) -> ListTagsResponse:
        """All tags of a map, ascending by name."""
        return self._unary("dsg.v1.MaintenanceService/ListTags", request, ListTagsResponse, timeout,
                           reads=True)

    def read_archive(self, request: ReadArchiveRequest,
                     timeout: Optional[float] = None) -> Iterator[ReadArchiveResponse]:
        """The whole map with its history, as an archive file for `dsg restore`, in pieces in order.
        A consistent copy of the newest revision even while other clients write.
        Errors: RESOURCE_EXHAUSTED/DISK_FULL if there is no space for that copy, OVERLOADED if too
        many archives are being read or the reader took nothing of this one for a minute;
        ABORTED/MAP_REPLACED if an erasure changed the map meanwhile.
        """
        return self._stream("dsg.v1.MaintenanceService/ReadArchive", request, ReadArchiveResponse,
                            timeout, reads=True, lifetime="work")

    def drop_map(self, request: DropMapRequest,
                 timeout: Optional[float] = None) -> DropMapResponse:
        """Removes a map with its history, its tags and all its files, in one step: it is there
        whole or not at all. Backups stay. Calls that read the map end with NOT_FOUND/MAP_UNKNOWN or
        ABORTED/MAP_REPLACED, watches with ABORTED/MAP_REPLACED. A map that cannot be read is
        removed too, unless the request expects something of it. Errors:
        ABORTED/PARENT_REVISION_STALE or MAP_REPLACED if the map is not what the request expects,
        with nothing changed.
        """
        return self._unary("dsg.v1.MaintenanceService/DropMap", request, DropMapResponse, timeout,
                           reads=False)

    def rename_map(self, request: RenameMapRequest,
                   timeout: Optional[float] = None) -> RenameMapResponse:
        """Gives a map another name, in one step. History, tags and incarnation stay; the old name
        is free. Calls that read the map under the old name end as those of DropMap, and so do
        sessions that still write under it. Errors: ALREADY_EXISTS/MAP_EXISTS;
        INVALID_ARGUMENT/MAP_NAME_INVALID.
        """
        return self._unary("dsg.v1.MaintenanceService/RenameMap", request, RenameMapResponse,
                           timeout, reads=False)

    def create_map(self, request: CreateMapRequest,
                   timeout: Optional[float] = None) -> CreateMapResponse:
        """Creates an empty map. Errors: ALREADY_EXISTS/MAP_EXISTS;
        INVALID_ARGUMENT/MAP_NAME_INVALID.
        """
        return self._unary("dsg.v1.MapService/CreateMap", request, CreateMapResponse, timeout,
                           reads=False)

    def list_maps(self, request: ListMapsRequest,
                  timeout: Optional[float] = None) -> ListMapsResponse:
        """All maps of the store."""
        return self._unary("dsg.v1.MapService/ListMaps", request, ListMapsResponse, timeout,
                           reads=True)

    def get_map_stats(self, request: GetMapStatsRequest,
                      timeout: Optional[float] = None) -> GetMapStatsResponse:
        """Statistics of a map at a revision. Errors: NOT_FOUND/MAP_UNKNOWN."""
        return self._unary("dsg.v1.MapService/GetMapStats", request, GetMapStatsResponse, timeout,
                           reads=True)

    def list_revisions(self, request: ListRevisionsRequest,
                       timeout: Optional[float] = None) -> ListRevisionsResponse:
        """Revisions, newest first."""
        return self._unary("dsg.v1.MapService/ListRevisions", request, ListRevisionsResponse,
                           timeout, reads=True)

    def diff_revisions(self, request: DiffRevisionsRequest,
                       timeout: Optional[float] = None) -> DiffRevisionsResponse:
        """Differences between two revisions: nodes, then edges, tracks and mesh blocks. Errors:
        OUT_OF_RANGE/REVISION_IN_FUTURE, REVISION_COMPACTED; INVALID_ARGUMENT/FIELD_INVALID.
        """
        return self._unary("dsg.v1.MapService/DiffRevisions", request, DiffRevisionsResponse,
                           timeout, reads=True)

    def watch_map(self, request: WatchMapRequest,
                  timeout: Optional[float] = None) -> Iterator[WatchMapResponse]:
        """Each new revision when it is committed, starting after the one that the caller names. The
        first message comes at once. The stream ends only with the call, and has no deadline unless
        the caller sets one.
        Errors: OUT_OF_RANGE/REVISION_IN_FUTURE, REVISION_COMPACTED with the revision to start from;
        ABORTED if the map was replaced; UNAVAILABLE/SHUTTING_DOWN; RESOURCE_EXHAUSTED/OVERLOADED.
        """
        return self._stream("dsg.v1.MapService/WatchMap", request, WatchMapResponse, timeout,
                            reads=True, lifetime="watch")

    def get_server_info(self, request: GetServerInfoRequest,
                        timeout: Optional[float] = None) -> GetServerInfoResponse:
        """Version of the server; reads no map. The baseline for the latency of other calls."""
        return self._unary("dsg.v1.MapService/GetServerInfo", request, GetServerInfoResponse,
                           timeout, reads=True)

    def locate_agent(self, request: LocateAgentRequest,
                     timeout: Optional[float] = None) -> LocateAgentResponse:
        """Pose of an agent at a time, interpolated and never extrapolated.
        Errors: NOT_FOUND/AGENT_UNKNOWN; OUT_OF_RANGE/TIME_OUTSIDE_TRACK with both ends of the
        track.
        """
        return self._unary("dsg.v1.QueryService/LocateAgent", request, LocateAgentResponse, timeout,
                           reads=True)

    def batch_locate_agents(self, request: BatchLocateAgentsRequest,
                            timeout: Optional[float] = None) -> BatchLocateAgentsResponse:
        """Batch form of LocateAgent for up to 10,000 pairs of agent and time. A pair that fails
        carries its own error; the others are answered.
        """
        return self._unary("dsg.v1.QueryService/BatchLocateAgents", request,
                           BatchLocateAgentsResponse, timeout, reads=True)

    def get_trajectory(self, request: GetTrajectoryRequest,
                       timeout: Optional[float] = None) -> Iterator[GetTrajectoryResponse]:
        """The poses of one agent over an interval, at most 1000 per message."""
        return self._stream("dsg.v1.QueryService/GetTrajectory", request, GetTrajectoryResponse,
                            timeout, reads=True, lifetime="answer")

    def list_presence(self, request: ListPresenceRequest,
                      timeout: Optional[float] = None) -> ListPresenceResponse:
        """Which agents were in a room, a place, a region or a box during an interval."""
        return self._unary("dsg.v1.QueryService/ListPresence", request, ListPresenceResponse,
                           timeout, reads=True)

    def get_node(self, request: GetNodeRequest,
                 timeout: Optional[float] = None) -> GetNodeResponse:
        """One node by id, or by a name that is unique in the map.
        Errors: NOT_FOUND/NODE_UNKNOWN.
        """
        return self._unary("dsg.v1.QueryService/GetNode", request, GetNodeResponse, timeout,
                           reads=True)

    def list_nodes(self, request: ListNodesRequest,
                   timeout: Optional[float] = None) -> ListNodesResponse:
        """Nodes in ascending order of id."""
        return self._unary("dsg.v1.QueryService/ListNodes", request, ListNodesResponse, timeout,
                           reads=True)

    def list_edges(self, request: ListEdgesRequest,
                   timeout: Optional[float] = None) -> ListEdgesResponse:
        """Edges in ascending order of source, relation, target."""
        return self._unary("dsg.v1.QueryService/ListEdges", request, ListEdgesResponse, timeout,
                           reads=True)

    def list_nearest_nodes(self, request: ListNearestNodesRequest,
                           timeout: Optional[float] = None) -> ListNearestNodesResponse:
        """The k nodes nearest to a point by distance to their boxes; ties by id."""
        return self._unary("dsg.v1.QueryService/ListNearestNodes", request,
                           ListNearestNodesResponse, timeout, reads=True)

    def get_mesh(self, request: GetMeshRequest,
                 timeout: Optional[float] = None) -> Iterator[GetMeshResponse]:
        """The mesh, or that of one node, block by block in ascending order of x, y, z.
        Errors: INVALID_ARGUMENT/BOX_INVERTED or NUMBER_NOT_FINITE; NOT_FOUND/NODE_UNKNOWN;
        INVALID_ARGUMENT/FIELD_INVALID for the node of an agent or of a place, which have no
        triangles.
        """
        return self._stream("dsg.v1.QueryService/GetMesh", request, GetMeshResponse, timeout,
                            reads=True, lifetime="answer")

    def get_agent_shape(self, request: GetAgentShapeRequest,
                        timeout: Optional[float] = None) -> Iterator[GetAgentShapeResponse]:
        """The body shapes of an agent over an interval, ascending in time, about 1 MiB per message.
        Errors: NOT_FOUND/AGENT_UNKNOWN; INVALID_ARGUMENT/TIME_RANGE_INVERTED.
        """
        return self._stream("dsg.v1.QueryService/GetAgentShape", request, GetAgentShapeResponse,
                            timeout, reads=True, lifetime="answer")

    def list_factors(self, request: ListFactorsRequest,
                     timeout: Optional[float] = None) -> Iterator[ListFactorsResponse]:
        """The pose-graph factors of one agent that begin within an interval, ascending in time, at
        most 1000 per message. Errors: NOT_FOUND/AGENT_UNKNOWN;
        INVALID_ARGUMENT/TIME_RANGE_INVERTED.
        """
        return self._stream("dsg.v1.QueryService/ListFactors", request, ListFactorsResponse,
                            timeout, reads=True, lifetime="answer")

    def get_asset(self, request: GetAssetRequest,
                  timeout: Optional[float] = None) -> Iterator[GetAssetResponse]:
        """The content of an asset (CAD model, body model, topology), at most 1 MiB per message.
        Readable at each revision since the one that added it, until a compaction or an erasure
        deletes it.
        Errors: NOT_FOUND/ASSET_UNKNOWN; INVALID_ARGUMENT/FIELD_INVALID.
        """
        return self._stream("dsg.v1.QueryService/GetAsset", request, GetAssetResponse, timeout,
                            reads=True, lifetime="answer")

    def batch_get_nodes(self, request: BatchGetNodesRequest,
                        timeout: Optional[float] = None) -> BatchGetNodesResponse:
        """Batch form of GetNode for at most 1000 nodes, answered in the order of the request."""
        return self._unary("dsg.v1.QueryService/BatchGetNodes", request, BatchGetNodesResponse,
                           timeout, reads=True)

    def get_neighbors(self, request: GetNeighborsRequest,
                      timeout: Optional[float] = None) -> GetNeighborsResponse:
        """The incoming and outgoing edges of a node, with the nodes at their other ends.
        Errors: NOT_FOUND/NODE_UNKNOWN.
        """
        return self._unary("dsg.v1.QueryService/GetNeighbors", request, GetNeighborsResponse,
                           timeout, reads=True)

    def get_subgraph(self, request: GetSubgraphRequest,
                     timeout: Optional[float] = None) -> Iterator[GetSubgraphResponse]:
        """A node and all nodes reachable from it, nodes before the edges between them.
        Errors: NOT_FOUND/NODE_UNKNOWN.
        """
        return self._stream("dsg.v1.QueryService/GetSubgraph", request, GetSubgraphResponse,
                            timeout, reads=True, lifetime="answer")

    def search_nodes(self, request: SearchNodesRequest,
                     timeout: Optional[float] = None) -> SearchNodesResponse:
        """Nodes by class, name, colour, attribute, relation and containment, agents also by their
        stays.
        Errors: INVALID_ARGUMENT/QUERY_MALFORMED with the position of the error;
        NOT_FOUND/CLASS_UNKNOWN (a class or kind), RELATION_UNKNOWN, LAYER_UNKNOWN or NODE_UNKNOWN
        (an id or name) with names of similar spelling.
        """
        return self._unary("dsg.v1.QueryService/SearchNodes", request, SearchNodesResponse, timeout,
                           reads=True)

    def list_encounters(self, request: ListEncountersRequest,
                        timeout: Optional[float] = None) -> ListEncountersResponse:
        """Which agents were within a distance of each other, when and where.
        Errors: NOT_FOUND/AGENT_UNKNOWN; INVALID_ARGUMENT/TIME_RANGE_INVERTED.
        """
        return self._unary("dsg.v1.QueryService/ListEncounters", request, ListEncountersResponse,
                           timeout, reads=True)

    def list_interactions(self, request: ListInteractionsRequest,
                          timeout: Optional[float] = None) -> ListInteractionsResponse:
        """Which agent picked or placed which object, with the evidence; abstains if the evidence is
        weak.
        Errors: NOT_FOUND/AGENT_UNKNOWN, NODE_UNKNOWN; INVALID_ARGUMENT/TIME_RANGE_INVERTED.
        """
        return self._unary("dsg.v1.QueryService/ListInteractions", request,
                           ListInteractionsResponse, timeout, reads=True)

    def plan_path(self, request: PlanPathRequest,
                  timeout: Optional[float] = None) -> PlanPathResponse:
        """A path between two positions or nodes over the places.
        Errors: NOT_FOUND/NO_PATH with what blocks it; NOT_FOUND/NODE_UNKNOWN;
        INVALID_ARGUMENT/FIELD_INVALID.
        """
        return self._unary("dsg.v1.QueryService/PlanPath", request, PlanPathResponse, timeout,
                           reads=True)

    def plan_paths(self, request: PlanPathsRequest,
                   timeout: Optional[float] = None) -> PlanPathsResponse:
        """Batch form of PlanPath; each path that fails carries its own error."""
        return self._unary("dsg.v1.QueryService/PlanPaths", request, PlanPathsResponse, timeout,
                           reads=True)

    def check_collision(self, request: CheckCollisionRequest,
                        timeout: Optional[float] = None) -> CheckCollisionResponse:
        """What bodies touch, or their clearance.
        Errors: INVALID_ARGUMENT/FIELD_INVALID, NUMBER_NOT_FINITE.
        """
        return self._unary("dsg.v1.QueryService/CheckCollision", request, CheckCollisionResponse,
                           timeout, reads=True)

    def predict_agent(self, request: PredictAgentRequest,
                      timeout: Optional[float] = None) -> PredictAgentResponse:
        """Predicted poses of an agent.
        Errors: NOT_FOUND/AGENT_UNKNOWN; OUT_OF_RANGE/TIME_OUTSIDE_TRACK before the first pose and
        more than a day after the last.
        """
        return self._unary("dsg.v1.QueryService/PredictAgent", request, PredictAgentResponse,
                           timeout, reads=True)

    def get_scene(self, request: GetSceneRequest,
                  timeout: Optional[float] = None) -> Iterator[GetSceneResponse]:
        """Nodes and edges of whole layers as packed columns, about 1 MiB per message.
        Errors: NOT_FOUND/LAYER_UNKNOWN; INVALID_ARGUMENT/FIELD_INVALID.
        """
        return self._stream("dsg.v1.QueryService/GetScene", request, GetSceneResponse, timeout,
                            reads=True, lifetime="answer")

    def get_tracks(self, request: GetTracksRequest,
                   timeout: Optional[float] = None) -> Iterator[GetTracksResponse]:
        """The poses of many agents over an interval as packed columns, about 1 MiB per message.
        Covariances are left out; GetTrajectory has them.
        Errors: NOT_FOUND/AGENT_UNKNOWN; INVALID_ARGUMENT/TIME_RANGE_INVERTED or FIELD_INVALID.
        """
        return self._stream("dsg.v1.QueryService/GetTracks", request, GetTracksResponse, timeout,
                            reads=True, lifetime="answer")

    def get_timeline(self, request: GetTimelineRequest,
                     timeout: Optional[float] = None) -> GetTimelineResponse:
        """How many agents were observed when, in bins of equal length.
        Errors: INVALID_ARGUMENT/TIME_RANGE_INVERTED or FIELD_INVALID.
        """
        return self._unary("dsg.v1.QueryService/GetTimeline", request, GetTimelineResponse, timeout,
                           reads=True)

    def batch_get_shapes(self, request: BatchGetShapesRequest,
                         timeout: Optional[float] = None) -> Iterator[BatchGetShapesResponse]:
        """The bodies of agents at one instant, those with a body shape, about 1 MiB per message.
        Errors: NOT_FOUND/AGENT_UNKNOWN; INVALID_ARGUMENT/FIELD_INVALID.
        """
        return self._stream("dsg.v1.QueryService/BatchGetShapes", request, BatchGetShapesResponse,
                            timeout, reads=True, lifetime="answer")

    def list_mesh_blocks(self, request: ListMeshBlocksRequest,
                         timeout: Optional[float] = None) -> ListMeshBlocksResponse:
        """Indices of mesh blocks, with the revision that wrote each.
        Errors: INVALID_ARGUMENT/BOX_INVERTED or NUMBER_NOT_FINITE.
        """
        return self._unary("dsg.v1.QueryService/ListMeshBlocks", request, ListMeshBlocksResponse,
                           timeout, reads=True)

    def list_node_versions(self, request: ListNodeVersionsRequest,
                           timeout: Optional[float] = None) -> ListNodeVersionsResponse:
        """What was believed of one node: its versions in the revisions that are still readable,
        newest first. Errors: NOT_FOUND/NODE_UNKNOWN for an id that no readable revision knows.
        """
        return self._unary("dsg.v1.QueryService/ListNodeVersions", request,
                           ListNodeVersionsResponse, timeout, reads=True)

    def list_vocabulary(self, request: ListVocabularyRequest,
                        timeout: Optional[float] = None) -> ListVocabularyResponse:
        """The words that a search can use: kinds, classes and relations of a revision, with counts.
        """
        return self._unary("dsg.v1.QueryService/ListVocabulary", request, ListVocabularyResponse,
                           timeout, reads=True)
