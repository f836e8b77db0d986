// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/people_flags.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
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
}

namespace {

absl::Status SetDetector(const PeopleFlags& flags, PeopleOptions* options) {
  PersonDetectorOptions detector;
  detector.model_file = flags.detector_file;
  detector.score_min = flags.detector_score;
  detector.input_width_px = detector.input_height_px = flags.detector_size_px;
  detector.person_class = flags.detector_class;
  options->detector = detector;
  // Read once to know it, and to say early when it cannot be used.
  DSG_RETURN_IF_ERROR(PersonDetector::Load(detector).status());
  DSG_ASSIGN_OR_RETURN(options->detector_sha256, Sha256OfFile(flags.detector_file));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PeopleOptions> MakePeopleOptions(const PeopleFlags& flags) {
  PeopleOptions options;
  if (flags.people == "paper") options = PeopleOptions::Paper();
  options.is_on = flags.people != "off";
  if (flags.has_no_depth) options.cues.is_depth_used = false;
  options.floor_z_m = flags.floor_z_m;
  DSG_RETURN_IF_ERROR(options.Validate());
  if (!flags.detector_file.empty()) DSG_RETURN_IF_ERROR(SetDetector(flags, &options));
  return options;
}

void PrintPeople(const std::string& path, const PeopleSummary& summary, bool has_timings) {
  const PeopleCounts& counts = summary.counts;
  std::printf("%s: %lld of %lld detections of people used, %lld tracks", path.c_str(),
              static_cast<long long>(counts.used_count),
              static_cast<long long>(counts.detection_count),
              static_cast<long long>(counts.track_count));
  if (counts.dropped_track_count > 0) {
    std::printf(" and %lld too short to believe",
                static_cast<long long>(counts.dropped_track_count));
  }
  if (counts.same_as_count > 0) {
    std::printf(", %lld of them perhaps the same person",
                static_cast<long long>(counts.same_as_count));
  }
  std::vector<std::string> rejected;
  for (const auto& [reason, count] : counts.rejected) {
    rejected.push_back(absl::StrCat(reason, " ", count));
  }
  if (!rejected.empty()) std::printf("; left out: %s", absl::StrJoin(rejected, ", ").c_str());
  std::printf("\n");
  if (has_timings) {
    for (const auto& [stage, time] : summary.stages) {
      std::printf("%-12s %8lld %10.2f %12.2f %12.2f\n", stage.c_str(),
                  static_cast<long long>(time.count), time.total_s,
                  1e3 * time.total_s / static_cast<double>(time.count), 1e3 * time.longest_s);
    }
  }
  std::fflush(stdout);
}

}  // namespace dsg::ingest
