// SPDX-License-Identifier: Apache-2.0
// dsg-simulate: the command line over the simulator library.
// Refuses to do anything but read options, show progress and print what was written.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <string>

#include "absl/strings/str_format.h"
#include "ingest/simulator/options.h"
#include "ingest/simulator/tracks_log.h"

namespace {

using dsg::simulator::TracksOptions;
using dsg::simulator::TracksSummary;

constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

/// Says on stderr how far a long run has come; quiet for the first two seconds.
class ProgressLine {
 public:
  void Show(double fraction) {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::milliseconds(500);
    shown_ = true;
    std::fprintf(stderr, is_terminal_ ? "\rsimulating %3.0f %%" : "simulating %3.0f %%\n",
                 100.0 * fraction);
  }
  ~ProgressLine() {
    if (shown_ && is_terminal_) std::fprintf(stderr, "\r                \r");
  }

 private:
  const bool is_terminal_ = isatty(STDERR_FILENO) != 0;
  std::chrono::steady_clock::time_point next_ =
      std::chrono::steady_clock::now() + std::chrono::seconds(2);
  bool shown_ = false;
};

void AddTracks(CLI::App* app, TracksOptions* options, std::string* world) {
  app->add_option("--out", options->out, "folder to write: log/, truth/, README.txt, preview.png")
      ->required();
  app->add_flag("--force", options->force, "write into a folder that holds something");
  app->add_option("--world", *world, "office or apartment")->capture_default_str();
  app->add_option("--seed", options->world.seed, "same seed, same bytes")->capture_default_str();
  app->add_option("--people", options->crowd.people_count, "0 to 10000; a robot is always there")
      ->capture_default_str();
  app->add_option("--seconds", options->crowd.duration_s, "1 to 86400")->capture_default_str();
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

void PrintSummary(const TracksOptions& options, const TracksSummary& summary) {
  std::cout << absl::StreamFormat(
      "%d rooms, %d objects, %d places\n"
      "%d people and a robot for %g s: %d poses, %d gaps, %d room visits\n"
      "wrote %.1f MB to %s; next: dsg-ingest --store DIR --map NAME %s/log\n",
      summary.room_count, summary.object_count, summary.place_count, summary.people_count,
      options.crowd.duration_s, summary.pose_count, summary.gap_count, summary.visit_count,
      static_cast<double>(summary.byte_count) * 1e-6, options.out, options.out);
}

absl::Status RunTracks(TracksOptions options, const std::string& world) {
  auto kind = dsg::simulator::ParseWorldKind(world);
  if (!kind.ok()) return kind.status();
  options.world.kind = *kind;
  absl::StatusOr<TracksSummary> summary;
  {
    ProgressLine line;
    summary =
        dsg::simulator::WriteTracks(options, [&line](double fraction) { line.Show(fraction); });
  }
  if (!summary.ok()) return summary.status();
  PrintSummary(options, *summary);
  return absl::OkStatus();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Generates seeded worlds and logs of what moves in them, with ground truth.",
               "dsg-simulate");
  app.set_version_flag("--version", DSG_VERSION);
  app.require_subcommand(1);
  TracksOptions options;
  std::string world = "office";
  CLI::App* tracks =
      app.add_subcommand("tracks", "People walking between rooms and a robot touring them");
  AddTracks(tracks, &options, &world);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitUsage;
  }
  const absl::Status status = RunTracks(options, world);
  if (status.ok()) return 0;
  std::cerr << "dsg-simulate: " << std::string(status.message()) << "\n";
  return kExitFailed;
}
