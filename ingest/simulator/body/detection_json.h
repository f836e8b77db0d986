// SPDX-License-Identifier: Apache-2.0
// A detection as one line of JSON, as docs/sensor_logs.md describes it.
// Refuses to choose digits by value: fixed decimals, so that the same seed gives the same bytes.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ingest/sensor/human_detection.h"

namespace dsg::simulator {

/// Without the end of the line. Units: metres to 0.1 mm, vertices to 1 mm, pixels to 0.01, radians
/// to 0.1 mrad. Requires: finite numbers.
std::string DetectionJson(const ingest::HumanDetection& detection);

/// The faces of all bodies of a log, as detections0/topology.json.
std::string TopologyJson(size_t vertex_count, const std::vector<std::array<uint32_t, 3>>& faces);

}  // namespace dsg::simulator
