// SPDX-License-Identifier: Apache-2.0
// The names that the model itself knows: kinds of nodes, relations of edges, attributes. Any other
// name is custom. Checks, codec, query language and readers of files take their lists from here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "schema/model/layer.h"

namespace dsg {

namespace kinds {
inline constexpr char kObject[] = "object";
inline constexpr char kHuman[] = "human";
inline constexpr char kRobot[] = "robot";
inline constexpr char kPlace[] = "place";
inline constexpr char kStructure[] = "structure";
inline constexpr char kRoom[] = "room";
inline constexpr char kBuilding[] = "building";
/// What drives or is pushed, and what walks: carts, bicycles, dogs. The class says which.
inline constexpr char kVehicle[] = "vehicle";
inline constexpr char kAnimal[] = "animal";

struct Kind {
  std::string_view name;
  /// Where nodes of the kind live.
  LayerId layer;
  /// They have a trajectory.
  bool is_agent = false;
};

/// Stores write a kind as its position in this list: append only.
inline constexpr Kind kAll[] = {
    {kObject, layers::kObjects},       {kHuman, layers::kAgents, true},
    {kRobot, layers::kAgents, true},   {kPlace, layers::kPlaces},
    {kStructure, layers::kStructures}, {kRoom, layers::kRooms},
    {kBuilding, layers::kBuildings},   {kVehicle, layers::kAgents, true},
    {kAnimal, layers::kAgents, true},
};

/// nullptr for a custom kind.
const Kind* Find(std::string_view name);
}  // namespace kinds

/// Humans, robots, vehicles and animals: the kinds that have a trajectory.
bool IsAgentKind(std::string_view kind);

/// The layer that nodes of a known kind live in; nullopt for custom kinds.
std::optional<LayerId> LayerOfKind(std::string_view kind);

/// Poses of a track that a scene graph keeps as nodes, beside the track: a custom kind and layer
/// that imports make.
inline constexpr LayerId kAgentPoseLayer = 20;
inline constexpr char kAgentPoseKind[] = "agent_pose";

namespace relations {
/// Parent to child: the hierarchy.
inline constexpr char kContains[] = "CONTAINS";
/// Place to place; weight = clearance, metres.
inline constexpr char kTraversable[] = "TRAVERSABLE";
/// Room to room, through a door.
inline constexpr char kAdjacent[] = "ADJACENT";
/// Object or agent pose to place.
inline constexpr char kNearestPlace[] = "NEAREST_PLACE";
inline constexpr char kOn[] = "ON";
inline constexpr char kIn[] = "IN";
inline constexpr char kNear[] = "NEAR";
inline constexpr char kCoVisible[] = "CO_VISIBLE";
inline constexpr char kLargerThan[] = "LARGER_THAN";
/// Object to the structure it hangs on.
inline constexpr char kAttachedTo[] = "ATTACHED_TO";
/// Structure to room.
inline constexpr char kEncloses[] = "ENCLOSES";
inline constexpr char kSameAs[] = "SAME_AS";
inline constexpr char kHeldBy[] = "HELD_BY";

enum class Ends {
  /// Any number of edges may leave a node; source and target differ in meaning.
  kMany,
  /// A node is the source of one such edge at most.
  kOne,
  /// Both ends mean the same; the edge is stored once, in one direction.
  kEither,
};

struct Relation {
  std::string_view name;
  Ends ends = Ends::kMany;
};

/// By name.
inline constexpr Relation kAll[] = {
    {kAdjacent, Ends::kEither},
    {kAttachedTo},
    {kCoVisible, Ends::kEither},
    {kContains},
    {kEncloses},
    {kHeldBy, Ends::kOne},
    {kIn, Ends::kOne},
    {kLargerThan},
    {kNear, Ends::kEither},
    {kNearestPlace, Ends::kOne},
    {kOn, Ends::kOne},
    {kSameAs, Ends::kEither},
    {kTraversable, Ends::kEither},
};

/// nullptr for a custom relation.
const Relation* Find(std::string_view name);
}  // namespace relations

namespace attributes {
/// What a Spark-DSG node says beyond the fields of a node, and the names of the parts that follow
/// when one attribute is too short; see schema/interop/spark_rest.h.
inline constexpr char kSparkRest[] = "spark_dsg";
/// The same of a whole Spark-DSG graph, on one of its nodes.
inline constexpr char kSparkGraphRest[] = "spark_dsg_graph";
/// Of a robot whose poses are also nodes: the letter of their ids.
inline constexpr char kSparkPoses[] = "spark_dsg_poses";

/// Of those above, and their parts: kept for an export, shown, and no word to search for.
bool IsFileRest(std::string_view name);

/// Names of attributes that scene graphs have, and of keys in those that hold JSON, have a number
/// that stores write in their stead. nullopt for any other name.
std::optional<uint8_t> NumberOf(std::string_view name);
/// "" for a number that no name has.
std::string_view NameOf(uint8_t number);
/// Numbers are below it.
inline constexpr size_t kNumberEnd = 254;
}  // namespace attributes

}  // namespace dsg
