// SPDX-License-Identifier: Apache-2.0
// A world and some walks from above, as a picture for people.
// Refuses to be exact to the pixel; map.json is.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/simulator/world/world.h"

namespace dsg::simulator {

struct PreviewTrack {
  std::string name;
  /// In order, map frame.
  std::vector<Point> points;
};

/// PNG bytes: rooms tinted by class, walls, doors, furniture in its colours, the places graph,
/// the tracks with a legend, and a scale bar. North (y) is up.
absl::StatusOr<std::string> DrawPreview(const World& world,
                                        const std::vector<PreviewTrack>& tracks);

}  // namespace dsg::simulator
