// SPDX-License-Identifier: Apache-2.0
// What a command line says, as plain values. Times and names stay text here: their meaning depends
// on the map, which is not open yet.
#pragma once

#include <any>
#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "query/client/credentials.h"

namespace dsg::cli {

/// The environment of the process; options on the command line override it.
struct Environment {
  /// DSG_STORE, DSG_SERVER, DSG_MAP; empty = not set.
  std::string store{};
  std::string server{};
  std::string map{};
  /// Version of this program.
  std::string version{};
};

/// How a list is written, unless the whole reply is asked for as JSON.
enum class ListFormat { kTable, kCsv, kJsonLines };

/// A revision by number, by tag or by the time when it was committed; none of them = the default of
/// the verb.
struct RevisionOption {
  std::optional<int64_t> number{};
  std::string tag{};
  /// The newest one that was committed until then, nanoseconds since 1970 UTC.
  std::optional<int64_t> committed_at_ns{};

  bool is_set() const { return number.has_value() || !tag.empty() || committed_at_ns.has_value(); }
};

/// Options that several verbs share.
struct CommonOptions {
  /// At most one of the two is set.
  std::string store;
  std::string server;
  /// How the server knows who calls.
  client::CredentialFiles credentials;
  /// Empty = the only map of the store.
  std::string map;
  /// `map` comes from DSG_MAP.
  bool map_is_default = false;
  /// What the map is read at; default the newest revision.
  RevisionOption at;
  bool json = false;
  ListFormat format = ListFormat::kTable;
  /// Maximum number of entries; 0 = all.
  int64_t limit = 0;
  /// Deadline of each call, seconds; 0 = none on a store, the client's default on a server.
  double timeout_s = 0.0;
};

/// The parts of a node filter; empty = any.
struct FilterOptions {
  std::string layer;
  std::string kind;
  std::string class_name;
  std::string at;
};

/// Where the picture of an answer goes.
struct PictureOptions {
  /// Empty = no picture.
  std::string png;
  /// A level or room by id or name, or a height; empty = all floors.
  std::string floor;
  int width_px = 1600;
  /// Replace an existing file.
  bool force = false;
};

class Session;

/// What a verb needs open before it runs.
enum class Opens {
  /// The verb opens files and stores itself, or needs none.
  kNothing,
  /// A store or a server.
  kPlace,
  /// A store or a server, and one map of it.
  kMap,
};

struct Command {
  CommonOptions common;
  /// Text to print instead of running a verb; empty = run.
  std::string help;
  Opens opens = Opens::kNothing;
  /// DSG_MAP is the default of --map.
  bool uses_map_variable = true;
  /// The options of the verb, of its own type.
  std::any verb;
  /// Checks options that depend on each other; may be empty.
  std::function<absl::Status(const CommonOptions& common)> check;
  /// Writes the answer to `out`; on an error nothing, or what a list had written until then.
  std::function<absl::Status(Session* session, std::ostream& out)> run;
};

/// Reads a command line without the program's name.
///
/// Errors: INVALID_ARGUMENT with the option and what to do.
absl::StatusOr<Command> ParseArguments(const std::vector<std::string>& arguments,
                                       const Environment& environment);

}  // namespace dsg::cli
