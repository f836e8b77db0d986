// SPDX-License-Identifier: Apache-2.0
// What a command line says, as plain values. Times and names stay text here: what they mean depends
// on the map, which nobody has opened yet.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"

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
  bool json = false;
  /// Most entries listed; 0 = all.
  int64_t limit = 0;
  /// Bound on each call, seconds; 0 = none on a store, the client's default on a server.
  double timeout_s = 0.0;
};

struct WhereVerb {
  std::string agent;
  std::string at;
};

struct TrackVerb {
  std::string agent;
  std::string from;
  std::string to;
  /// A duration; empty = the stored poses.
  std::string every;
};

struct ShapeVerb {
  std::string agent;
  std::string from;
  std::string to;
  /// At most one of both is set: a file for the first body, a folder for one file a body.
  std::string ply;
  std::string obj_folder;
  bool force = false;
};

struct WhoVerb {
  /// Exactly one of both is set. A room, place or region by id or name.
  std::string room;
  std::string box;
  std::string from;
  std::string to;
};

/// The parts of a node filter; empty = any.
struct FilterOptions {
  std::string layer;
  std::string kind;
  std::string class_name;
  std::string at;
};

struct ListVerb {
  FilterOptions filter;
  std::string parent;
  std::string name;
  std::string box;
};

struct EdgesVerb {
  std::string source;
  std::string relation;
  std::string target;
  std::string at;
};

struct ShowVerb {
  std::string id;
};

struct NearVerb {
  std::string position;
  int32_t k = 5;
  FilterOptions filter;
  /// Metres; 0 = no limit.
  double max_distance_m = 0.0;
};

struct LogVerb {};
struct StatsVerb {};
struct MapsVerb {};
struct VersionVerb {};
struct VerifyVerb {};

struct ImportVerb {
  std::string file;
};

struct ExportVerb {
  /// Files to write; at least one is set.
  std::string ply;
  std::string graph_ply;
  std::string gltf;
  /// "rgb", "label", "instance"; empty = rgb if the mesh has it, else label.
  std::string color;
  std::string at;
  bool force = false;
};

struct MapVerb {
  std::string png;
  /// A level or room by id or name, or a height; empty = all floors.
  std::string floor;
  int width_px = 1600;
  std::string at;
  bool force = false;
};

/// The user asked how to use the program.
struct HelpVerb {
  std::string text;
};

using Verb = std::variant<WhereVerb, TrackVerb, ShapeVerb, WhoVerb, ListVerb, EdgesVerb, ShowVerb,
                          NearVerb, LogVerb, StatsVerb, MapsVerb, VersionVerb, VerifyVerb,
                          ImportVerb, ExportVerb, MapVerb, HelpVerb>;

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
