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
  /// Largest distance between two sightings of a thing, plus a quarter of its size.
  double object_noise_m = 0.25;
  /// Boxes that share this part of the smaller one are one thing, whatever the distance of their
  /// centres.
  double object_containment_min = 0.6;
  /// Boxes with this intersection over union are one thing, whatever their classes.
  double object_sameness_min = 0.45;
  /// Places are one within half of the smaller clearance, clamped to these bounds.
  double place_radius_min_m = 0.3;
  double place_radius_max_m = 0.8;
  /// Share of the smaller floor plan that both rooms cover; less is enough for rooms of one class.
  double room_overlap_min = 0.5;
  double room_overlap_min_same_class = 0.3;
  double plane_angle_max_rad = 0.17;
  double plane_distance_max_m = 0.2;
};

/// For each node of `other` the index of the same node in `into`, -1 if it is new. Several places,
/// rooms or structures of `other` may match one of `into`. Objects match one to one, except for
/// fragments inside the box of another. Agents match by origins and PairAgents only.
/// `other` is in the frame of `into` and has its layer numbers. `known`: certain pairs, by node of
/// `other`, -1 where unknown; they are kept.
/// Errors: what `stop` returned.
absl::StatusOr<std::vector<int>> MatchNodes(const MapContent& into, const MapContent& other,
                                            std::vector<int> known, const MatchOptions& options,
                                            const StopCheck& stop);

/// Whether a program made the name ("", "person 12", "robot" of a robot): it identifies nobody.
bool IsGeneratedName(const Node& agent);

/// Pairs humans and robots of one name that is not generated, if the track in `other` begins after
/// the track in `into` ends: the same agent in a later session.
void PairAgents(const MapContent& into, const MapContent& other, std::vector<int>* pair_of);

// The steps of MatchNodes, one per class of nodes. They fill entries of `pair_of` that are -1.
void MatchObjects(const MapContent& into, const MapContent& other, const MatchOptions& options,
                  std::vector<int>* pair_of);
void MatchPlaces(const MapContent& into, const MapContent& other, const MatchOptions& options,
                 std::vector<int>* pair_of);
void MatchStructures(const MapContent& into, const MapContent& other, const MatchOptions& options,
                     std::vector<int>* pair_of);
/// Uses floor plans, and pairs among what the regions contain. From the lowest layer up.
void MatchRegions(const MapContent& into, const MapContent& other, const MatchOptions& options,
                  std::vector<int>* pair_of);

}  // namespace dsg::merge
