// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/report.h"

#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "tests/bench/child_process.h"

namespace dsg::bench {
namespace {

// Three digits that mean something; more would only be noise.
std::string Digits(double value) {
  if (value >= 100.0) return absl::StrFormat("%.0f", value);
  if (value >= 10.0) return absl::StrFormat("%.1f", value);
  if (value >= 1.0) return absl::StrFormat("%.2f", value);
  return absl::StrFormat("%.3f", value);
}

std::string Text(const std::string& name, const std::string& unit, const Figure& figure) {
  std::string text = absl::StrCat(name, " ", Digits(figure.value));
  if (!unit.empty()) absl::StrAppend(&text, " ", unit);
  if (figure.p99.has_value()) absl::StrAppend(&text, " (p99 ", Digits(*figure.p99), ")");
  return text;
}

// What is compared with the target's value.
double Measured(const Target& target, double ours, double ratio) {
  switch (target.kind) {
    case Target::Kind::kRatioAtMost:
      return ratio;
    case Target::Kind::kFasterAtLeast:
      return 1.0 / ratio;
    default:
      return ours;
  }
}

bool IsMet(const Target& target, double measured) {
  const bool at_least =
      target.kind == Target::Kind::kAtLeast || target.kind == Target::Kind::kFasterAtLeast;
  return at_least ? measured >= target.value : measured <= target.value;
}

std::string Text(const Target& target, const std::string& unit) {
  const std::string value = absl::StrFormat("%g", target.value);
  switch (target.kind) {
    case Target::Kind::kNone:
      return "";
    case Target::Kind::kAtMost:
      return absl::StrCat(" (target: ours <= ", value, " ", unit, ")");
    case Target::Kind::kAtLeast:
      return absl::StrCat(" (target: ours >= ", value, " ", unit, ")");
    case Target::Kind::kRatioAtMost:
      return absl::StrCat(" (target <= ", value, ")");
    case Target::Kind::kFasterAtLeast:
      return absl::StrCat(" (target >= ", value, " times)");
  }
  return "";
}

std::string LoadText() {
  double load[1] = {0.0};
  return getloadavg(load, 1) == 1 ? absl::StrFormat("load %.1f", load[0]) : "load unknown";
}

int64_t NsOf(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return now.tv_sec * int64_t{1'000'000'000} + now.tv_nsec;
}

Figure Scaled(const Samples& samples, double ns_per_unit) {
  return {samples.Percentile(0.5) / ns_per_unit, samples.Percentile(0.99) / ns_per_unit};
}

}  // namespace

int64_t ThreadCpuNs() { return NsOf(CLOCK_THREAD_CPUTIME_ID); }

int64_t ProcessCpuNs() { return NsOf(CLOCK_PROCESS_CPUTIME_ID); }

double Samples::Percentile(double fraction) const {
  std::vector<int64_t> ns = ns_;
  const auto rank = static_cast<size_t>(fraction * static_cast<double>(ns.size()) + 0.999999);
  const auto at = ns.begin() + static_cast<std::ptrdiff_t>(std::max<size_t>(rank, 1) - 1);
  std::nth_element(ns.begin(), at, ns.end());
  return static_cast<double>(*at);
}

Figure Microseconds(const Samples& samples) { return Scaled(samples, 1e3); }
Figure Milliseconds(const Samples& samples) { return Scaled(samples, 1e6); }

void Report::Line(const std::string& what, const std::string& unit, const Figure& ours,
                  const std::optional<Rival>& rival, const Target& target) {
  std::string line = absl::StrCat(what, ": ", Text("ours", unit, ours));
  double ratio = 0.0;
  if (rival.has_value()) {
    ratio = ours.value / rival->figure.value;
    absl::StrAppend(&line, ", ", Text(rival->name, unit, rival->figure), ", ratio ",
                    absl::StrFormat(ratio < 0.1 ? "%.4f" : "%.2f", ratio));
    if (target.kind == Target::Kind::kFasterAtLeast) {
      absl::StrAppend(&line, ", ", Digits(1.0 / ratio), " times faster");
    }
  }
  absl::StrAppend(&line, Text(target, unit));
  if (target.kind != Target::Kind::kNone) {
    const bool met = IsMet(target, Measured(target, ours.value, ratio));
    absl::StrAppend(&line, met ? " PASS" : " MISSED");
    if (!met) ++missed_count_;
  }
  std::printf("%s\n", line.c_str());
  std::fflush(stdout);
}

void Report::Note(const std::string& text) const {
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);
}

void ShowProgress(const std::string& text) {
  static const auto start = std::chrono::steady_clock::now();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  std::fprintf(stderr, "  %6.1f s  %s\n", elapsed.count(), text.c_str());
}

int RunBenchmark(CLI::App* app, int argc, char** argv,
                 const std::function<absl::Status(const CommonOptions&, Report*)>& run) {
  int exit_code = 0;
  if (MeasureAsCopy(argc, argv, &exit_code)) return exit_code;
  CommonOptions options;
  options.folder = (std::filesystem::path(DSG_BINARY_DIR).parent_path() / "bench-data").string();
  app->add_flag("--strict", options.strict, "Exit with 1 when a target is missed");
  app->add_option("--folder", options.folder,
                  "Where stores are made (and removed); a folder in memory would flatter commits")
      ->capture_default_str();
  try {
    app->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app->exit(error) == 0 ? 0 : 2;
  }
  ShowProgress("started");
  Report report;
  report.Note(absl::StrCat(app->get_name(), ": ", std::thread::hardware_concurrency(), " cores, ",
                           LoadText(), " at the start"));
  const absl::Status status = run(options, &report);
  if (!status.ok()) {
    std::fprintf(stderr, "%s: %s\n", app->get_name().c_str(), status.ToString().c_str());
    return 2;
  }
  report.Note(absl::StrCat(app->get_name(), ": ", report.missed_count(), " targets missed, ",
                           LoadText(), " at the end"));
  return options.strict && report.missed_count() > 0 ? 1 : 0;
}

}  // namespace dsg::bench
