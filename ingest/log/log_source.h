// SPDX-License-Identifier: Apache-2.0
// One recorded log, whatever its format, as a stream of stamped measurements.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/sensor/calibration.h"
#include "ingest/sensor/human_detection.h"
#include "ingest/sensor/image.h"
#include "ingest/sensor/imu_measurement.h"
#include "schema/model/graph_delta.h"

namespace dsg {
struct Topology;
}

namespace dsg::ingest {

/// A tracked person or robot was somewhere.
struct PoseMeasurement {
  /// The name that the log gives; the same name is the same agent within a map.
  std::string agent_name;
  /// One of IsAgentKind.
  std::string agent_kind;
  TimedPose pose;
  /// Where it stood in the log, for messages: "obsmat.txt:17".
  int64_t line = 0;
};

/// A ready-made piece of graph (nodes, edges, trajectories, mesh), as scene-graph files hold.
struct GraphMeasurement {
  GraphDelta delta;
};

/// An image, not decoded until asked for.
struct ImageMeasurement {
  TimeNs time_ns = 0;
  /// "cam0" (left), "cam1" (right), "color0", "depth0", "label0", "lidar0" (points).
  std::string channel;
  /// File or bag and message, for messages.
  std::string origin;
  /// Decodes; may be called from any thread, more than once, and after the log is closed.
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the origin; bounded by 16 Mpx.
  std::function<absl::StatusOr<Image>()> load;
};

/// Whatever recognised a place says where the robot was at `time_ns`, seen from where it was at
/// `from_ns`.
struct LoopMeasurement {
  TimeNs time_ns = 0;
  /// Before or after `time_ns`, never the same.
  TimeNs from_ns = 0;
  Pose3d from_T_to;
  /// Inverse covariance, translation before rotation (on the right of the pose), metres and
  /// radians; symmetric positive definite.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Identity();
  /// How sure the source was, as it counts.
  std::optional<double> score;
  /// Where it stood in the log, for messages: "loops.jsonl:3".
  std::string origin;
};

using Measurement = std::variant<PoseMeasurement, GraphMeasurement, ImuMeasurement,
                                 ImageMeasurement, HumanDetection, LoopMeasurement>;

/// When it was measured; kTimeMin for a piece of a graph, which speaks of many times.
inline TimeNs StampOf(const Measurement& measurement) {
  if (std::holds_alternative<GraphMeasurement>(measurement)) return kTimeMin;
  if (const auto* pose = std::get_if<PoseMeasurement>(&measurement)) return pose->pose.time_ns;
  if (const auto* imu = std::get_if<ImuMeasurement>(&measurement)) return imu->time_ns;
  if (const auto* image = std::get_if<ImageMeasurement>(&measurement)) return image->time_ns;
  if (const auto* loop = std::get_if<LoopMeasurement>(&measurement)) return loop->time_ns;
  return std::get<HumanDetection>(measurement).time_ns;
}

/// What a reader knows of its log before the first measurement.
struct LogInfo {
  /// "obsmat", "trajnet", "trajnet-ndjson", "thor", "euroc", "spark-dsg", "kimera-json",
  /// "region-json", "dsg-tracks", "rgbd", "rosbag", "tesse-objects", "tum", "tum-rgbd",
  /// "csv", "mcap", "rosbag2", "kitti".
  std::string format;
  std::string path;
  /// SHA-256 of the log's bytes, hexadecimal: the identity of the log. Of image files only names
  /// and sizes count.
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
  /// Empty for logs without sensors.
  RigCalibration rig;
  /// The classes of label images, ascending by id, each once; empty when the log names none.
  std::vector<SemanticLabel> labels;
  /// The faces of the detections' bodies; null when the log has none.
  std::shared_ptr<const Topology> body_topology;
  /// Measurements of each sensor channel, by name: "cam0", "imu0", "detections0", "poses",
  /// "loops0".
  std::map<std::string, int64_t> channel_counts;
  /// What the robot knows places by, once the log has ended, in parts as assets have it
  /// (recognition/place_memory.h); empty where none are sought.
  std::vector<std::string> place_memory;
  /// Channels that are used before the stages see them: by odometry, or to recognise places.
  std::set<std::string> used_channels;
  /// Sentences about what was dropped or assumed, for the user.
  std::vector<std::string> notes;
};

/// The clock of a log that begins at `first_ns`: before 2001-09-09 there is no clock of a robot,
/// and no simulation lasts that long.
inline Clock ClockOf(TimeNs first_ns) {
  return first_ns >= 1'000'000'000 * kNsPerSecond ? Clock::kUnix : Clock::kMonotonic;
}

/// Where the robot's poses come from.
enum class PoseSource {
  /// External poses if the log holds some, ground truth otherwise; LogInfo::notes says which.
  kAuto,
  /// The log's own ground truth.
  kGroundTruth,
  /// Estimated by other software, in the log or in LogOptions::pose_file.
  kExternal,
  /// None of the log's: they are estimated from its images, and its inertial unit if any.
  kOdometry,
};

/// How a file is read that another program is still writing.
struct FollowOptions {
  /// The log ends after so long without growth; unset = never.
  std::optional<std::chrono::milliseconds> timeout;
  /// How much later than others a topic of a bag may be recorded, ns: what is newer than that is
  /// held back. A message that comes later still ends the log with an error.
  TimeNs late_ns = kNsPerSecond;
  /// Set from a signal handler or another thread: the log ends at once. Outlives the log.
  const std::atomic<bool>* stop = nullptr;
  /// Gets sentences for the user while OpenLog or Next waits: what for, if it is unusual.
  std::function<void(const std::string&)> tell = {};
};

/// How far a pass over a file is: of `total` messages `done`.
using PassCallback = std::function<void(int64_t done, int64_t total)>;

struct LogOptions {
  /// "auto" or one of the names in LogInfo::format.
  std::string format = "auto";
  /// Where logs without a clock start.
  TimeNs epoch_ns = 0;
  /// Duration of one annotation step of a log without a clock.
  TimeNs frame_period_ns = 400'000'000;
  /// The same for frames of images (RGB-D folders).
  TimeNs image_period_ns = 33'333'333;
  /// Put before every agent's name, to keep apart logs that reuse names.
  std::string agent_prefix;
  /// Edge of the blocks that a mesh in the log is cut into: the map's.
  double mesh_block_size_m = 2.0;
  /// Refuse a scene graph or trajectory of which anything would be skipped.
  bool is_strict = false;
  /// Of sensor logs.
  PoseSource poses = PoseSource::kAuto;
  /// Poses to read instead of the log's (EuRoC or TUM columns); empty = the log's own.
  std::string pose_file;
  /// Loop closures to read instead of the log's; empty = the log's own.
  std::string loop_file;
  /// Of RGB-D folders: pictures of labels, and what their numbers mean (label_folder.h); empty =
  /// none.
  std::string label_folder;
  /// Of bags: the topic of a channel ("depth0", "poses", ...), instead of the one that its name or
  /// type tells; kNoTopic leaves the channel out. What is read by them is part of the log's
  /// content_sha256.
  std::map<std::string, std::string> topics;
  /// Set: the file may still grow, and Next waits for more of it (followed_log.h).
  std::optional<FollowOptions> follow;
  /// Called often while OpenLog reads a bag that is there as a whole, to know which log it is.
  PassCallback on_pass = {};
};

inline constexpr char kNoTopic[] = "none";

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
  /// Of a followed log: called several times a second while Next waits; an error of it is Next's.
  virtual void SetIdle(std::function<absl::Status()> /*idle*/) {}
};

/// Opens a log file or folder, finding out its format unless told. "-" is standard input, for
/// logs of text and scene graphs; these may also be packed by gzip or Zstandard.
///
/// Errors: NOT_FOUND for a missing path; INVALID_ARGUMENT/FILE_MALFORMED when the format cannot be
/// told or the file is empty, truncated or not what it claims to be.
absl::StatusOr<std::unique_ptr<LogSource>> OpenLog(const std::string& path,
                                                   const LogOptions& options);

}  // namespace dsg::ingest
