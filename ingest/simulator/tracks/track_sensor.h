// SPDX-License-Identifier: Apache-2.0
// What a tracker sees of one agent: noise, uneven instants of sampling, and losses.
// Refuses to know the world: people are lost at random, not behind walls.
#pragma once

#include "ingest/simulator/world/options.h"
#include "ingest/simulator/world/walker.h"
#include "schema/base/random.h"

namespace dsg::simulator {

/// Threads: one caller at a time.
class TrackSensor {
 public:
  TrackSensor(const TrackSensorOptions& options, const AgentSpec& agent, uint64_t seed);

  /// When the sample numbered `tick` is taken, nanoseconds from the start. Strictly grows with
  /// `tick`; samples of different ticks never change order between agents.
  TimeNs SampleTime(int64_t tick);

  /// Whether the track is lost. Requires: times never go back.
  bool IsLost(TimeNs time_ns);

  /// The pose as measured.
  Pose3d Measure(const FloorPose& truth);

  int64_t loss_count() const { return loss_count_; }

 private:
  void DrawLoss(TimeNs after_ns);

  const TrackSensorOptions options_;
  const bool is_robot_;
  Random random_;
  // Losses have a stream of their own: more noise does not move them.
  Random loss_random_;
  TimeNs loss_begin_ns_ = kTimeMax;
  TimeNs loss_end_ns_ = kTimeMax;
  bool was_lost_ = false;
  int64_t loss_count_ = 0;
};

/// Samples that a sensor takes in `duration_s`: ticks 0 to this, this not included.
int64_t TickCount(double duration_s, double rate_hz);

}  // namespace dsg::simulator
