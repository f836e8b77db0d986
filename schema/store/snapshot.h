// SPDX-License-Identifier: Apache-2.0
// The only way out of a store: one map as it was believed at one revision.
// Refuses to blur the two times: the revision is fixed at opening; world time is an argument.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "schema/base/stop_check.h"
#include "schema/base/time.h"
#include "schema/model/edge.h"
#include "schema/model/layer.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"
#include "schema/model/revision.h"
#include "schema/model/trajectory.h"

namespace dsg {

struct LayerCount {
  Layer layer;
  int64_t node_count = 0;
};

struct MapStats {
  RevisionInfo at;
  /// Ascending by rank, then name.
  std::vector<LayerCount> layers;
  /// What the map takes on disk now, not as of the revision; 0 for a map without files.
  int64_t bytes_on_disk = 0;
  /// First and last pose of all agents.
  std::optional<TimeNs> first_pose_ns;
  std::optional<TimeNs> last_pose_ns;
};

/// An agent's track as of a revision.
struct TrackInfo {
  NodeId agent;
  std::string name;
  std::string kind;
  int64_t pose_count = 0;
  /// Times of the first and last pose. Meaningful if pose_count > 0.
  TimeNs first_ns = 0;
  TimeNs last_ns = 0;
  TimeNs gap_ns_max = 0;
};

enum class PoseQuality { kExact = 1, kInterpolated = 2, kInGap = 3 };

/// Where an agent was at an instant.
struct LocatedPose {
  PoseQuality quality = PoseQuality::kExact;
  /// Meaningless if quality is kInGap.
  Pose3d map_T_agent;
  /// Times of the stored poses on both sides; equal if kExact.
  TimeNs before_ns = 0;
  TimeNs after_ns = 0;
  uint32_t flags = 0;
  /// Of the nearer stored pose; null when none was stored.
  std::shared_ptr<const Covariance6> covariance;
};

/// Narrows a listing of nodes; an unset field narrows nothing.
struct NodeFilter {
  std::optional<LayerId> layer;
  std::string kind;
  std::string class_name;
  std::string name;
  /// Children of this node by CONTAINS.
  NodeId parent;
  /// Box in the map frame that the node's box must touch.
  std::optional<Box3d> box_map;
  /// Instant of world time at which the node was valid.
  std::optional<TimeNs> at_ns;

  bool Matches(const Node& node) const;
};

struct EdgeFilter {
  NodeId source;
  std::string relation;
  NodeId target;
  std::optional<TimeNs> at_ns;

  bool Matches(const Edge& edge) const;
};

/// A piece of a track inside a box: the agent was in it during [enter_ns, exit_ns).
struct BoxVisit {
  NodeId agent;
  TimeNs enter_ns = 0;
  TimeNs exit_ns = 0;
};

/// Size of all parts of an asset but the last.
inline constexpr size_t kAssetPartBytes = size_t{1} << 20;

/// A part of an asset; all parts, joined in order, are its content.
struct AssetPart {
  std::string media_type;
  /// How many parts the asset has; at least 1, since an empty asset has an empty part.
  int64_t part_count = 0;
  /// Of the whole asset.
  int64_t size_bytes = 0;
  std::string content;
};

/// A body shape as a reader is shown it; lives as long as the call that shows it.
struct ShownShape {
  const BodyShape& shape;
  /// Also where the vertices were not asked for.
  uint32_t vertex_count = 0;
  const std::optional<Sha256>& topology;
};

/// An immutable map at one revision.
///
/// Threads: safe from many threads; never waits for the writer.
/// Errors of every call: DATA_LOSS/STORE_CORRUPT naming map, table and key when stored bytes are
/// not what was written; what `stop` returned.
class Snapshot {
 public:
  virtual ~Snapshot() = default;

  virtual const MapSpec& spec() const = 0;
  virtual Revision revision() const = 0;
  /// Of the map that was opened; see MapReader.
  virtual uint64_t opening() const = 0;
  virtual const std::string& incarnation() const = 0;

  /// Ascending by rank, then name.
  virtual absl::StatusOr<std::vector<Layer>> Layers() const = 0;
  /// Errors: NOT_FOUND/LAYER_UNKNOWN listing the known ones.
  absl::StatusOr<Layer> FindLayer(std::string_view name) const;
  virtual absl::StatusOr<std::vector<SemanticLabel>> Labels() const = 0;
  /// Reads counters only, whatever the size of the map.
  virtual absl::StatusOr<MapStats> Stats() const = 0;

  /// Errors: NOT_FOUND/NODE_UNKNOWN.
  virtual absl::StatusOr<Node> GetNode(NodeId id) const = 0;
  /// A node by id ("O42") or, failing that, by exact name; the lowest id when several share it
  /// (callers that need it to be the only one look with ScanNodes).
  /// Errors: NOT_FOUND/NODE_UNKNOWN.
  absl::StatusOr<NodeId> ResolveNode(std::string_view id_or_name) const;
  /// The same among humans and robots; an id goes before a name.
  /// Errors: NOT_FOUND/AGENT_UNKNOWN; INVALID_ARGUMENT/FIELD_INVALID when several share the name.
  absl::StatusOr<NodeId> ResolveAgent(std::string_view id_or_name) const;
  /// Nodes of exactly this name; none has the empty name. Order: ascending id.
  virtual absl::StatusOr<std::vector<NodeId>> NodesNamed(const std::string& name) const = 0;

  /// Calls `visit` for each matching node with id > `after`, until it returns false.
  /// Order: ascending id.
  virtual absl::Status ScanNodes(const NodeFilter& filter, NodeId after, const StopCheck& stop,
                                 const std::function<bool(const Node&)>& visit) const = 0;
  /// Calls `visit` for each matching edge with key > `after` (if given), until it returns false.
  /// Order: ascending (source, relation, target).
  virtual absl::Status ScanEdges(const EdgeFilter& filter, const std::optional<EdgeKey>& after,
                                 const StopCheck& stop,
                                 const std::function<bool(const Edge&)>& visit) const = 0;
  /// nullopt if there is none.
  virtual absl::StatusOr<std::optional<Edge>> FindEdge(const EdgeKey& key) const = 0;
  /// Some nodes at once, for who would call GetNode hundreds of times. Order: that of `ids`, one
  /// entry each, nullopt where there is none.
  virtual absl::StatusOr<std::vector<std::optional<Node>>> FindNodes(
      const std::vector<NodeId>& ids, const StopCheck& stop) const = 0;
  /// As FindNodes.
  virtual absl::StatusOr<std::vector<std::optional<Edge>>> FindEdges(
      const std::vector<EdgeKey>& keys, const StopCheck& stop) const = 0;
  /// Shows every node, for who wants them all: several times as fast as ScanNodes. One that a
  /// commit replaces meanwhile may be shown twice, both times as of this revision. Order: none.
  /// Requires: `visit` is quick.
  virtual absl::Status ReadAllNodes(const StopCheck& stop,
                                    const std::function<void(const Node&)>& visit) const = 0;
  /// As ReadAllNodes.
  virtual absl::Status ReadAllEdges(const StopCheck& stop,
                                    const std::function<void(const Edge&)>& visit) const = 0;
  /// Ancestors by CONTAINS, nearest first. Where a node has several parents, the lowest id.
  virtual absl::StatusOr<std::vector<NodeId>> Ancestors(NodeId id) const = 0;

  /// All agents with their tracks. Order: ascending id.
  virtual absl::StatusOr<std::vector<TrackInfo>> Tracks(const StopCheck& stop) const = 0;
  absl::StatusOr<std::vector<TrackInfo>> Tracks() const { return Tracks(StopCheck()); }
  /// Errors: NOT_FOUND/AGENT_UNKNOWN.
  virtual absl::StatusOr<TrackInfo> GetTrack(NodeId agent) const = 0;
  /// Interpolated between stored poses, never extrapolated.
  ///
  /// Frames: map_T_agent.
  /// Errors: NOT_FOUND/AGENT_UNKNOWN; OUT_OF_RANGE/TIME_OUTSIDE_TRACK with both ends.
  /// Cost:   one lookup in a cached directory and the decoding of part of one block of 64 poses.
  virtual absl::StatusOr<LocatedPose> Locate(NodeId agent, TimeNs at_ns) const = 0;
  /// Calls `visit` for the stored poses with from_ns <= time < to_ns, some hundreds at a time,
  /// until it returns false. The poses are valid during the call. Order: ascending time. Errors:
  /// NOT_FOUND/AGENT_UNKNOWN.
  virtual absl::Status ReadPoseRuns(
      NodeId agent, TimeNs from_ns, TimeNs to_ns, const StopCheck& stop,
      const std::function<bool(absl::Span<const TimedPose>)>& visit) const = 0;
  /// The same, pose by pose.
  absl::Status ReadPoses(NodeId agent, TimeNs from_ns, TimeNs to_ns, const StopCheck& stop,
                         const std::function<bool(const TimedPose&)>& visit) const;
  /// Exact intervals in which interpolated positions were inside a box, gaps excluded.
  /// A visit is clipped to [from_ns, to_ns) and at least 1 ns long, or one instant's pose.
  /// Order: ascending enter_ns, then agent.
  virtual absl::StatusOr<std::vector<BoxVisit>> VisitsToBox(const Box3d& box_map, TimeNs from_ns,
                                                            TimeNs to_ns,
                                                            const StopCheck& stop) const = 0;
  /// Agents with at least one stored pose or interpolated position in [from_ns, to_ns).
  virtual absl::StatusOr<int64_t> CountObservedAgents(TimeNs from_ns, TimeNs to_ns,
                                                      const StopCheck& stop) const = 0;

  /// The stay that holds an instant; nullopt when none does.
  virtual absl::StatusOr<std::optional<Stay>> StayAt(NodeId agent, TimeNs at_ns) const = 0;
  /// Stays of one agent that touch [from_ns, to_ns). Order: ascending enter_ns.
  virtual absl::StatusOr<std::vector<Stay>> StaysOfAgent(NodeId agent, TimeNs from_ns,
                                                         TimeNs to_ns) const = 0;
  /// Stays in a room or place that touch [from_ns, to_ns), open ends clipped to the track's last
  /// pose. Order: ascending enter_ns, then agent.
  virtual absl::StatusOr<std::vector<Stay>> StaysInNode(NodeId room_or_place, TimeNs from_ns,
                                                        TimeNs to_ns,
                                                        const StopCheck& stop) const = 0;

  /// Order: ascending from_ns, then to_ns, type, to_agent.
  virtual absl::StatusOr<std::vector<PoseFactor>> Factors(NodeId agent, TimeNs from_ns,
                                                          TimeNs to_ns) const = 0;
  /// Calls `visit` for each body shape with from_ns <= time < to_ns, until it returns false. Of
  /// several shapes of one time the one of the newest revision is believed.
  /// Order: ascending time.
  /// Cost:   decodes at most 32 shapes to show one; cheap without vertices.
  virtual absl::Status ReadShapes(NodeId agent, TimeNs from_ns, TimeNs to_ns, bool with_vertices,
                                  const StopCheck& stop,
                                  const std::function<bool(const ShownShape&)>& visit) const = 0;
  /// All of them at once. Order: ascending time.
  absl::StatusOr<std::vector<BodyShape>> Shapes(NodeId agent, TimeNs from_ns, TimeNs to_ns) const;
  /// Indices of all mesh blocks, ascending.
  virtual absl::StatusOr<std::vector<BlockIndex>> MeshBlocks() const = 0;
  /// The same, with the revision that wrote each: what is derived from a block can be kept by both.
  virtual absl::StatusOr<std::vector<std::pair<BlockIndex, Revision>>> MeshBlockVersions(
      const StopCheck& stop) const = 0;
  /// Errors: NOT_FOUND/NODE_UNKNOWN when there is no such block.
  virtual absl::StatusOr<MeshBlock> ReadMeshBlock(BlockIndex index) const = 0;
  /// Errors: NOT_FOUND/ASSET_UNKNOWN.
  virtual absl::StatusOr<Asset> ReadAsset(const Sha256& sha256) const = 0;
  /// Part `index` (from 0) of an asset, so that a large asset need not be in memory whole. The
  /// bytes of the part are checked, the digest of the whole is not.
  /// Cost:   that of one part; a backend that stores no parts reads the whole asset.
  /// Errors: NOT_FOUND/ASSET_UNKNOWN, also for an index past the last part.
  virtual absl::StatusOr<AssetPart> ReadAssetPart(const Sha256& sha256, int64_t index) const;

 protected:
  /// NOT_FOUND, naming what was asked for.
  absl::Status UnknownNode(NodeId id) const;
  absl::Status UnknownMeshBlock(const BlockIndex& index) const;
  absl::Status UnknownAsset(const Sha256& sha256) const;

 private:
  absl::StatusOr<bool> IsAgent(NodeId id) const;
};

}  // namespace dsg
