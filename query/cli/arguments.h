// SPDX-License-Identifier: Apache-2.0
// What a command line says, as plain values. Times and names stay text here: what they mean depends
// on the map, which nobody has opened yet.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "query/cli/options_agents.h"
#include "query/cli/options_graph.h"
#include "query/cli/options_keep.h"
#include "query/cli/options_maps.h"
#include "query/cli/options_merge.h"
#include "query/cli/options_prune.h"
#include "query/cli/options_space.h"

namespace dsg::cli {

/// What the surroundings of the process give; options on the command line win over it.
struct Environment {
  /// DSG_STORE, DSG_SERVER, DSG_MAP; empty = not set.
  std::string store{};
  std::string server{};
  std::string map{};
  /// Version of this program.
  std::string version{};
};

/// What several verbs share.
struct CommonOptions {
  /// At most one of both is set.
  std::string store;
  std::string server;
  /// Empty = the store's only map.
  std::string map;
  std::optional<int64_t> revision;
  /// The revision by its name; with `revision` unset.
  std::string tag;
  bool json = false;
  /// Most entries listed; 0 = all.
  int64_t limit = 0;
  /// Bound on each call, seconds; 0 = none on a store, the client's default on a server.
  double timeout_s = 0.0;
};

class Session;

/// A verb that stands in one file, with its options and what it does; see verb_list.h. It asks
/// about one map.
struct OwnVerb {
  /// Asks, then writes the answer to `out`; nothing on an error.
  std::function<absl::Status(Session* session, std::ostream& out)> run;
};

/// The user asked how to use the program.
struct HelpVerb {
  std::string text;
};

using Verb = std::variant<WhereVerb, TrackVerb, ShapeVerb, WhoVerb, MetVerb, PickedVerb,
                          PredictVerb, ListVerb, EdgesVerb, ShowVerb, NearVerb, FindVerb,
                          AroundVerb, SubgraphVerb, PathVerb, CollideVerb, LogVerb, DiffVerb,
                          WatchVerb, StatsVerb, MapsVerb, VersionVerb, VerifyVerb, UpgradeVerb,
                          TagVerb, CompactVerb, RevertVerb, BackupVerb, RestoreVerb, MergeVerb,
                          PruneVerb, ImportVerb, ExportVerb, MapVerb, OwnVerb, HelpVerb>;

struct Command {
  CommonOptions common;
  Verb verb;
};

/// Reads a command line without the program's name.
///
/// Errors: INVALID_ARGUMENT naming the option and what to do.
absl::StatusOr<Command> ParseArguments(const std::vector<std::string>& arguments,
                                       const Environment& environment);

}  // namespace dsg::cli
