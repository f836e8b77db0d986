// SPDX-License-Identifier: Apache-2.0
// Poses as bytes and back, for those that wait on disk: the same to the last bit.
// The form is of one process: it goes by this machine's byte order and has no version.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "schema/model/trajectory.h"

namespace dsg::ingest {

/// 72 bytes a pose, and 84 for each covariance that is another one than that of the pose before.
std::string EncodePoses(std::span<const TimedPose> poses);

/// False if these are no bytes of `count` poses.
bool DecodePoses(std::string_view bytes, size_t count, std::vector<TimedPose>* poses);

}  // namespace dsg::ingest
