// SPDX-License-Identifier: Apache-2.0
// What a robot would make of a part of a generated building: noisy, with things missed, made up and
// mistaken, numbered from nought, in a frame of its own. Keeps the truth beside it.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ingest/simulator/world/world.h"
#include "schema/model/graph_delta.h"
#include "schema/store/graph_store.h"

namespace dsg::test {

struct PerceiveOptions {
  /// Share of the building along x that was walked.
  double from = 0.0;
  double to = 1.0;
  double position_noise_m = 0.06;
  double size_noise = 0.06;
  double missed_share = 0.1;
  double false_share = 0.04;
  double misclassified_share = 0.03;
  double place_noise_m = 0.2;
  TimeNs begin_ns = 0;
  uint64_t seed = 1;
  Pose3d map_T_world;
};

struct PerceivedHalf {
  GraphDelta delta;
  /// Index of the furniture or the room of the world; what is made up is not in it.
  std::map<NodeId, int> thing_of;
  std::map<NodeId, int> room_of;
  Pose3d map_T_world;
};

PerceivedHalf Perceive(const simulator::World& world, const PerceiveOptions& options);

/// Makes the map and commits the delta, whole. Fails the test on errors.
void StoreMap(GraphStore* store, const std::string& name, GraphDelta delta);

/// The newest snapshot. Fails the test on errors.
std::shared_ptr<const Snapshot> Newest(GraphStore* store, const std::string& name);

simulator::World MakeWorld(simulator::WorldKind kind, uint64_t seed);

/// Those that DSG_MERGE_SEEDS names ("11 12"), or else `usual`.
std::vector<uint64_t> MergeSeeds(std::vector<uint64_t> usual);

/// A turn and a shift that a robot's frame may have against that of another.
Pose3d SomeTransform(uint64_t seed);

}  // namespace dsg::test
