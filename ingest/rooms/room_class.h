// SPDX-License-Identifier: Apache-2.0
// What a room is used for, told from what stands in it.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace dsg::ingest {

struct RoomContents {
  /// Class names of its objects, with repeats.
  std::vector<std::string> object_classes;
  double area_m2 = 0.0;
  /// Long side by short side of its footprint's smallest rectangle.
  double aspect = 1.0;
  int door_count = 0;
};

/// Probabilities that add up to one, by class name ("kitchen", "office", "corridor", ...); empty
/// when nothing speaks for anything. Naive Bayes over counts of furniture that is known the world
/// over; corridors by shape and doors.
std::map<std::string, double> ClassifyRoom(const RoomContents& contents);

}  // namespace dsg::ingest
