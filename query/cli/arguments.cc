// SPDX-License-Identifier: Apache-2.0
#include "query/cli/arguments.h"

#include "absl/strings/str_cat.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

// Takes from the environment what the command line does not give. A store or server on the command
// line hides both variables, so that --server works although DSG_STORE is set.
absl::Status ApplyEnvironment(const Environment& environment, Command* command) {
  CommonOptions& common = command->common;
  if (common.store.empty() && common.server.empty()) {
    common.store = environment.store;
    common.server = environment.server;
  }
  if (!common.store.empty() && !common.server.empty()) {
    return Usage(absl::StrCat("both a store (", common.store, ") and a server (", common.server,
                              ") are given; name one with --store or --server"),
                 "");
  }
  if (common.map.empty() && command->uses_map_variable) {
    common.map = environment.map;
    common.map_is_default = true;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Command> ParseArguments(const std::vector<std::string>& arguments,
                                       const Environment& environment) {
  Grammar grammar(environment.version);
  AddAllVerbs(&grammar);
  DSG_RETURN_IF_ERROR(grammar.Parse(arguments));
  Command command = grammar.command();
  if (!command.help.empty()) return command;
  DSG_RETURN_IF_ERROR(ApplyEnvironment(environment, &command));
  const CommonOptions& common = command.common;
  if (command.opens != Opens::kNothing && common.store.empty() && common.server.empty()) {
    return Usage(
        "say where the maps are: --store DIR or --server ADDR (or set DSG_STORE or DSG_SERVER)",
        "");
  }
  if (command.check) DSG_RETURN_IF_ERROR(command.check(common));
  return command;
}

}  // namespace dsg::cli
