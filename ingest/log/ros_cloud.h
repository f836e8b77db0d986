// SPDX-License-Identifier: Apache-2.0
// sensor_msgs/PointCloud2: points of a lidar, as pixels of three floats.
// Refuses to know what a point has besides its place.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/ros_messages.h"
#include "ingest/sensor/image.h"

namespace dsg::ingest {

/// One row of kPoints32. Fields "x", "y" and "z" of 32 or 64 bit floats, wherever they stand in a
/// point, are read; points with a coordinate that is not finite are left out.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming `origin`: a message cut or of another definition,
/// a missing field or one of whole numbers, steps that do not fit the bytes, more than 16 M points.
absl::StatusOr<Image> ParseRosPointCloud(const RosBytes& message, const std::string& origin);

}  // namespace dsg::ingest
