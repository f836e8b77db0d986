// SPDX-License-Identifier: Apache-2.0
// Calibration from a bag: camera infos and static transforms.
// Refuses distortion models that it cannot apply.
#pragma once

#include "absl/status/status.h"
#include "ingest/log/bag_topics.h"

namespace dsg::ingest {

/// Fills in the rig of `plan` for its image channels, with notes for those without calibration.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the topic and what is wrong.
absl::Status ReadBagCalibration(const Bag& bag, BagPlan* plan);

}  // namespace dsg::ingest
