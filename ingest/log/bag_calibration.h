// SPDX-License-Identifier: Apache-2.0
// Calibration from a bag: camera infos and static transforms.
// Refuses distortion models that it cannot apply.
#pragma once

#include "absl/status/status.h"
#include "ingest/log/bag_topics.h"

namespace dsg::ingest {

/// Fills in the rig of `plan` for its image channels, with notes for those without calibration, for
/// its lidar, and for its inertial unit: where it sits and how often it measures. Of the unit's
/// noise a bag says nothing; its densities are 0.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the topic and what is wrong.
absl::Status ReadBagCalibration(const Bag& bag, BagPlan* plan);

}  // namespace dsg::ingest
