// SPDX-License-Identifier: Apache-2.0
// A detection as one line of JSON, as docs/sensor_logs.md describes it.
// Refuses to choose digits by value: fixed decimals, so that the same seed gives the same bytes.
#pragma once

#include <string>

#include "ingest/sensor/human_detection.h"

namespace dsg::simulator {

/// Without the end of the line. Units: metres to 0.1 mm, pixels to 0.01, radians to 0.1 mrad.
/// Requires: finite numbers.
std::string DetectionJson(const ingest::HumanDetection& detection);

}  // namespace dsg::simulator
