// SPDX-License-Identifier: Apache-2.0
// dsg-optimize: pose graphs of g2o files, optimised.
// Refuses to write anything but the file it is told to.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ingest/config/option_flags.h"
#include "ingest/loop/g2o_file.h"
#include "ingest/loop/optimize.h"
#include "ingest/loop/robust.h"
#include "schema/base/status.h"
#include "schema/program/command_line.h"
#include "schema/program/manual.h"

namespace dsg::ingest {
namespace {

using SteadyClock = std::chrono::steady_clock;

struct Flags {
  std::string file;
  std::string out;
  std::string objective = "se-sync";
  std::string start = "chordal";
  // Small graphs of large residuals take hundreds of steps, each of no time.
  int iteration_count_max = 500;
  bool is_robust = false;
  bool is_json = false;
  /// Numbers of RobustOptions::Bind alone; the rest is not used.
  RobustOptions numbers;
};

struct Report {
  Flags flags;
  double seconds = 0.0;
  double cost_se_sync = 0.0;
  int64_t loop_count = 0;
  int64_t kept_count = 0;
  /// Of the file's graph.
  std::vector<const RelativePose*> rejected;
};

void AddFlags(CLI::App* app, Flags* flags) {
  app->set_version_flag("--version", DSG_VERSION);
  app->add_option("FILE", flags->file, "Pose graph, planar or spatial, as g2o writes it")
      ->required();
  app->add_flag("--robust", flags->is_robust, "Leave out loop closures that do not fit the others");
  app->add_option("--out", flags->out,
                  "Write the optimised graph here, without the loops that were rejected");
  app->add_flag("--json", flags->is_json, "Print JSON instead of lines");
  app->add_option("--objective", flags->objective,
                  "What is minimised: se-sync (one weight for the rotation and one for the "
                  "translation of each edge), geodesic (whole information matrices), or g2o (the "
                  "same, rotations as the vector part of quaternions)")
      ->check(CLI::IsMember({"se-sync", "geodesic", "g2o"}))
      ->capture_default_str();
  app->add_option("--start", flags->start,
                  "Where to begin: chordal (found from the edges) or file (its VERTEX lines)")
      ->check(CLI::IsMember({"chordal", "file"}))
      ->capture_default_str();
  app->add_option("--iterations", flags->iteration_count_max, "At most so many steps")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str();
  UseShortHelp(app);
  const OptionGroup judged{"loop closures (--robust)", flags->numbers.Bind()};
  AddTuning({&judged, 1}, app);
}

/// One line on a terminal, once it has taken two seconds.
class Progress {
 public:
  void Update(int iteration, double cost) {
    if (IsDue()) Show(absl::StrFormat("step %d, cost %.6g", iteration, cost));
  }
  void Update(const char* what, int64_t done, int64_t total) {
    if (IsDue()) Show(absl::StrFormat("%s, %d of %d", what, done, total));
  }
  ~Progress() {
    if (is_shown_) std::fputs("\r\033[K", stderr);
  }

 private:
  bool IsDue() {
    const auto now = SteadyClock::now();
    if (!is_terminal_ || now < next_) return false;
    next_ = now + std::chrono::milliseconds(200);
    return true;
  }
  void Show(const std::string& line) {
    std::fprintf(stderr, "\r%s\033[K", line.c_str());
    std::fflush(stderr);
    is_shown_ = true;
  }

  const bool is_terminal_ = isatty(STDERR_FILENO) == 1;
  SteadyClock::time_point next_ = SteadyClock::now() + std::chrono::seconds(2);
  bool is_shown_ = false;
};

PoseObjective ObjectiveOf(const std::string& name) {
  if (name == "geodesic") return PoseObjective::kGeodesic;
  return name == "g2o" ? PoseObjective::kQuaternion : PoseObjective::kSeSync;
}

// Whether a loop fits is asked of its whole information; SE-Sync's weights count rotations of
// planar graphs twice, and would find faults with good loops.
absl::StatusOr<RobustResult> SolveRobustly(const PoseGraph& graph, RobustOptions options) {
  const PoseObjective objective = options.optimize.objective;
  options.optimize.objective = PoseObjective::kGeodesic;
  DSG_ASSIGN_OR_RETURN(RobustResult result, OptimizeRobustly(graph, options));
  if (objective == PoseObjective::kGeodesic) return result;
  options.optimize.objective = objective;
  for (const bool is_kept : result.is_kept) {
    options.optimize.weights.push_back(is_kept ? 1.0 : 0.0);
  }
  DSG_ASSIGN_OR_RETURN(result.optimized, Optimize(graph, options.optimize));
  return result;
}

absl::StatusOr<RobustResult> SolveRobustly(const Flags& flags, const G2oFile& file) {
  Progress progress;
  RobustOptions options = flags.numbers;
  options.optimize.objective = ObjectiveOf(flags.objective);
  options.optimize.is_chordal_start = flags.start == "chordal";
  options.optimize.fixed_pose = file.fixed_pose;
  options.optimize.iteration_count_max = flags.iteration_count_max;
  options.optimize.on_iteration = [&progress](int iteration, double cost) {
    progress.Update(iteration, cost);
  };
  options.on_work = [&progress](const char* what, int64_t done, int64_t total) {
    progress.Update(what, done, total);
  };
  if (flags.is_robust) return SolveRobustly(file.graph, options);
  RobustResult result;
  DSG_ASSIGN_OR_RETURN(result.optimized, Optimize(file.graph, options.optimize));
  result.is_kept.assign(file.graph.edges.size(), true);
  return result;
}

Report ReportOf(const Flags& flags, const PoseGraph& graph, const RobustResult& result) {
  Report report{.flags = flags};
  std::vector<double> weights;
  weights.reserve(graph.edges.size());
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    weights.push_back(result.is_kept[i] ? 1.0 : 0.0);
    report.loop_count += graph.edges[i].is_loop ? 1 : 0;
    report.kept_count += graph.edges[i].is_loop && result.is_kept[i] ? 1 : 0;
    if (!result.is_kept[i]) report.rejected.push_back(&graph.edges[i]);
  }
  report.cost_se_sync =
      2.0 * CostOf(graph, result.optimized.poses, weights, PoseObjective::kSeSync);
  return report;
}

std::string ToJson(const Report& report, const G2oFile& file, const Optimized& optimized) {
  nlohmann::ordered_json json;
  json["cost"] = optimized.cost;
  json["cost_se_sync"] = report.cost_se_sync;
  json["start_cost"] = optimized.start_cost;
  json["iterations"] = optimized.iteration_count;
  json["seconds"] = report.seconds;
  json["converged"] = optimized.is_converged;
  json["poses"] = file.graph.poses.size();
  json["edges"] = file.graph.edges.size();
  json["loops"] = report.loop_count;
  json["kept_loops"] = report.kept_count;
  json["rejected_loops"] = report.loop_count - report.kept_count;
  json["rejected"] = nlohmann::ordered_json::array();
  for (const RelativePose* edge : report.rejected) {
    json["rejected"].push_back({{"from", file.graph.ids[static_cast<size_t>(edge->from)]},
                                {"to", file.graph.ids[static_cast<size_t>(edge->to)]},
                                {"line", edge->line}});
  }
  json["skipped"] = nlohmann::ordered_json::object();
  for (const auto& [reason, count] : file.skipped) json["skipped"][reason] = count;
  json["objective"] = report.flags.objective;
  return json.dump(2) + "\n";
}

std::string ToText(const Report& report, const G2oFile& file, const Optimized& optimized) {
  std::string text;
  absl::StrAppendFormat(&text, "cost            %.9g\n", optimized.cost);
  absl::StrAppendFormat(&text, "cost_se_sync    %.9g\n", report.cost_se_sync);
  absl::StrAppendFormat(&text, "start_cost      %.9g\n", optimized.start_cost);
  absl::StrAppendFormat(&text, "iterations      %d%s\n", optimized.iteration_count,
                        optimized.is_converged ? "" : " (not converged)");
  absl::StrAppendFormat(&text, "seconds         %.3f\n", report.seconds);
  absl::StrAppendFormat(&text, "poses           %d\n", file.graph.poses.size());
  absl::StrAppendFormat(&text, "edges           %d\n", file.graph.edges.size());
  absl::StrAppendFormat(&text, "kept_loops      %d\n", report.kept_count);
  absl::StrAppendFormat(&text, "rejected_loops  %d\n", report.loop_count - report.kept_count);
  int64_t skipped_count = 0;
  for (const auto& [reason, count] : file.skipped) skipped_count += count;
  absl::StrAppendFormat(&text, "skipped_lines   %d\n", skipped_count);
  for (const auto& [reason, count] : file.skipped) {
    absl::StrAppendFormat(&text, "  %s: %d\n", reason, count);
  }
  return text;
}

absl::Status WriteResult(const std::string& path, PoseGraph graph, const RobustResult& result) {
  graph.poses = result.optimized.poses;
  std::vector<RelativePose> kept;
  for (size_t i = 0; i < graph.edges.size(); ++i) {
    if (result.is_kept[i]) kept.push_back(graph.edges[i]);
  }
  graph.edges = std::move(kept);
  return WriteG2o(graph, path);
}

// What only --robust reads: without it it would be ignored.
absl::Status CheckWithoutRobust(const Flags& flags) {
  RobustOptions numbers = flags.numbers;
  RobustOptions defaults;
  const std::vector<BoundOption> given = numbers.Bind();
  const std::vector<BoundOption> usual = defaults.Bind();
  for (size_t i = 0; i < given.size(); ++i) {
    if (given[i].Get() != usual[i].Get()) return NeedsOther(given[i].name, "robust");
  }
  return absl::OkStatus();
}

absl::Status OptimizeFile(const Flags& flags) {
  if (!flags.is_robust) DSG_RETURN_IF_ERROR(CheckWithoutRobust(flags));
  DSG_ASSIGN_OR_RETURN(const G2oFile file, ReadG2o(flags.file));
  for (const std::string& note : file.notes) {
    TellNote(flags.file, note);
  }
  if (flags.start == "file" && !file.has_start) {
    TellNote(flags.file, "no VERTEX lines; beginning with poses along the edges");
  }
  std::error_code ignored;
  if (!flags.out.empty() && std::filesystem::equivalent(flags.out, flags.file, ignored)) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("--out ", flags.out, " is the file that is read; give another name"),
        {{"field", "out"}, {"value", flags.out}});
  }
  if (std::filesystem::exists(flags.out, ignored) &&
      !std::filesystem::is_regular_file(flags.out, ignored)) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("--out ", flags.out, " is no file; give the name of one"),
                     {{"field", "out"}, {"value", flags.out}});
  }
  const auto begin = SteadyClock::now();
  DSG_ASSIGN_OR_RETURN(const RobustResult result, SolveRobustly(flags, file));
  const std::chrono::duration<double> elapsed = SteadyClock::now() - begin;
  if (!flags.out.empty()) DSG_RETURN_IF_ERROR(WriteResult(flags.out, file.graph, result));
  Report report = ReportOf(flags, file.graph, result);
  report.seconds = elapsed.count();
  const std::string out = flags.is_json ? ToJson(report, file, result.optimized)
                                        : ToText(report, file, result.optimized);
  if (std::fwrite(out.data(), 1, out.size(), stdout) != out.size() || std::fflush(stdout) != 0) {
    return absl::UnavailableError("cannot write the figures to standard output");
  }
  return absl::OkStatus();
}

int Main(int argc, char** argv) {
  CLI::App app("dsg-optimize: finds the poses that agree best with what was measured between them",
               "dsg-optimize");
  Flags flags;
  AddFlags(&app, &flags);
  AddManual(&app, DSG_VERSION);
  return RunProgram(argc, argv, &app, [&] { return OptimizeFile(flags); });
}

}  // namespace
}  // namespace dsg::ingest

int main(int argc, char** argv) {
  // A file over the limit of the shell is a failed write with a message, not a sudden end.
  std::signal(SIGXFSZ, SIG_IGN);
  return dsg::ingest::Main(argc, argv);
}
