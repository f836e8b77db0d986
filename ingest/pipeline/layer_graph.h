// SPDX-License-Identifier: Apache-2.0
// From what the stages found to nodes and edges of the scene graph.
// Refuses to find anything itself.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ingest/commit/graph_told.h"
#include "ingest/objects/object_tracker.h"
#include "ingest/objects/relations.h"
#include "ingest/objects/shapes/cad_model.h"
#include "ingest/objects/shapes/shape_fit.h"
#include "ingest/places/place_graph.h"
#include "ingest/rooms/find_rooms.h"
#include "ingest/rooms/structure.h"
#include "schema/model/layer.h"

namespace dsg::ingest {

/// An object that left the world, without the points of its cluster: 0.4 kB.
struct GoneObject {
  TrackedObject object;
  std::optional<ShapeFit> fit;
  TimeNs gone_ns = 0;
};

struct Storey {
  double floor_z_m = 0.0;
  double ceiling_z_m = 0.0;
  /// Whether the ceiling was seen; its height is a guess otherwise.
  bool has_ceiling = false;
  /// Indices of its places, ascending.
  std::vector<int> places;
};

/// Of the whole map, indices across the storeys.
struct RoomPart {
  FoundRoom room;
  int storey = 0;
  RoomMethod method = RoomMethod::kCeiling;
  std::map<std::string, double> class_probabilities;
};

/// All that the stages found at one instant.
struct LayerParts {
  std::vector<TrackedObject> objects;
  std::map<int64_t, ShapeFit> fits;
  std::vector<GoneObject> gone;
  std::vector<ObjectRelation> relations;
  std::vector<CoVisibility::Pair> together;
  PlaceGraph places;
  std::vector<Storey> storeys;
  std::vector<RoomPart> rooms;
  /// For each place its room; -1 = none.
  std::vector<int> room_of_place;
  /// The other method's rooms, where it had another opinion; by place.
  std::vector<int> other_room_of_place;
  /// Indices of rooms.
  std::vector<std::pair<int, int>> adjacent;
  std::vector<StructurePiece> structures;
  /// (structure, room) and (object, structure) by index.
  std::vector<std::pair<int, int>> encloses;
  std::vector<std::pair<int, int>> attached;
  /// For each object, then each gone one, its place; -1 = none.
  std::vector<int> place_of_object;
};

/// Which ids a session gives, so that logs of one map keep apart.
struct NodeNumbering {
  std::string session_id;
  /// How many sessions with static layers the map held before this one.
  int64_t session_number = 0;

  static constexpr uint64_t kPerSession = 1'000'000;
  bool IsOwn(NodeId id) const {
    return id.index() / kPerSession == static_cast<uint64_t>(session_number);
  }
  NodeId Id(char letter, int64_t index) const {
    return NodeId(
        letter, static_cast<uint64_t>(session_number) * kPerSession + static_cast<uint64_t>(index));
  }
};

/// The layer between rooms and buildings, for buildings of several storeys.
inline constexpr LayerId kLevelLayer = 8;
inline constexpr char kLevelKind[] = "level";
Layer LevelLayer();

/// Name of the building's attribute that says which session made it.
inline constexpr char kSessionAttribute[] = "session";

/// Threads: safe from many threads.
class LayerGraphMaker {
 public:
  /// Requires: `catalogue` outlives the maker.
  LayerGraphMaker(NodeNumbering numbering, const std::vector<SemanticLabel>& labels,
                  const std::vector<CadModel>& catalogue);

  /// Boxes contain their children's. Empty without parts.
  LayerGraph Make(const LayerParts& parts) const;

  const NodeNumbering& numbering() const { return numbering_; }
  /// "class 7" for a class without a name.
  std::string ClassName(int32_t class_id) const;

 private:
  class Build;

  NodeNumbering numbering_;
  std::map<int32_t, std::string> name_of_class_;
  const std::vector<CadModel>& catalogue_;
};

}  // namespace dsg::ingest
