// SPDX-License-Identifier: Apache-2.0
// The invariants that every delta must satisfy before a row is written.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "schema/model/graph_delta.h"

namespace dsg {

/// What CheckDelta asks of the graph that the delta is to be applied to.
class GraphLookup {
 public:
  struct NodeFacts {
    LayerId layer = 0;
    bool is_agent = false;
    Interval valid;
    /// Empty when the node has no extent of its own.
    Box3d box_map;
    Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
    std::optional<TimeNs> first_observed_ns;
    std::optional<TimeNs> last_observed_ns;
  };

  virtual ~GraphLookup() = default;

  /// nullopt when no such node is believed in at the head.
  virtual absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId id) const = 0;
  virtual absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const = 0;
  /// Sources of CONTAINS edges to `id`.
  virtual absl::StatusOr<std::vector<NodeId>> FindParents(NodeId id) const = 0;
  /// Targets of CONTAINS edges from `id`.
  virtual absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId id) const = 0;
  /// Time of the last stored pose; nullopt for an empty track.
  virtual absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId agent) const = 0;
  virtual absl::StatusOr<bool> HasAsset(const Sha256& sha256) const = 0;
  /// nullptr while there is no map yet, as for a file that is read: then neither the places of mesh
  /// vertices nor the distance of times from the map's are checked.
  virtual const MapSpec* FindSpec() const { return nullptr; }
  /// From the first to the last pose that was ever stored; nullopt without poses. Asked only about
  /// times that are far from the epoch.
  virtual absl::StatusOr<std::optional<Interval>> FindSpan() const {
    return std::optional<Interval>();
  }
};

/// A child's box may stick out of its parent's by this much: boxes are fitted in doubles, and
/// rotating a box into the map and back costs a few ulps at kilometre coordinates.
inline constexpr double kBoxToleranceM = 1e-6;

/// Coordinates beyond this are refused as absurd: 2,000 km is no building.
inline constexpr double kCoordinateMaxM = 2.0e6;

/// What was observed further than this from all that a map knows is a wrong clock, and refused:
/// maps are kept for years, and a robot that comes back after five of them is no error. The map
/// knows its poses and, on a UNIX clock that was given one, its epoch; a map that knows neither
/// takes any time. Clocks that are wrong by less are what retention minds.
inline constexpr TimeNs kObservedFarMaxNs = 3652 * 24 * 3600 * kNsPerSecond;
/// As above, for when something existed in the world, which may be told from records.
inline constexpr TimeNs kValidFarMaxNs = 10 * kObservedFarMaxNs;

/// A mesh vertex may lie outside of its block by this much for each metre from the origin (floats
/// have 24 bits), and by a tenth of a millimetre.
inline constexpr double kVertexToleranceM = 1e-4;
inline constexpr double kVertexTolerancePerM = 1.2e-7;
/// The other corners of a face may lie outside of the block of the first, by no more than this.
inline constexpr double kFaceReachMaxM = 1000.0;

/// Limits that keep one delta, and every later answer about it, bounded.
inline constexpr size_t kNameLengthMax = 1024;
inline constexpr size_t kAttributeCountMax = 64;
inline constexpr size_t kAttributeLengthMax = 65536;
inline constexpr size_t kMeshVertexCountMax = 4'000'000;
/// Numbers in one part of a body shape, and in its vertices.
inline constexpr size_t kShapeNumbersMax = 4096;
inline constexpr size_t kShapeVertexNumbersMax = 300'000;
inline constexpr size_t kAssetBytesMax = size_t{256} << 20;

/// Proves the invariants of the data model against the graph at the head: ids exist and match
/// their kind's layer; a parent's layer outranks its child's, so no containment cycle can form;
/// boxes contain their children's boxes; quaternions are unit, numbers finite; intervals are
/// ordered; trajectory times strictly grow per agent; edge ends live; sizes are bounded and not
/// negative; outlines have corners and heights in order; vertices lie in their mesh block; assets
/// match their hash and referenced ones exist. Each entity appears at most once (see Coalesce).
/// What forgets (`is_forgetting`) writes parts of what is stored, so places and times that were
/// taken before they were checked do not keep it from its work.
///
/// Errors: INVALID_ARGUMENT/DELTA_INVALID or NUMBER_NOT_FINITE naming part, object and value;
/// INVALID_ARGUMENT/TIME_IMPLAUSIBLE for times far from the map's, unless the node has them
/// already; ALREADY_EXISTS/TRACK_CONFLICT when an append reaches back before the track's end.
absl::Status CheckDelta(const GraphDelta& delta, const GraphLookup& graph);

}  // namespace dsg
