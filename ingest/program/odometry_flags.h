// SPDX-License-Identifier: Apache-2.0
// The flags of what is found in images of the robot's path: its poses, and places seen again.
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/pipeline/odometry_log.h"
#include "ingest/pipeline/recognized_log.h"

namespace CLI {
class App;
}  // namespace CLI

namespace dsg::ingest {

struct OdometryFlags {
  std::string method = "dvio";
  std::string masks = "on";
  std::string inertial = "on";
  /// Numbers alone; the rest is not used.
  OdometryOptions numbers;
  /// A file; empty = no mesh.
  std::string mesh;
  MesherOptions mesh_numbers;
  bool is_recognizing = false;
  RecognizedLogOptions recognition;
};

void AddOdometryFlags(CLI::App* app, OdometryFlags* flags);

/// `is_on`: whether the poses are to be estimated; nullopt if not.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming a flag that says nothing unless they are.
absl::StatusOr<std::optional<OdometryLogOptions>> MakeOdometryOptions(const OdometryFlags& flags,
                                                                      bool is_on);

/// nullopt without --recognize.
std::optional<RecognizedLogOptions> MakeRecognitionOptions(const OdometryFlags& flags);

}  // namespace dsg::ingest
