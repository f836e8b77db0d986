// SPDX-License-Identifier: Apache-2.0
// Finds the nodes of two maps, given in one frame, that stand for the same things. Nodes do not
// change here.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/merge/map_content.h"

namespace dsg::merge {

struct MatchOptions {
  /// Two sightings of a thing are this far apart and a quarter of its size.
  double object_noise_m = 0.25;
  /// Boxes that share this much of the smaller are one thing, however far their middles are apart.
  double object_containment_min = 0.6;
  /// Boxes that share this much of both together are one thing, whatever the classes say.
  double object_sameness_min = 0.45;
  /// A place takes in others within half of the clearance of the narrower of both, between these.
  double place_radius_min_m = 0.3;
  double place_radius_max_m = 0.8;
  /// Of the smaller outline: shared by both rooms; of rooms of one class less is enough.
  double room_overlap_min = 0.5;
  double room_overlap_min_same_class = 0.3;
  double plane_angle_max_rad = 0.17;
  double plane_distance_max_m = 0.2;
};

/// For each node of `other` the index of the node of `into` that it is, -1 for new ones. Several
/// places, rooms or structures of `other` may be one of `into`; objects pair one to one, but for
/// fragments inside another's box. Agents are paired by origins and PairAgents only.
///
/// `other` is in the frame of `into`, its layers numbered as there. `known`: pairs that are certain
/// already, as long as other.nodes, -1 where not; those are kept.
/// Errors: what `stop` returned.
absl::StatusOr<std::vector<int>> MatchNodes(const MapContent& into, const MapContent& other,
                                            std::vector<int> known, const MatchOptions& options,
                                            const StopCheck& stop);

/// A name that a program counted ("", "person 12", "robot" of a robot) tells nobody from another.
bool IsGeneratedName(const Node& agent);

/// Humans and robots that have the same name, not a generated one, and whose track in `other`
/// begins after the one in `into` ends: the same one in a later session.
void PairAgents(const MapContent& into, const MapContent& other, std::vector<int>* pair_of);

// Parts of MatchNodes, each for one class of nodes; they fill what is -1 in `pair_of`.
void MatchObjects(const MapContent& into, const MapContent& other, const MatchOptions& options,
                  std::vector<int>* pair_of);
void MatchPlaces(const MapContent& into, const MapContent& other, const MatchOptions& options,
                 std::vector<int>* pair_of);
void MatchStructures(const MapContent& into, const MapContent& other, const MatchOptions& options,
                     std::vector<int>* pair_of);
/// Uses the pairs of what the regions contain besides their outlines. From the lowest layer up.
void MatchRegions(const MapContent& into, const MapContent& other, const MatchOptions& options,
                  std::vector<int>* pair_of);

}  // namespace dsg::merge
