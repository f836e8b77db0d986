// SPDX-License-Identifier: Apache-2.0
// One recorded log, whatever its format, as a stream of stamped measurements.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/graph_delta.h"

namespace dsg::ingest {

/// A tracked person or robot was somewhere.
struct PoseMeasurement {
  /// The name that the log gives; the same name is the same agent within a map.
  std::string agent_name;
  /// kinds::kHuman or kinds::kRobot.
  std::string agent_kind;
  TimedPose pose;
  /// Where it stood in the log, for messages: "obsmat.txt:17".
  int64_t line = 0;
};

/// A ready-made piece of graph (nodes, edges, trajectories, mesh), as scene-graph files hold.
struct GraphMeasurement {
  GraphDelta delta;
};

using Measurement = std::variant<PoseMeasurement, GraphMeasurement>;

/// What a reader knows of its log before the first measurement.
struct LogInfo {
  /// "obsmat", "trajnet", "trajnet-ndjson", "thor", "euroc", "spark-dsg", "kimera-json",
  /// "region-json", "dsg-tracks".
  std::string format;
  std::string path;
  /// SHA-256 of the log's bytes, hexadecimal: the identity of the log.
  std::string content_sha256;
  /// Count of measurements, for the progress bar; 0 = unknown.
  int64_t measurement_count = 0;
  /// Whether stamps are on a real clock, or begin at the map's epoch.
  bool has_clock = false;
  /// First stamp; a new map takes it for its epoch when the log has a clock.
  TimeNs first_ns = 0;
  /// Which clock; meaningful if has_clock.
  Clock clock = Clock::kUnix;
  /// How far a human's feet are below its positions: 0 for tracks on the floor, more for heads.
  double feet_below_m = 0.0;
  /// Sentences about what was dropped or assumed, for the user.
  std::vector<std::string> notes;
};

struct LogOptions {
  /// "auto" or one of the names in LogInfo::format.
  std::string format = "auto";
  /// Where logs without a clock start.
  TimeNs epoch_ns = 0;
  /// Duration of one annotation step of a log without a clock.
  TimeNs frame_period_ns = 400'000'000;
  /// Put before every agent's name, to keep apart logs that reuse names.
  std::string agent_prefix;
  /// Edge of the blocks that a mesh in the log is cut into: the map's.
  double mesh_block_size_m = 2.0;
};

/// One log.
///
/// Order: ascending in time over the whole log, then by agent name; a GraphMeasurement without
/// times comes first. Times strictly grow per agent: a repeat or a step back is an error that
/// names file and line.
/// Threads: one caller at a time.
class LogSource {
 public:
  virtual ~LogSource() = default;
  virtual const LogInfo& info() const = 0;
  /// nullopt at the end. Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, line, field, and
  /// what to do.
  virtual absl::StatusOr<std::optional<Measurement>> Next() = 0;
};

/// Opens a log file or folder, finding out its format unless told.
///
/// Errors: NOT_FOUND for a missing path; INVALID_ARGUMENT/FILE_MALFORMED when the format cannot be
/// told or the file is empty, truncated or not what it claims to be.
absl::StatusOr<std::unique_ptr<LogSource>> OpenLog(const std::string& path,
                                                   const LogOptions& options);

}  // namespace dsg::ingest
