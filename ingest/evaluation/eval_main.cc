// SPDX-License-Identifier: Apache-2.0
// dsg-eval: a map of a store against the ground truth of the log it was made from, and
// trajectories, of a map or a file, against any ground truth.
// Refuses to change anything.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "ingest/config/option_flags.h"
#include "ingest/evaluation/bodies.h"
#include "ingest/evaluation/compare_tracks.h"
#include "ingest/evaluation/evaluate.h"
#include "ingest/evaluation/pose_file.h"
#include "ingest/evaluation/store_reader.h"
#include "ingest/truth/body_file.h"
#include "ingest/truth/truth.h"
#include "schema/base/status.h"
#include "schema/program/command_line.h"
#include "schema/program/manual.h"
#include "schema/store/graph_store.h"

namespace dsg::evaluation {
namespace {

constexpr char kStoreVariable[] = "DSG_STORE";
constexpr char kMapVariable[] = "DSG_MAP";
// The flags that only trajectories know; those of loop closures besides.
constexpr const char* kTrackFlags[] = {"--robot",     "--loops",       "--align",
                                       "--associate", "--tolerance",   "--reach",
                                       "--until",     "--rpe-lengths", "--rpe-seconds"};

struct Flags {
  std::string store;
  std::string map;
  int64_t mesh_samples = static_cast<int64_t>(MeshOptions().sample_count);
  bool is_json = false;
  bool is_map_aligned = false;
  bool is_track_only = false;
  TrackRequest track;
  double tolerance_s = static_cast<double>(kTruthGapNsMax) / static_cast<double>(kNsPerSecond);
  double reach_s = tolerance_s;
  std::vector<double> rpe_seconds = {1.0};
};

TimeNs NsOf(double seconds) {
  return static_cast<TimeNs>(std::llround(seconds * static_cast<double>(kNsPerSecond)));
}

/// CLI::Range lets "nan" pass.
CLI::Validator NumberIn(double min, double max) {
  return CLI::Validator(
      [min, max](const std::string& text) {
        double number = 0.0;
        const bool is_in = absl::SimpleAtod(text, &number) && number >= min && number <= max;
        return is_in ? std::string()
                     : absl::StrCat("\"", text, "\" is no number from ", min, " to ", max);
      },
      absl::StrCat("in [", min, " - ", max, "]"));
}

void AddMapFlags(CLI::App* app, Flags* flags) {
  app->set_version_flag("--version", DSG_VERSION);
  app->add_option("--store", flags->store, "Folder of the store")->envname(kStoreVariable);
  app->add_option("--map", flags->map, "Name of the map")->envname(kMapVariable);
  app->add_option(
         "--truth", flags->track.truth,
         "Folder \"truth\" beside the simulated log; or a true trajectory, which scores the "
         "robot's trajectory alone: a file of EuRoC's or TUM's columns or of KITTI's "
         "matrices, or a folder with state_groundtruth_estimate0 or groundtruth.txt")
      ->required();
  app->add_option("--revision", flags->track.revision, "Revision to score; default: the newest")
      ->check([](const std::string& text) {
        const bool is_number = text.find_first_not_of("0123456789") == std::string::npos;
        return is_number && text.find_first_of("123456789") != std::string::npos
                   ? std::string()
                   : "revision is \"" + text + "\"; it must be a whole number from 1 on";
      });
  app->add_option("--mesh-samples", flags->mesh_samples,
                  "Samples on each mesh; fewer is faster and coarser")
      ->check(CLI::Range(int64_t{1'000}, int64_t{20'000'000}))
      ->capture_default_str();
  app->add_flag("--align-map", flags->is_map_aligned,
                "Move the map first, by yaw and translation, to where the robot's path lies best "
                "on the true one: maps of odometry begin anywhere");
  app->add_flag("--json", flags->is_json, "Print JSON instead of tables");
}

template <typename Enum>
void AddChoice(const std::string& name, const std::vector<Enum>& values, const std::string& help,
               std::function<void(Enum)> set, CLI::App* app) {
  std::vector<std::string> names;
  names.reserve(values.size());
  for (const Enum value : values) names.emplace_back(NameOf(value));
  app->add_option_function<std::string>(
         name,
         [names, values, set](const std::string& text) {
           for (size_t i = 0; i < names.size(); ++i) {
             if (names[i] == text) set(values[i]);
           }
         },
         help)
      ->check(CLI::IsMember(names));
}

void AddTrackFlags(CLI::App* app, Flags* flags) {
  TrackRequest& track = flags->track;
  app->add_option("--estimate", track.estimate,
                  "Score the trajectory of this file, as --truth takes it, instead of a map's");
  app->add_flag("--trajectory", flags->is_track_only,
                "Score nothing but the trajectory, also against a simulated truth");
  app->add_option("--robot", track.robot, "Name or id of the robot; default: the map's first one");
  app->add_option("--loops", track.loops,
                  "Score the loop closures of this file (docs/sensor_logs.md), not the map's");
  AddChoice<Alignment>(
      "--align", {Alignment::kSe3, Alignment::kYaw, Alignment::kSim3, Alignment::kNone},
      "Motion that is forgiven: se3 (the default), yaw (and translation: gravity is known), sim3 "
      "(and a scale: a single camera), none",
      [&track](Alignment alignment) { track.options.alignment = alignment; }, app);
  AddChoice<Pairing>(
      "--associate", {Pairing::kInterpolate, Pairing::kNearest, Pairing::kRows},
      "The truth of a pose: interpolate (the default) at its stamp, nearest (pose in time), or "
      "rows (the first with the first and so on: the default for KITTI's matrices)",
      [&track](Pairing pairing) { track.pairing = pairing; }, app);
  app->add_option("--tolerance", flags->tolerance_s,
                  "Seconds between true poses that are interpolated, or to the nearest one, at "
                  "most; and by how much a stretch of --rpe-seconds may be longer")
      ->check(NumberIn(0.0, 1e6))
      ->capture_default_str();
  app->add_option("--reach", flags->reach_s,
                  "Seconds around a pose that it covers of the truth's time")
      ->check(NumberIn(0.0, 1e6))
      ->capture_default_str();
  app->add_option_function<double>(
         "--until", [&track](double seconds) { track.options.until_ns = NsOf(seconds); },
         "Score the first so many seconds of the truth; default: all of it")
      ->check(NumberIn(1e-3, 1e6));
  app->add_option("--rpe-lengths", track.options.rpe_lengths_m,
                  "Metres of true path over which relative errors are taken")
      ->delimiter(',')
      ->check(NumberIn(1e-3, 1e6))
      ->capture_default_str();
  app->add_option("--rpe-seconds", flags->rpe_seconds,
                  "Seconds over which relative errors are taken")
      ->delimiter(',')
      ->check(NumberIn(1e-3, 1e6))
      ->capture_default_str();
  ingest::UseShortHelp(app);
  const ingest::OptionGroup loops{"loop closures", track.options.loops.Bind()};
  ingest::AddTuning({&loops, 1}, app);
}

/// Whether it was given, and not only set in the environment.
bool IsGiven(const std::string& value, const char* variable) {
  const char* set = std::getenv(variable);
  return !value.empty() && (set == nullptr || value != set);
}

[[noreturn]] void Refuse(const std::string& option, const std::string& message) {
  throw CLI::ValidationError(option, message);
}

/// What CLI11's own checks cannot see. Throws CLI::ParseError.
void CheckTogether(const CLI::App& app, Flags* flags) {
  TrackRequest& track = flags->track;
  const bool has_file = app.count("--estimate") > 0;
  if (has_file && (IsGiven(flags->store, kStoreVariable) || IsGiven(flags->map, kMapVariable))) {
    Refuse("--estimate", "is a trajectory of its own; leave --store and --map out");
  }
  if (!has_file && flags->store.empty()) throw CLI::RequiredError("--store (or --estimate)");
  if (!has_file && flags->map.empty()) throw CLI::RequiredError("--map (or --estimate)");
  for (const char* flag : {"--revision", "--robot"}) {
    if (has_file && app.count(flag) > 0) Refuse(flag, "says nothing of --estimate; leave it out");
  }
  flags->is_track_only = flags->is_track_only || has_file || !IsSimulatedTruth(track.truth);
  if (flags->is_track_only) {
    for (const char* flag : {"--mesh-samples", "--align-map"}) {
      if (app.count(flag) > 0) Refuse(flag, "says nothing of trajectories; leave it out");
    }
  } else {
    std::vector<std::string> track_flags(std::begin(kTrackFlags), std::end(kTrackFlags));
    for (const auto& field : track.options.loops.Bind()) {
      track_flags.push_back(absl::StrCat("--", field.name));
    }
    for (const std::string& flag : track_flags) {
      if (app.count(flag) > 0) {
        Refuse(flag, "changes nothing of the whole report; give --trajectory too");
      }
    }
  }
  track.options.tolerance_ns = NsOf(flags->tolerance_s);
  track.options.reach_ns = NsOf(flags->reach_s);
  track.options.rpe_durations_ns.clear();
  for (const double seconds : flags->rpe_seconds) {
    track.options.rpe_durations_ns.push_back(NsOf(seconds));
  }
}

/// Tells on stderr what is going on, once it has taken two seconds.
class Status {
 public:
  void Update(const std::string& what, double fraction) {
    const auto now = std::chrono::steady_clock::now();
    if (now - told_ < std::chrono::seconds(is_terminal_ && is_told_ ? 0 : 2) && what == what_) {
      return;
    }
    what_ = what;
    if (now - begin_ < std::chrono::seconds(2)) return;
    std::fprintf(stderr, is_terminal_ ? "\r%3.0f %% %s\033[K" : "%3.0f %% %s\n", 100.0 * fraction,
                 what.c_str());
    std::fflush(stderr);
    told_ = now;
    is_told_ = true;
  }
  ~Status() {
    if (is_told_ && is_terminal_) std::fputs("\r\033[K", stderr);
  }

 private:
  const bool is_terminal_ = isatty(STDERR_FILENO) == 1;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point told_ = begin_;
  std::string what_;
  bool is_told_ = false;
};

/// A store and the map of it that is open.
struct OpenedMap {
  std::unique_ptr<GraphStore> store;
  std::shared_ptr<MapReader> map;
};

absl::StatusOr<OpenedMap> OpenMapOf(const Flags& flags) {
  DSG_RETURN_IF_ERROR(CheckMapName(flags.map));
  OpenedMap opened;
  DSG_ASSIGN_OR_RETURN(opened.store, OpenStore(flags.store, {.program = "dsg-eval"}));
  DSG_ASSIGN_OR_RETURN(opened.map, opened.store->OpenMap(flags.map));
  return opened;
}

absl::StatusOr<std::string> TrackOutput(const Flags& flags, const ProgressFunction& tell) {
  OpenedMap opened;
  if (flags.track.estimate.empty()) {
    DSG_ASSIGN_OR_RETURN(opened, OpenMapOf(flags));
  }
  DSG_ASSIGN_OR_RETURN(const TrackReport report,
                       CompareTracks(flags.track, opened.map.get(), tell));
  return flags.is_json ? TrackReportToJson(report) : TrackReportToText(report);
}

absl::StatusOr<std::string> WholeOutput(const Flags& flags, const ProgressFunction& tell) {
  DSG_ASSIGN_OR_RETURN(const OpenedMap opened, OpenMapOf(flags));
  tell("reading the truth", 0.0);
  DSG_ASSIGN_OR_RETURN(const truth::Truth truth, truth::ReadTruth(flags.track.truth));
  DSG_ASSIGN_OR_RETURN(Estimate estimate, ReadEstimate(*opened.map, flags.track.revision, tell));
  if (flags.is_map_aligned) DSG_RETURN_IF_ERROR(AlignMap(truth, &estimate));
  EvaluateOptions options;
  options.mesh.sample_count = static_cast<size_t>(flags.mesh_samples);
  Report report = Evaluate(estimate, truth, options, tell);
  DSG_ASSIGN_OR_RETURN(std::optional<truth::BodyFile> bodies,
                       truth::BodyFile::Open(flags.track.truth));
  DSG_RETURN_IF_ERROR(
      ScoreBodies(estimate, truth, bodies.has_value() ? &*bodies : nullptr, &report.humans));
  return flags.is_json ? ReportToJson(report) : ReportToText(report);
}

absl::Status Run(const Flags& flags) {
  std::string out;
  {
    Status status;
    const auto tell = [&status](const std::string& what, double fraction) {
      status.Update(what, fraction);
    };
    DSG_ASSIGN_OR_RETURN(out,
                         flags.is_track_only ? TrackOutput(flags, tell) : WholeOutput(flags, tell));
  }
  if (std::fwrite(out.data(), 1, out.size(), stdout) != out.size() || std::fflush(stdout) != 0) {
    return absl::UnavailableError("cannot write the report to standard output");
  }
  return absl::OkStatus();
}

int Main(int argc, char** argv) {
  CLI::App app(
      "dsg-eval: scores a map against the ground truth of a simulated log, or a trajectory against "
      "a true one",
      "dsg-eval");
  Flags flags;
  AddMapFlags(&app, &flags);
  AddTrackFlags(&app, &flags);
  AddManual(&app, DSG_VERSION);
  app.callback([&] { CheckTogether(app, &flags); });
  return RunProgram(argc, argv, &app, [&] { return Run(flags); });
}

}  // namespace
}  // namespace dsg::evaluation

int main(int argc, char** argv) { return dsg::evaluation::Main(argc, argv); }
