// SPDX-License-Identifier: Apache-2.0
// The robot's own shape: a CAD model that its node refers to.
// Refuses to fit it to anything; the model's origin is the robot's.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"

namespace dsg::ingest {

struct RobotModel {
  /// The file's bytes as they are.
  Asset asset;
  /// Around the model, robot's frame.
  Box3d box_robot;
};

/// PLY or OBJ, metres, in the robot's frame.
///
/// Errors: NOT_FOUND; INVALID_ARGUMENT/FILE_MALFORMED naming the file for another ending, a broken
/// or empty model, one over 64 MiB, and one of more than 50 m.
absl::StatusOr<RobotModel> ReadRobotModel(const std::string& path);

/// Makes `robot` refer to the model and gives it the model's box. The asset must be in the same
/// delta or an earlier one.
void SetRobotModel(const RobotModel& model, Node* robot);

}  // namespace dsg::ingest
