// SPDX-License-Identifier: Apache-2.0
// Small steps between the stages of StaticLayers.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "ingest/grid/distance_field.h"
#include "ingest/objects/object_tracker.h"
#include "ingest/objects/relations.h"
#include "ingest/pipeline/layer_graph.h"
#include "ingest/pipeline/layers_options.h"
#include "ingest/rooms/find_rooms.h"
#include "ingest/rooms/structure.h"
#include "ingest/sensor/depth_frame.h"

namespace dsg::ingest {

/// Class that all things get in logs without labels, and its name.
inline constexpr int32_t kThingClass = 1;
inline constexpr char kThingName[] = "thing";

/// Names of the classes of nodes: the log's, or kThingName when it has none.
std::vector<SemanticLabel> NamesOf(const std::vector<SemanticLabel>& labels);

/// Classes that are neither structures nor people; kThingClass alone when there are no labels.
std::vector<int32_t> ObjectClasses(const std::vector<SemanticLabel>& labels,
                                   const StructureClasses& structures,
                                   const std::vector<int32_t>& dynamic_classes);

/// Classes of people by name: human, person, people.
std::vector<int32_t> DynamicClasses(const std::vector<SemanticLabel>& labels);

/// Letters' case ignored.
bool HasModelOf(const std::vector<CadModel>& catalogue, std::string_view class_name);

/// Heights of the storeys' floors, ascending, apart by a storey: large floor pieces that the
/// robot was above. Empty when there are none.
std::vector<double> FloorsOf(const std::vector<StructurePiece>& structures,
                             const std::vector<Eigen::Vector3d>& path_map,
                             const StructureOptions& options, const StoreyOptions& storeys);

/// Height of the largest ceiling within the heights of one above a floor.
std::optional<double> CeilingAbove(const std::vector<StructurePiece>& structures, double floor_z_m,
                                   const StructureOptions& options, const StoreyOptions& storeys);

/// The floor that an object stands on; nullopt when its low side is far from all of them.
std::optional<double> FloorUnder(const ObjectCluster& object, const std::vector<double>& floors_m,
                                 const StoreyOptions& storeys);

/// Classes that light, and so depth, goes through: glass, window.
std::vector<int32_t> GlassClasses(const std::vector<SemanticLabel>& labels);

/// Panes cannot be seen, what holds them can: columns of the grid with vertices of such a class are
/// made obstacles from the floor below to the vertex, and at least to the height of a body.
void CloseGlass(const std::vector<const MeshBlock*>& mesh, const std::vector<int32_t>& classes,
                const std::vector<double>& floors_m, double body_height_m,
                const StoreyOptions& storeys, OccupancyGrid* grid);

/// Ids of the objects whose middle is in the picture and not hidden, ascending.
std::vector<int64_t> ObjectsInView(const std::vector<TrackedObject>& objects,
                                   const DepthFrame& frame, const StoreyOptions& storeys);

/// Those pairs whose objects are both still there.
std::vector<CoVisibility::Pair> KnownPairs(std::vector<CoVisibility::Pair> pairs,
                                           const std::vector<TrackedObject>& objects);

/// Rooms of one storey, places counted over the whole map.
struct RoomsOfStorey {
  RoomMethod method = RoomMethod::kCeiling;
  std::vector<FoundRoom> rooms;
  /// Indices in `rooms`.
  std::vector<std::pair<int, int>> adjacent;
  /// (place, room) by the other method; empty when it agrees.
  std::vector<std::pair<int, int>> other_room_of_place;
};

RoomsOfStorey FindRoomsOfStorey(const DistanceField& field, const PlaceGraph& places,
                                const Storey& storey, const RoomOptions& options);

/// Long side by short side of the upright rectangle with the least area around a polygon; 1 without
/// a polygon.
double AspectOf(const Polygon2d& polygon);

}  // namespace dsg::ingest
