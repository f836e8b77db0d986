// SPDX-License-Identifier: Apache-2.0
// What command lines about whole maps say: log, diff, watch, stats, maps, import, export, ...
// Refuses to know what the words mean: times and names stay text until the map is open.
#pragma once

#include <cstdint>
#include <string>

#include "query/cli/options_keep.h"

namespace dsg::cli {

struct LogVerb {};
struct StatsVerb {};
struct MapsVerb {};
struct VersionVerb {};
struct VerifyVerb {
  /// An archive, or the folder of a backup; empty = the store.
  std::string path;
};
struct UpgradeVerb {};

struct DiffVerb {
  RevisionOption from;
  /// Unset = the newest.
  RevisionOption to;
  std::string layer;
};

struct WatchVerb {
  /// Unset = from the newest.
  RevisionOption after;
  /// Say what changed, not only that it did.
  bool changes = false;
  /// End after so many revisions; 0 = never.
  int64_t count = 0;
};

struct ImportVerb {
  std::string file;
  /// Refuse a file of which anything would be skipped.
  bool is_strict = false;
};

struct ExportVerb {
  /// An archive of all of the map (.dsgz).
  std::string archive;
  /// Files to write; at least one is set, or `archive` is.
  std::string ply;
  std::string graph_ply;
  std::string gltf;
  /// Spark-DSG, JSON or binary by its ending.
  std::string spark;
  /// Of the poses in it, metres; 0 = every pose.
  double pose_step_m = 0.5;
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
