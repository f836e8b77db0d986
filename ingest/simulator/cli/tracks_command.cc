// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/tracks/tracks_log.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "absl/strings/str_format.h"
#include "ingest/simulator/cli/command.h"
#include "ingest/simulator/cli/progress_line.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

struct TracksArguments {
  TracksOptions options;
  std::string world = "wing";
};

void AddTracks(CLI::App* app, TracksOptions* options, std::string* world) {
  app->add_option("--out", options->out, "folder to write: log/, truth/, README.txt, preview.png")
      ->required();
  app->add_flag("--force", options->force, "write into a folder that holds something");
  app->add_option("--world", *world, "office, wing or apartment")->capture_default_str();
  app->add_option("--seed", options->world.seed, "same seed, same bytes")->capture_default_str();
  app->add_option("--people,--humans", options->crowd.people_count,
                  "0 to 10000; a robot is always there")
      ->capture_default_str();
  app->add_option("--seconds", options->crowd.duration_s, "1 to 86400")->capture_default_str();
  app->add_option("--picks", options->pick_count,
                  "things that people take away, 0 to 1000: their validity ends")
      ->capture_default_str();
  app->add_option("--rate", options->sensor.rate_hz, "samples a second of each agent, 0.1 to 200")
      ->capture_default_str();
  app->add_option("--noise-m", options->sensor.position_noise_m,
                  "standard deviation of positions, metres")
      ->capture_default_str();
  app->add_option("--noise-yaw", options->sensor.yaw_noise_rad,
                  "standard deviation of headings, radians")
      ->capture_default_str();
  app->add_option("--jitter-s", options->sensor.clock_jitter_s,
                  "standard deviation of the instants of sampling, seconds")
      ->capture_default_str();
  app->add_option("--gap-rate", options->sensor.gap_rate_per_min,
                  "track losses of a person a minute, 0 to 60")
      ->capture_default_str();
}

void PrintTracksSummary(const TracksOptions& options, const TracksSummary& summary) {
  std::cout << absl::StreamFormat(
      "%d rooms, %d objects, %d places\n"
      "%d people and a robot for %g s: %d poses, %d gaps, %d room visits\n"
      "wrote %.1f MB to %s; next: dsg-ingest --store DIR --map NAME %s/log\n",
      summary.room_count, summary.object_count, summary.place_count, summary.people_count,
      options.crowd.duration_s, summary.pose_count, summary.gap_count, summary.visit_count,
      static_cast<double>(summary.byte_count) * 1e-6, options.out, options.out);
}

void NoteMissingPicks(const TracksOptions& options, const TracksSummary& summary) {
  if (summary.pick_count >= options.pick_count) return;
  std::cerr << absl::StreamFormat(
      "dsg-simulate: note: people take %d things away, not the %d of --picks: they stand beside no "
      "more small ones for long enough; give more --people or --seconds\n",
      summary.pick_count, options.pick_count);
}

absl::Status RunTracks(TracksOptions options, const std::string& world) {
  DSG_ASSIGN_OR_RETURN(options.world.kind, ParseWorldKind(world));
  absl::StatusOr<TracksSummary> summary;
  {
    ProgressLine line;
    summary = WriteTracks(options, [&line](double fraction) { line.Show("simulating", fraction); });
  }
  if (!summary.ok()) return summary.status();
  PrintTracksSummary(options, *summary);
  NoteMissingPicks(options, *summary);
  return absl::OkStatus();
}

}  // namespace

Command AddTracksCommand(CLI::App* app) {
  auto arguments = std::make_shared<TracksArguments>();
  AddTracks(app, &arguments->options, &arguments->world);
  return [arguments] { return RunTracks(arguments->options, arguments->world); };
}

}  // namespace dsg::simulator
