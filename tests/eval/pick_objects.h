// SPDX-License-Identifier: Apache-2.0
// Small objects as a mapper makes them of looks at where they stand: misses, jitter, delays, false
// changes. Refuses to guess what nobody looked at.
#pragma once

#include <vector>

#include "ingest/simulator/body/human_motion.h"
#include "ingest/simulator/world/world.h"
#include "schema/model/node.h"
#include "tests/eval/pick_cameras.h"
#include "tests/eval/pick_world.h"

namespace dsg::eval {

struct MappedObject {
  Node node;
  ObjectTruth truth;
  int room = 0;
};

/// Threads: one caller at a time.
class ObjectSensor {
 public:
  /// All must outlive this.
  ObjectSensor(const simulator::World& world, const simulator::CrowdMotion& crowd,
               const PickSensorModel& sensor, double duration_s, uint64_t seed);

  void Look(TimeNs at_ns, const Cameras& cameras, const std::vector<Blocker>& bodies);
  /// All that is or was mapped.
  std::vector<MappedObject> Finish();

 private:
  /// Something stood there during [from_ns, to_ns).
  struct Spot {
    int furniture = 0;
    int room = 0;
    Eigen::Vector3d at_map = Eigen::Vector3d::Zero();
    Interval there;
    int taken_by = -1;
    int put_by = -1;
    bool is_never_mapped = false;
    TimeNs false_end_ns = kTimeMax;
    bool is_reappearing = false;
    /// Index of the mapped object; -1 = none yet.
    int mapped = -1;
    int present_count = 0;
    int absent_run = 0;
    TimeNs first_absent_ns = 0;
    bool is_over = false;
  };

  void AddSpot(Spot spot, Random* random);
  void AddTwin(const Spot& spot, Random* random);
  void See(TimeNs at_ns, bool is_present, bool is_false, Spot* spot);
  void Map(TimeNs at_ns, Spot* spot);
  void End(bool is_false, Spot* spot);

  const simulator::World& world_;
  const PickSensorModel& sensor_;
  TimeNs end_ns_;
  Random random_;
  std::vector<Spot> spots_;
  std::vector<MappedObject> mapped_;
};

}  // namespace dsg::eval
