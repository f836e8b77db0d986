// SPDX-License-Identifier: Apache-2.0
// A directed, typed relation between two nodes.
#pragma once

#include <compare>
#include <string>

#include "schema/base/time.h"
#include "schema/model/ids.h"
#include "schema/model/node.h"

namespace dsg {

/// The relations that the model knows; any other name is a custom relation.
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
}  // namespace relations

struct EdgeKey {
  NodeId source;
  std::string relation;
  NodeId target;
  auto operator<=>(const EdgeKey&) const = default;
};

struct Edge {
  NodeId source;
  std::string relation;
  NodeId target;
  double weight = 1.0;
  Interval valid;
  Attributes attributes;
  /// The revision that wrote this version; 0 in a delta.
  Revision revision = 0;

  EdgeKey key() const { return {source, relation, target}; }
};

}  // namespace dsg
