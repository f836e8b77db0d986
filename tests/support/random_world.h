// SPDX-License-Identifier: Apache-2.0
// A map kept the naive way, in ordered containers, and random deltas that are valid for it: the
// oracle that a store's snapshots are compared with.
#pragma once

#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "schema/model/graph_delta.h"

namespace dsg::test {

/// What a map holds after a revision.
struct NaiveMap {
  std::map<NodeId, Node> nodes;
  std::map<EdgeKey, Edge> edges;
  std::map<NodeId, std::map<TimeNs, TimedPose>> tracks;
  std::map<std::pair<NodeId, TimeNs>, Stay> stays;

  void Apply(const GraphDelta& delta);
};

/// Makes deltas: places in rooms that appear, move, leave or turn out false; edges; people who
/// walk, with gaps; corrections of the past; stays.
class RandomWorld {
 public:
  explicit RandomWorld(uint64_t seed) : random_(seed) {}

  /// Rooms, people; everything that later deltas refer to.
  GraphDelta First();
  /// Valid for `map`.
  GraphDelta Next(const NaiveMap& map);

  /// Uniform in [low, high].
  int64_t Int(int64_t low, int64_t high);
  double Real(double low, double high);
  static constexpr int kPeople = 5;
  static NodeId Person(int i) { return NodeId('H', static_cast<uint64_t>(i)); }

 private:
  void ChangePlaces(const NaiveMap& map, GraphDelta* delta);
  void ChangeEdges(const NaiveMap& map, GraphDelta* delta);
  void Walk(const NaiveMap& map, GraphDelta* delta);
  void Correct(const NaiveMap& map, GraphDelta* delta);
  void Visit(const NaiveMap& map, GraphDelta* delta);
  Node MakePlace(NodeId id);
  Pose3d RandomPose();

  std::mt19937_64 random_;
  int64_t sequence_ = 0;
  uint64_t next_place_ = 1;
};

}  // namespace dsg::test
