// SPDX-License-Identifier: Apache-2.0
// dsg-simulate: the command line over the simulator's libraries.
// Refuses to do anything but choose the verb and print its error.
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ingest/simulator/cli/command.h"
#include "schema/base/allocator.h"
#include "schema/program/command_line.h"
#include "schema/program/manual.h"

namespace {

using dsg::simulator::Command;

constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

}  // namespace

int main(int argc, char** argv) {
  // Images.
  dsg::KeepFreedMemory(size_t{64} << 20);
  CLI::App app("Generates seeded worlds and logs of what moves in them, with ground truth.",
               "dsg-simulate");
  app.set_version_flag("--version", DSG_VERSION);
  app.require_subcommand(1);
  dsg::UseVerbUsage(&app);
  CLI::App* tracks =
      app.add_subcommand("tracks", "People walking between rooms and a robot touring them");
  CLI::App* sensors = app.add_subcommand(
      "sensors", "What a robot's cameras and inertial unit record in a building with people");
  CLI::App* drift = app.add_subcommand(
      "drift", "Drifting odometry and loop closures, right and wrong, beside a sensor log");
  CLI::App* preview = app.add_subcommand("preview", "Pictures of a sensor log, to look at");
  const std::vector<std::pair<CLI::App*, Command>> commands = {
      {tracks, dsg::simulator::AddTracksCommand(tracks)},
      {sensors, dsg::simulator::AddSensorsCommand(sensors)},
      {drift, dsg::simulator::AddDriftCommand(drift)},
      {preview, dsg::simulator::AddPreviewCommand(preview)}};
  for (const auto& [verb, command] : commands) verb->group("Verbs");
  dsg::AddManual(&app, DSG_VERSION);
  if (const std::optional<int> end = dsg::ReadCommandLine(argc, argv, &app)) return *end;
  for (const auto& [verb, command] : commands) {
    if (!verb->parsed()) continue;
    const absl::Status status = command();
    if (status.ok()) return 0;
    dsg::TellError("dsg-simulate", std::string(status.message()));
    if (absl::IsInvalidArgument(status)) return kExitUsage;
  }
  return kExitFailed;
}
