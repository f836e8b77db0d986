// SPDX-License-Identifier: Apache-2.0
// What the cameras of a log really saw: which people, which surfaces, which free space. The truth
// uses it so that nobody is charged for what was never in view.
// Refuses to look at image files; it casts the same rays again.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/simulator/body/detector.h"
#include "ingest/simulator/sensors/render_frames.h"
#include "ingest/simulator/sensors/session.h"
#include "ingest/truth/truth.h"

namespace dsg::simulator {

/// An object that is carried at some time, seen in a keyframe.
struct ObjectSighting {
  int object = 0;
  TimeNs time_ns = 0;
};

struct Observation {
  /// Of each keyframe and person in view. Ascending by frame, then person. Times on the log's
  /// clock.
  std::vector<BodyView> views;
  /// Ascending by time, then object; from the log's begin.
  std::vector<ObjectSighting> sightings;
  /// Of each face of the scene, counted through its parts.
  std::vector<uint8_t> face_observed;
};

/// Casts all keyframes again, without light. Marks the cells of `grid` that depth rays passed
/// through between 0.1 and 1.8 m above the floor. Same session, same result, whatever the count
/// of threads. Cost: about 30 ms a keyframe.
absl::StatusOr<Observation> Observe(const SensorSession& session, int thread_count,
                                    const SensorsProgress& progress, truth::FreeGrid* grid);

}  // namespace dsg::simulator
