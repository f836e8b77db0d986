// SPDX-License-Identifier: Apache-2.0
// dsg-eval: a map of a store against the ground truth of the log it was made from.
// Refuses to change anything.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "ingest/evaluation/evaluate.h"
#include "ingest/evaluation/store_reader.h"
#include "ingest/truth/truth.h"
#include "schema/base/exit_code.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::evaluation {
namespace {

struct Flags {
  std::string store;
  std::string map;
  std::string truth;
  Revision revision = 0;
  int64_t mesh_samples = static_cast<int64_t>(MeshOptions().sample_count);
  bool is_json = false;
};

void AddFlags(CLI::App* app, Flags* flags) {
  app->set_version_flag("--version", DSG_VERSION);
  app->add_option("--store", flags->store, "Folder of the store")->envname("DSG_STORE")->required();
  app->add_option("--map", flags->map, "Name of the map")->envname("DSG_MAP")->required();
  app->add_option("--truth", flags->truth, "Folder \"truth\" beside the simulated log")->required();
  app->add_option("--revision", flags->revision, "Revision to score; default: the newest")
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
  app->add_flag("--json", flags->is_json, "Print JSON instead of tables");
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

absl::Status Run(const Flags& flags) {
  DSG_RETURN_IF_ERROR(CheckMapName(flags.map));
  DSG_ASSIGN_OR_RETURN(const auto store, OpenStore(flags.store, {.program = "dsg-eval"}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(flags.map));
  Report report;
  {
    Status status;
    const auto tell = [&status](const std::string& what, double fraction) {
      status.Update(what, fraction);
    };
    tell("reading the truth", 0.0);
    DSG_ASSIGN_OR_RETURN(const truth::Truth truth, truth::ReadTruth(flags.truth));
    DSG_ASSIGN_OR_RETURN(const Estimate estimate, ReadEstimate(*map, flags.revision, tell));
    EvaluateOptions options;
    options.mesh.sample_count = static_cast<size_t>(flags.mesh_samples);
    report = Evaluate(estimate, truth, options, tell);
  }
  const std::string out = flags.is_json ? ReportToJson(report) : ReportToText(report);
  if (std::fwrite(out.data(), 1, out.size(), stdout) != out.size() || std::fflush(stdout) != 0) {
    return absl::UnavailableError("cannot write the report to standard output");
  }
  return absl::OkStatus();
}

ExitCode ReportError(const absl::Status& status) {
  if (status.ok()) return kDone;
  std::fprintf(stderr, "dsg-eval: %s: %s\n",
               std::string(absl::StatusCodeToString(status.code())).c_str(),
               std::string(status.message()).c_str());
  return ExitCodeOf(status);
}

int Main(int argc, char** argv) {
  CLI::App app("dsg-eval: scores a map against the ground truth of a simulated log", "dsg-eval");
  Flags flags;
  AddFlags(&app, &flags);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  return ReportError(Run(flags));
}

}  // namespace
}  // namespace dsg::evaluation

int main(int argc, char** argv) {
  const int code = dsg::evaluation::Main(argc, argv);
  return code == dsg::kDone ? dsg::evaluation::ReportError(dsg::FinishOutput()) : code;
}
