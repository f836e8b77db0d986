// SPDX-License-Identifier: Apache-2.0
// The tree of a body's joints, in the order of human_detection.h.
#pragma once

#include <array>

#include "ingest/sensor/human_detection.h"

namespace dsg::ingest {

/// The joint that each hangs on, -1 for the pelvis.
inline constexpr std::array<int, kJointCount> kJointParents = {
    -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21};

}  // namespace dsg::ingest
