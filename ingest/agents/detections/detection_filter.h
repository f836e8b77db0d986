// SPDX-License-Identifier: Apache-2.0
// Which detections are worth tracking.
// Refuses to judge by position: consistency with a track is the tracker's business.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/human_detection.h"

namespace dsg::ingest {

/// Source: RSS 2020, section IV-A ("Human Nodes": bounding boxes near the image's border and those
/// of at most 30 pixels are rejected).
struct DetectionFilterOptions {
  double border_px = 5.0;
  double side_px_min = 30.0;
  double score_min = 0.0;

  std::vector<BoundOption> Bind();
};

/// Of a body that the image cuts off.
inline constexpr std::string_view kAtBorder = "box at the image's border";

/// Why a detection is not used, in words for the user ("box at the image's border"); nullopt when
/// it is. Also says no to boxes outside the image, numbers that are not finite and wrong counts.
std::optional<std::string_view> WhyRejected(const HumanDetection& detection,
                                            const CameraCalibration& camera,
                                            const DetectionFilterOptions& options);

}  // namespace dsg::ingest
