// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "ingest/simulator/cli/command.h"
#include "ingest/simulator/sensors/contact_sheet.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

struct PreviewArguments {
  std::string folder;
  std::string out;
  int count = 4;
};

absl::Status RunPreview(const PreviewArguments& arguments) {
  const std::string out = arguments.out.empty() ? arguments.folder + "/preview" : arguments.out;
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> paths,
                       WriteContactSheet(arguments.folder, arguments.count, out));
  for (const std::string& path : paths) std::cout << "wrote " << path << "\n";
  return absl::OkStatus();
}

}  // namespace

Command AddPreviewCommand(CLI::App* app) {
  auto arguments = std::make_shared<PreviewArguments>();
  app->add_option("folder", arguments->folder, "what `dsg-simulate sensors --out` was given")
      ->required();
  app->add_option("--out", arguments->out, "folder for the pictures; FOLDER/preview if not given");
  app->add_option("--count", arguments->count, "instants to show, 1 to 20")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  return [arguments] { return RunPreview(*arguments); };
}

}  // namespace dsg::simulator
