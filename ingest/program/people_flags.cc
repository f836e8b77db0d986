// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/people_flags.h"

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/config/option_flags.h"
#include "ingest/log/log_digest.h"
#include "schema/base/status.h"

namespace dsg::ingest {

void AddPeopleFlags(CLI::App* app, PeopleFlags* flags) {
  const std::string group = "People (logs with detections)";
  app->add_option(
         "--people", flags->people,
         "How people are tracked: smooth, paper (zero-velocity links and detections alone) "
         "or off (detections mask people and make no tracks)")
      ->check(CLI::IsMember({"smooth", "paper", "off"}))
      ->capture_default_str()
      ->group(group);
  app->add_flag("--no-people-depth", flags->has_no_depth,
                "Place people by their detections and the floor, not by depth images")
      ->group(group);
  app->add_option("--floor-z", flags->floor_z_m,
                  "Height of the floor that people stand on, metres; otherwise the map's floors, "
                  "or 0")
      ->group(group);
  app->add_option("--detector", flags->detector_file,
                  "Network that finds people in the images (ONNX), instead of the log's detections")
      ->group(group);
  app->add_option("--detector-score", flags->detector_score, "Least score of a box")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group(group);
  app->add_option("--detector-size", flags->detector_size_px,
                  "Edge of the square picture that the network takes, pixels")
      ->check(CLI::Range(32, 4096))
      ->capture_default_str()
      ->group(group);
  app->add_option("--detector-class", flags->detector_class,
                  "Number of \"person\" among its classes")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str()
      ->group(group);
  AddTuning(flags->numbers.Groups(), app);
}

namespace {

// What only a detector would read: without one it would be ignored.
absl::Status CheckWithoutDetector(const PeopleFlags& flags) {
  const PeopleFlags defaults;
  std::string flag;
  if (flags.detector_score != defaults.detector_score) flag = "detector-score";
  if (flags.detector_size_px != defaults.detector_size_px) flag = "detector-size";
  if (flags.detector_class != defaults.detector_class) flag = "detector-class";
  if (flags.numbers.look.period_ns != defaults.numbers.look.period_ns) flag = "person-look-period";
  if (flags.numbers.look.overlap_max != defaults.numbers.look.overlap_max) {
    flag = "person-look-overlap";
  }
  return flag.empty() ? absl::OkStatus() : NeedsOther(flag, "detector");
}

absl::Status SetDetector(const PeopleFlags& flags, PeopleOptions* options) {
  PersonDetectorOptions detector;
  detector.model_file = flags.detector_file;
  detector.score_min = flags.detector_score;
  detector.input_width_px = detector.input_height_px = flags.detector_size_px;
  detector.person_class = flags.detector_class;
  detector.overlap_max = options->look.overlap_max;
  options->detector = detector;
  // Read once to know it, and to say early when it cannot be used.
  DSG_RETURN_IF_ERROR(PersonDetector::Load(detector).status());
  DSG_ASSIGN_OR_RETURN(options->detector_sha256, Sha256OfFile(flags.detector_file));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PeopleOptions> MakePeopleOptions(const PeopleFlags& flags) {
  PeopleOptions options = flags.numbers;
  if (flags.people == "paper") options.MakePaper();
  options.is_on = flags.people != "off";
  if (flags.has_no_depth) options.cues.is_depth_used = false;
  options.floor_z_m = flags.floor_z_m;
  DSG_RETURN_IF_ERROR(options.Validate());
  if (flags.detector_file.empty()) {
    DSG_RETURN_IF_ERROR(CheckWithoutDetector(flags));
  } else {
    DSG_RETURN_IF_ERROR(SetDetector(flags, &options));
  }
  return options;
}

}  // namespace dsg::ingest
