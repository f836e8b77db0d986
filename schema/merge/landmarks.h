// SPDX-License-Identifier: Apache-2.0
// Points of a map that another map of the same place would hold too.
// Refuses what has no class: a thing that could be anything matches everything.
#pragma once

#include <string>
#include <vector>

#include "schema/merge/map_content.h"

namespace dsg::merge {

struct Landmark {
  /// Landmarks of different kinds never match.
  std::string kind;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  /// Length of the box's diagonal, or a place's clearance, metres; 0 when unknown.
  double size_m = 0.0;
};

/// Things with a class that are believed to be there still. Where there are few (`few` or less),
/// rooms with a class and places too.
std::vector<Landmark> LandmarksOf(const MapContent& content, bool with_regions);

/// Lengths differ by less than a factor of two, or one is not known.
bool AreAlike(const Landmark& a, const Landmark& b);

/// Indices of pairs by kind: what the landmarks of one map could be in the other.
struct KindPair {
  std::vector<int> into;
  std::vector<int> other;
};
/// Ascending by kind; only kinds that both have.
std::vector<KindPair> PairKinds(const std::vector<Landmark>& into,
                                const std::vector<Landmark>& other);

}  // namespace dsg::merge
