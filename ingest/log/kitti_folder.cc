// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/kitti_folder.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/log/image_file.h"
#include "ingest/log/loop_file.h"
#include "ingest/log/point_row.h"
#include "ingest/log/pose_table.h"
#include "ingest/log/sensor_log.h"
#include "ingest/log/text_table.h"
#include "ingest/log/track_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little);

constexpr char kScanFolder[] = "velodyne";
constexpr char kTimesFile[] = "times.txt";
constexpr char kPosesFile[] = "poses.txt";
constexpr char kCalibrationFile[] = "calib.txt";
// x, y, z and intensity.
constexpr size_t kPointBytes = 16;
// Matrices printed with rounding that is worth a word.
constexpr double kDeviationNoted = 1e-3;

// "000017.bin"; unset for other names.
std::optional<int64_t> NumberOfScan(const fs::path& path) {
  const std::string stem = path.stem().string();
  int64_t number = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  const bool is_number = error == std::errc() && end == stem.data() + stem.size() && number >= 0;
  if (path.extension() != ".bin" || !is_number) return std::nullopt;
  return number;
}

absl::StatusOr<Image> LoadScan(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(path));
  const size_t count = file.bytes.size() / kPointBytes;
  PointRow points(count);
  for (size_t i = 0; i < count; ++i) {
    std::array<float, 3> xyz;
    std::memcpy(xyz.data(), file.bytes.data() + i * kPointBytes, sizeof(xyz));
    points.Add(xyz);
  }
  return points.Take();
}

class KittiReader {
 public:
  KittiReader(const std::string& folder, const LogOptions& options)
      : root_(folder), options_(options) {
    info_.format = "kitti";
    info_.path = folder;
  }

  OpenedLog Open() {
    DSG_RETURN_IF_ERROR(ReadTimes());
    DSG_RETURN_IF_ERROR(ListScans());
    PoseTables tables;
    if (options_.pose_file.empty() && IsFile(root_ / kPosesFile)) {
      DSG_ASSIGN_OR_RETURN(tables.ground_truth, ReadPoses());
    }
    info_.rig.lidar = LidarCalibration{.name = "lidar0", .body_T_lidar = Pose3d()};
    DSG_ASSIGN_OR_RETURN(std::optional<TrackTable> poses,
                         ChoosePoses(options_, std::move(tables), &digest_, &info_));
    std::vector<SensorChannel> channels = {MakeScanChannel()};
    if (poses.has_value()) channels.push_back(MakePoseChannel(*std::move(poses)));
    DSG_ASSIGN_OR_RETURN(std::optional<SensorChannel> loops,
                         ReadLoopChannel(options_, /*log_path=*/"", &digest_, &info_));
    if (loops.has_value()) channels.push_back(*std::move(loops));
    info_.content_sha256 = digest_.Hex();
    return MakeSensorLog(std::move(channels), options_, std::move(info_));
  }

 private:
  absl::StatusOr<LogFile> ReadFile(const char* name, const std::string& purpose) {
    if (!IsFile(root_ / name)) {
      return MalformedFile((root_ / name).string(),
                           absl::StrCat("is missing: ", purpose, "; copy it beside ", kScanFolder));
    }
    DSG_ASSIGN_OR_RETURN(LogFile file, ReadLogFile((root_ / name).string()));
    digest_.Add(name, file.bytes);
    return file;
  }

  absl::Status ReadTimes() {
    DSG_ASSIGN_OR_RETURN(const LogFile file,
                         ReadFile(kTimesFile, "it has the time of each scan, seconds"));
    LineReader lines(file.bytes);
    TextLine line;
    std::vector<std::string_view> fields;
    while (lines.Next(&line)) {
      const LinePosition at{file.path, line.number};
      SplitAtBlanks(line.text, &fields);
      DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), 1, "seconds"));
      DSG_ASSIGN_OR_RETURN(TimeNs time_ns, ParseSeconds(at, "time", fields[0]));
      if (times_.empty()) SetClockOf(time_ns);
      if (!info_.has_clock) {
        DSG_ASSIGN_OR_RETURN(time_ns, AddToEpoch(at, options_.epoch_ns, time_ns));
      }
      DSG_RETURN_IF_ERROR(CheckGrows(file.path, line.number, "lidar0", times_, time_ns));
      times_.push_back(time_ns);
    }
    return absl::OkStatus();
  }

  void SetClockOf(TimeNs first_ns) {
    info_.clock = ClockOf(first_ns);
    info_.has_clock = info_.clock == Clock::kUnix;
    if (!info_.has_clock) {
      info_.notes.push_back("the times count from the epoch of the map (--epoch)");
    }
  }

  absl::Status ListScans() {
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(root_ / kScanFolder, error)) {
      const std::optional<int64_t> number = NumberOfScan(entry.path());
      if (!number.has_value()) continue;
      if (*number >= std::ssize(times_)) {
        return MalformedFile(
            entry.path().string(),
            absl::StrCat("has no time: ", (root_ / kTimesFile).string(), " has ", times_.size(),
                         " lines, for scans 0 to ", std::ssize(times_) - 1));
      }
      DSG_RETURN_IF_ERROR(CheckScan(entry));
      scans_[*number] = entry.path().filename().string();
    }
    const int64_t absent_count = std::ssize(times_) - std::ssize(scans_);
    if (absent_count == 0) return absl::OkStatus();
    const std::string absent = absl::StrCat(absent_count, " of ", times_.size(), " scans of ",
                                            kTimesFile, " are not in ", kScanFolder);
    if (options_.is_strict) return MalformedFile(root_.string(), absent);
    info_.notes.push_back(absl::StrCat(absent, "; they are passed over, --strict refuses them"));
    return absl::OkStatus();
  }

  absl::Status CheckScan(const fs::directory_entry& entry) {
    std::error_code error;
    const uintmax_t size = entry.file_size(error);
    const std::string path = entry.path().string();
    if (error || size == 0) return MalformedFile(path, "is empty, or no file");
    if (size % kPointBytes != 0) {
      return MalformedFile(path, absl::StrCat("has ", size, " bytes, and a point has ", kPointBytes,
                                              ": the copy was cut short, or it is no scan of x, y, "
                                              "z, intensity"));
    }
    if (size / kPointBytes > static_cast<uintmax_t>(kImagePixelsMax)) {
      return MalformedFile(path, absl::StrCat("has ", size / kPointBytes, " points; at most ",
                                              kImagePixelsMax, " are read"));
    }
    digest_.AddSize(absl::StrCat(kScanFolder, "/", entry.path().filename().string()), size);
    return absl::OkStatus();
  }

  // From points of the lidar to points of the camera that the poses are of.
  absl::StatusOr<Pose3d> ReadCameraTLidar() {
    DSG_ASSIGN_OR_RETURN(
        const LogFile file,
        ReadFile(kCalibrationFile, "its Tr says where the lidar is from the camera of poses.txt"));
    LineReader lines(file.bytes);
    TextLine line;
    std::vector<std::string_view> fields;
    while (lines.Next(&line)) {
      SplitAtBlanks(line.text, &fields);
      if (fields[0] != "Tr:" && fields[0] != "Tr_velo_to_cam:") continue;
      const LinePosition at{file.path, line.number};
      DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), 13, "Tr: and a 3x4 matrix"));
      return ReadMatrixFields(at, fields, 1, &deviation_max_);
    }
    return MalformedFile(file.path, "has no line \"Tr:\" with the transform from lidar to camera");
  }

  absl::StatusOr<TrackTable> ReadPoses() {
    DSG_ASSIGN_OR_RETURN(const Pose3d camera_T_lidar, ReadCameraTLidar());
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadFile(kPosesFile, "it has a pose of each scan"));
    TrackTable table;
    table.file = file.path;
    const int32_t agent = table.FindOrAdd(RobotName(options_), kinds::kRobot);
    DSG_ASSIGN_OR_RETURN(const MatrixPoses poses, ReadMatrixPoses(file));
    if (poses.rows.size() != times_.size()) return CountsDiffer(file.path, poses.rows.size());
    deviation_max_ = std::max(deviation_max_, poses.deviation_max);
    for (size_t i = 0; i < times_.size(); ++i) {
      const Pose3d& origin_T_camera = poses.rows[i].map_T_body;
      table.rows.push_back(
          {.time_ns = times_[i],
           .line = poses.rows[i].line,
           .agent = agent,
           .flags = 0,
           .map_T_agent = camera_T_lidar.Inverse() * origin_T_camera * camera_T_lidar});
    }
    if (deviation_max_ > kDeviationNoted) {
      info_.notes.push_back(absl::StrCat("rotations of ", kPosesFile, " or ", kCalibrationFile,
                                         " were off by up to ", deviation_max_,
                                         " and were made orthonormal"));
    }
    return table;
  }

  absl::Status CountsDiffer(const std::string& path, size_t count) const {
    return MalformedFile(
        path, absl::StrCat("has ", count, " poses, and ", kTimesFile, " has ", times_.size(),
                           " times; one of each is due for every scan"));
  }

  SensorChannel MakeScanChannel() {
    SensorChannel channel{.name = "lidar0", .rank = ChannelRank::kImages, .times = {}, .make = {}};
    std::vector<std::string> names;
    for (auto& [number, name] : scans_) {
      channel.times.push_back(times_[static_cast<size_t>(number)]);
      names.push_back(std::move(name));
    }
    const auto shared = std::make_shared<const std::vector<std::string>>(std::move(names));
    channel.make = [shared, times = channel.times,
                    folder = root_ / kScanFolder](size_t index) -> absl::StatusOr<Measurement> {
      ImageMeasurement scan;
      scan.time_ns = times[index];
      scan.channel = "lidar0";
      scan.origin = (folder / (*shared)[index]).string();
      scan.load = [path = scan.origin] { return LoadScan(path); };
      return Measurement(std::move(scan));
    };
    return channel;
  }

  fs::path root_;
  const LogOptions& options_;
  LogDigest digest_;
  LogInfo info_;
  /// By number of the scan.
  std::vector<TimeNs> times_;
  std::map<int64_t, std::string> scans_;
  double deviation_max_ = 0.0;
};

}  // namespace

bool IsKittiFolder(const std::string& folder) {
  std::error_code error;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(fs::path(folder) / kScanFolder, error)) {
    if (NumberOfScan(entry.path()).has_value()) return true;
  }
  return false;
}

OpenedLog OpenKittiFolder(const std::string& folder, const LogOptions& options) {
  return KittiReader(folder, options).Open();
}

}  // namespace dsg::ingest
