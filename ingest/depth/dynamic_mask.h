// SPDX-License-Identifier: Apache-2.0
// Which pixels of a depth frame belong to people, who leave no surface in a map.
// Refuses to know who they are: labels and boxes of detections are all it looks at.
#pragma once

#include <cstdint>
#include <vector>

#include "ingest/depth/frame_maker.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/sensor/human_detection.h"

namespace dsg::ingest {

/// For DepthFrame::dynamic; empty when nothing moves. `detections` are in the frame's own pixels.
///
/// A pixel is masked when
/// - its class is one of DepthOptions::dynamic_classes, or
/// - it lies in a detection's box in which the labels show (nearly) nobody, and its depth is within
///   body_reach_m of the median depth along the torso's joints (of the box's middle, if they are
///   hidden),
/// - or within mask_growth_px of such a pixel,
/// - or as far again and beside a depth edge of more than mask_edge_m: an outline that the labels
///   missed, and readings between person and background.
/// Source: RSS 2020, section III-A (dynamic masking); the rim is our addition.
std::vector<uint8_t> MaskPeople(const DepthFrame& frame,
                                const std::vector<HumanDetection>& detections,
                                const DepthOptions& options);

}  // namespace dsg::ingest
