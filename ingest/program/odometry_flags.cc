// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/odometry_flags.h"

#include <CLI/CLI.hpp>
#include <vector>

#include "ingest/config/option_flags.h"
#include "schema/base/status.h"

namespace dsg::ingest {

void AddOdometryFlags(CLI::App* app, OdometryFlags* flags) {
  const std::string group = "The robot's own odometry (--poses vio)";
  app->add_option("--odometry", flags->method,
                  "How features are checked between keyframes: 5pt (images alone), 2pt (the "
                  "rotation is the gyroscope's) or dvio (2pt, and the search follows the "
                  "gyroscope)")
      ->check(CLI::IsMember({"5pt", "2pt", "dvio"}))
      ->capture_default_str()
      ->group(group);
  app->add_option("--odometry-masks", flags->masks,
                  "Whether features on people are left out where label images show them: on, off")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str()
      ->group(group);
  app->add_option("--odometry-inertial", flags->inertial,
                  "Whether the inertial unit is used where the log has one; without it the poses "
                  "are those of images alone, and no --odometry method: on, off")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str()
      ->group(group);
  app->add_option(
         "--odometry-mesh", flags->mesh,
         "Join the landmarks of the odometry to a mesh of obstacles, and write that of the "
         "last keyframe to this new PLY file, in the frame of the poses, when the log ends")
      ->group(group);
  app->add_flag("--recognize", flags->is_recognizing,
                "Look for places seen before in the images of a sensor log, and correct the map by "
                "the loop closures found")
      ->group("Places seen again");
  AddTuning(std::vector<OptionGroup>{{"odometry", flags->numbers.Bind()},
                                     {"odometry mesh", flags->mesh_numbers.Bind()},
                                     {"places seen again", flags->recognition.Bind()}},
            app);
}

absl::StatusOr<std::optional<OdometryLogOptions>> MakeOdometryOptions(const OdometryFlags& flags,
                                                                      bool is_on) {
  const OdometryFlags defaults;
  if (!is_on) {
    if (flags.method != defaults.method) return NeedsOther("odometry", "poses vio");
    if (flags.masks != defaults.masks) return NeedsOther("odometry-masks", "poses vio");
    if (flags.inertial != defaults.inertial) return NeedsOther("odometry-inertial", "poses vio");
    if (!flags.mesh.empty()) return NeedsOther("odometry-mesh", "poses vio");
    return std::nullopt;
  }
  OdometryLogOptions options;
  options.odometry = flags.numbers;
  DSG_ASSIGN_OR_RETURN(options.odometry.method, ParseOdometryMethod(flags.method));
  options.is_masked = flags.masks == "on";
  options.is_inertial = flags.inertial == "on";
  if (!flags.mesh.empty()) options.mesh = OdometryMeshOptions{flags.mesh_numbers, flags.mesh, {}};
  return options;
}

std::optional<RecognizedLogOptions> MakeRecognitionOptions(const OdometryFlags& flags) {
  if (!flags.is_recognizing) return std::nullopt;
  RecognizedLogOptions options = flags.recognition;
  // Both look at one pair of images.
  options.stereo = flags.numbers.frontend.stereo;
  return options;
}

}  // namespace dsg::ingest
