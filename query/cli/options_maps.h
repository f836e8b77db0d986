// SPDX-License-Identifier: Apache-2.0
// What command lines about whole maps say: log, diff, watch, stats, maps, import, export, ...
// Refuses to know what the words mean: times and names stay text until the map is open.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace dsg::cli {

struct LogVerb {};
struct StatsVerb {};
struct MapsVerb {};
struct VersionVerb {};
struct VerifyVerb {};
struct UpgradeVerb {};

struct DiffVerb {
  int64_t from_revision = 0;
  /// 0 = the newest.
  int64_t to_revision = 0;
  std::string layer;
};

struct WatchVerb {
  /// Unset = from the newest.
  std::optional<int64_t> after;
  /// Say what changed, not only that it did.
  bool changes = false;
  /// End after so many revisions; 0 = never.
  int64_t count = 0;
};

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

}  // namespace dsg::cli
