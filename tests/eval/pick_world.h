// SPDX-License-Identifier: Apache-2.0
// A simulated building in which people take small things and put them elsewhere, as the map that a
// mapper would make of it, with what really happened. Refuses to render; see pick_sensor.h.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/simulator/body/human_motion.h"
#include "ingest/simulator/world/world.h"
#include "schema/model/graph_delta.h"
#include "tests/eval/pick_sensor.h"

namespace dsg::eval {

struct PickWorldOptions {
  simulator::WorldOptions world;
  int people_count = 3;
  double duration_s = 300.0;
  Tier tier = Tier::kCameras;
  PickSensorModel sensor;
};

/// What a mapped small object really is. Indices of picks, -1 = none.
struct ObjectTruth {
  /// The pick that took it away from there.
  int taken_by = -1;
  /// The pick that put it there.
  int put_by = -1;
  /// The mapper was wrong when it let it end.
  bool has_false_end = false;
};

/// What of a pick came into the map.
struct PickTruth {
  simulator::PickEvent event;
  /// An object of the map stood for the thing, and it ended within an interval with the pick.
  bool is_held = false;
  bool is_noticed = false;
  /// The person was tracked within so many seconds of the pick, and of the put.
  double seen_apart_s = 1e9;
  double put_seen_apart_s = 1e9;
};

struct PickWorld {
  std::string name;
  Tier tier = Tier::kCameras;
  /// Map and session are not set.
  GraphDelta delta;
  std::vector<PickTruth> picks;
  std::map<NodeId, ObjectTruth> objects;
  /// The person whom most of a track's poses are of.
  std::map<NodeId, int> person_of_track;
};

/// Same options, same world. Errors: of the world's generation.
absl::StatusOr<PickWorld> MakePickWorld(const PickWorldOptions& options);

}  // namespace dsg::eval
