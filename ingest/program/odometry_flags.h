// SPDX-License-Identifier: Apache-2.0
// The flags of odometry: how the robot's poses are estimated from its images and inertial unit.
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/pipeline/odometry_log.h"

namespace CLI {
class App;
}  // namespace CLI

namespace dsg::ingest {

struct OdometryFlags {
  std::string method = "dvio";
  std::string masks = "on";
  /// Numbers alone; the rest is not used.
  OdometryOptions numbers;
};

void AddOdometryFlags(CLI::App* app, OdometryFlags* flags);

/// `is_on`: whether the poses are to be estimated; nullopt if not.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming a flag that says nothing unless they are.
absl::StatusOr<std::optional<OdometryLogOptions>> MakeOdometryOptions(const OdometryFlags& flags,
                                                                      bool is_on);

}  // namespace dsg::ingest
