// SPDX-License-Identifier: Apache-2.0
// What a room is used for, told from what stands in it, and what a building is, from its rooms.
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

/// "house" (where people live) and "office" (where they work), from the rooms' ClassifyRoom;
/// probabilities that add up to one, or empty where the rooms say too little: kitchens and
/// corridors are in both.
std::map<std::string, double> ClassifyBuilding(
    const std::vector<std::map<std::string, double>>& rooms);

}  // namespace dsg::ingest
