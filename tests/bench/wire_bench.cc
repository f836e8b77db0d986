// SPDX-License-Identifier: Apache-2.0
// The cost of the wire: every unary question to a running dsg-server beside an empty call plus the
// same question to an engine in this process, the mesh as a stream, many clients at once, readers
// that do not read, and how soon cancelled work ends. Refuses to count a question that failed.
#include <filesystem>
#include <string>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/wire_cancel.h"
#include "tests/bench/wire_client.h"
#include "tests/bench/wire_costs.h"
#include "tests/bench/wire_mesh.h"
#include "tests/bench/wire_mix.h"
#include "tests/bench/wire_questions.h"
#include "tests/bench/wire_server.h"
#include "tests/bench/wire_silent.h"
#include "tests/bench/wire_world.h"

namespace dsg::bench {
namespace {

struct Flags {
  int call_count = 1000;
  int block_count = 800;
  int cancel_count = 10;
  bool tcp = false;
  QuestionFilter filter;
  MixOptions mix;
};

absl::Status MeasureServer(const Flags& flags, const WirePlace& place, Report* report) {
  DSG_ASSIGN_OR_RETURN(const WireServer server, StartWireServer(place));
  DSG_ASSIGN_OR_RETURN(const WireClient client, Connect(server.address));
  report->Note(absl::StrCat("the server listens on ", server.address));
  if (flags.call_count > 0) {
    DSG_RETURN_IF_ERROR(MeasureQuestions(QuestionsWanted(flags.filter), flags.call_count,
                                         place.store, server, client, report));
    ShowProgress("questions done");
  }
  if (flags.block_count > 0) {
    DSG_RETURN_IF_ERROR(MeasureMesh(flags.block_count, client, report));
    DSG_RETURN_IF_ERROR(MeasureSilentReaders(server, client, report));
    ShowProgress("mesh and silent readers done");
  }
  if (flags.mix.seconds > 0) {
    DSG_RETURN_IF_ERROR(MeasureMix(flags.filter, flags.mix, server.address, report));
    ShowProgress("mix done");
  }
  return absl::OkStatus();
}

absl::Status Run(const Flags& flags, const CommonOptions& common, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "wire"));
  // The path of a socket has at most 107 characters; the temporary folder's is short.
  DSG_ASSIGN_OR_RETURN(const auto socket_folder,
                       ScratchFolder::Make(std::filesystem::temp_directory_path(), "dsg-bench"));
  DSG_RETURN_IF_ERROR(MakeWireWorld(folder->path(), flags.block_count));
  ShowProgress("store is made");
  const WirePlace place{
      folder->path(),
      flags.tcp ? "127.0.0.1:0" : absl::StrCat("unix:", socket_folder->path(), "/server.sock")};
  DSG_RETURN_IF_ERROR(MeasureServer(flags, place, report));
  if (flags.cancel_count == 0) return absl::OkStatus();
  return MeasureCancels(place, flags.cancel_count, report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  int exit_code = 0;
  if (dsg::bench::BeSilentReaders(argc, argv, &exit_code)) return exit_code;
  dsg::bench::Flags flags;
  CLI::App app("Every question over the wire of a running dsg-server.", "wire_bench");
  app.add_option("--calls", flags.call_count, "Calls of each question, 0 = none")
      ->capture_default_str();
  app.add_option("--only", flags.filter.only, "Questions whose name has this");
  app.add_option("--except", flags.filter.except, "Not questions whose name has this");
  app.add_option("--blocks", flags.block_count, "Mesh blocks, 0 = no mesh")->capture_default_str();
  app.add_option("--clients", flags.mix.client_count, "Clients at once")->capture_default_str();
  app.add_option("--seconds", flags.mix.seconds, "How long they ask, 0 = not")
      ->capture_default_str();
  app.add_option("--cancels", flags.cancel_count, "Cancels of each long question, 0 = none")
      ->capture_default_str();
  app.add_flag("--tcp", flags.tcp, "TCP on 127.0.0.1 instead of a unix socket");
  return dsg::bench::RunBenchmark(
      &app, argc, argv, [&](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(flags, common, report);
      });
}
