// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/folder_log.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/calibration_file.h"
#include "ingest/log/detection_channel.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/image_channel.h"
#include "ingest/log/imu_table.h"
#include "ingest/log/label_table.h"
#include "ingest/log/loop_file.h"
#include "ingest/log/pose_table.h"
#include "ingest/log/sensor_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

constexpr char kTruth[] = "state_groundtruth_estimate0";
constexpr char kExternal[] = "state_external0";
constexpr char kImu[] = "imu0";
constexpr char kDetections[] = "detections0";
constexpr char kLoops[] = "loop_closures0";
constexpr int64_t kManifestVersion = 1;

bool IsFolder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

std::vector<std::string> FoldersIn(const fs::path& root) {
  std::vector<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(root, error)) {
    std::error_code entry_error;
    if (entry.is_directory(entry_error)) names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

bool IsChannelFolder(std::string_view name) {
  return IsImageChannel(name) || name == kImu || name == kTruth || name == kExternal ||
         name == kDetections || name == kLoops;
}

// Without the sensor's errors: for ablations, never read here.
bool IsClean(std::string_view name) { return name.ends_with("_clean"); }

class FolderReader {
 public:
  FolderReader(const std::string& folder, const LogOptions& options)
      : folder_(folder), root_(FindSensorRoot(folder)), options_(options) {
    info_.format = "euroc";
    info_.path = folder;
    info_.has_clock = true;
    info_.clock = Clock::kUnix;
  }

  OpenedLog Open() {
    DSG_RETURN_IF_ERROR(CheckFinished());
    DSG_RETURN_IF_ERROR(ReadManifest());
    for (const std::string& name : FoldersIn(root_)) {
      if (IsImageChannel(name)) DSG_RETURN_IF_ERROR(ReadCamera(name));
      if (!IsChannelFolder(name) && !IsClean(name)) unread_.push_back(name);
    }
    if (IsFolder(root_ / kImu)) DSG_RETURN_IF_ERROR(ReadImu());
    if (IsFolder(root_ / kDetections)) {
      DSG_ASSIGN_OR_RETURN(SensorChannel detections,
                           ReadDetectionChannel((root_ / kDetections / "data.jsonl").string(),
                                                kDetections, options_, &digest_, &info_));
      channels_.push_back(std::move(detections));
    }
    DSG_RETURN_IF_ERROR(ReadPoses());
    DSG_RETURN_IF_ERROR(ReadLoops());
    AddNotes();
    DSG_RETURN_IF_ERROR(CheckCounts());
    info_.content_sha256 = digest_.Hex();
    DSG_ASSIGN_OR_RETURN(std::unique_ptr<LogSource> log,
                         MakeSensorLog(std::move(channels_), options_, std::move(info_)));
    return log;
  }

 private:
  // The simulator puts a file or an ending of this name on what it has not finished.
  absl::Status CheckFinished() {
    fs::path folder = fs::path(folder_).lexically_normal();
    if (folder.filename().empty()) folder = folder.parent_path();
    std::error_code error;
    const bool has_marker = fs::exists(folder / ".rendering", error) ||
                            fs::exists(root_ / ".rendering", error) ||
                            folder.extension() == ".rendering";
    if (!has_marker) return absl::OkStatus();
    return MalformedFile(folder,
                         "is a simulation that is not finished; run the same dsg-simulate "
                         "again, which goes on where it was cut off");
  }

  fs::path ManifestPath() const {
    const fs::path inside = fs::path(folder_) / "log.json";
    return IsFile(inside) ? inside : root_.parent_path() / "log.json";
  }

  absl::Status ReadManifest() {
    const fs::path path = ManifestPath();
    if (!IsFile(path)) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(path.string()));
    // The bound keeps the parser's own depth and memory small.
    if (file.bytes.size() > (size_t{1} << 20)) {
      return MalformedFile(path, "is too large for a log.json");
    }
    manifest_ = nlohmann::json::parse(file.bytes, nullptr, false);
    if (!manifest_.is_object()) return MalformedFile(path, "is no JSON object; copy the log again");
    const auto format = manifest_.find("format");
    const auto version = manifest_.find("version");
    // Another program's log.json beside a EuRoC folder is none of our business.
    if (format == manifest_.end() || *format != "dsg-sensors") {
      manifest_ = nlohmann::json();
      return absl::OkStatus();
    }
    if (version == manifest_.end() || *version != kManifestVersion) {
      const std::string found =
          version == manifest_.end() || version->is_structured()
              ? "missing"
              : version->dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
      return MalformedFile(
          path, absl::StrCat("its version is ", found, ", this build reads ", kManifestVersion,
                             "; use the build that wrote the log"));
    }
    digest_.Add("log.json", file.bytes);
    const fs::path labels = path.parent_path() / "labels.csv";
    if (!IsFile(labels)) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const LogFile label_file, ReadLogFile(labels.string()));
    digest_.Add("labels.csv", label_file.bytes);
    DSG_ASSIGN_OR_RETURN(const LabelTable table, ReadLabelTable(label_file));
    info_.labels = table.Classes();
    return absl::OkStatus();
  }

  absl::Status ReadCamera(const std::string& name) {
    const fs::path folder = root_ / name;
    if (!IsFile(folder / "sensor.yaml")) {
      return MalformedFile(
          folder / "sensor.yaml",
          absl::StrCat("the calibration of channel ", name,
                       " is missing; copy it, or remove the folder of the channel"));
    }
    DSG_ASSIGN_OR_RETURN(const LogFile yaml, ReadLogFile((folder / "sensor.yaml").string()));
    digest_.Add(absl::StrCat(name, "/sensor.yaml"), yaml.bytes);
    DSG_ASSIGN_OR_RETURN(CameraCalibration camera, ReadCameraYaml(yaml, name));
    DSG_ASSIGN_OR_RETURN(ImageList list, ReadImageTable(folder, name, &digest_));
    DSG_RETURN_IF_ERROR(CheckSize(camera, list));
    info_.rig.cameras.push_back(std::move(camera));
    channels_.push_back(MakeImageChannel(name, DecodingOf(name), std::move(list)));
    return absl::OkStatus();
  }

  // One image stands for all: a camera does not change its size.
  static absl::Status CheckSize(const CameraCalibration& camera, const ImageList& list) {
    if (list.names.empty()) return absl::OkStatus();
    const std::string path = (fs::path(list.folder) / list.names.front()).string();
    DSG_ASSIGN_OR_RETURN(const ImageHeader header, LoadImageHeader(path));
    if (header.width == camera.width && header.height == camera.height) return absl::OkStatus();
    return MalformedFile(
        path, absl::StrCat("the image is ", header.width, " x ", header.height,
                           " pixels, the calibration of ", camera.name, " says ", camera.width,
                           " x ", camera.height, "; correct sensor.yaml"));
  }

  absl::Status ReadImu() {
    DSG_ASSIGN_OR_RETURN(const LogFile table, ReadLogFile((root_ / kImu / "data.csv").string()));
    digest_.Add("imu0/data.csv", table.bytes);
    DSG_ASSIGN_OR_RETURN(SensorChannel channel, ReadImuTable(table, kImu));
    channels_.push_back(std::move(channel));
    const fs::path path = root_ / kImu / "sensor.yaml";
    if (!IsFile(path)) {
      info_.notes.push_back(absl::StrCat(path.string(), " is missing: imu0 has no calibration"));
      return absl::OkStatus();
    }
    DSG_ASSIGN_OR_RETURN(const LogFile yaml, ReadLogFile(path.string()));
    digest_.Add("imu0/sensor.yaml", yaml.bytes);
    DSG_ASSIGN_OR_RETURN(info_.rig.imu, ReadImuYaml(yaml, kImu));
    return absl::OkStatus();
  }

  absl::StatusOr<std::optional<TrackTable>> ReadPoseFolder(const std::string& name) {
    const fs::path path = root_ / name / "data.csv";
    if (!IsFile(path)) return std::nullopt;
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(path.string()));
    digest_.Add(absl::StrCat(name, "/data.csv"), file.bytes);
    if (!file.bytes.ends_with('\n')) {
      info_.notes.push_back(absl::StrCat(path.string(),
                                         ": the last line has no end; if the copy "
                                         "was cut, its last number may be cut too"));
    }
    DSG_ASSIGN_OR_RETURN(TrackTable table, ReadEurocPoses(file, RobotName(options_)));
    return table;
  }

  absl::Status ReadPoses() {
    PoseTables tables;
    DSG_ASSIGN_OR_RETURN(tables.ground_truth, ReadPoseFolder(kTruth));
    DSG_ASSIGN_OR_RETURN(tables.external, ReadPoseFolder(kExternal));
    DSG_ASSIGN_OR_RETURN(std::optional<TrackTable> poses,
                         ChoosePoses(options_, std::move(tables), &digest_, &info_));
    if (poses.has_value()) channels_.push_back(MakePoseChannel(*std::move(poses)));
    return absl::OkStatus();
  }

  absl::Status ReadLoops() {
    std::string path = (root_ / kLoops / "data.jsonl").string();
    if (!IsFolder(root_ / kLoops)) path.clear();
    DSG_ASSIGN_OR_RETURN(std::optional<SensorChannel> loops,
                         ReadLoopChannel(options_, path, &digest_, &info_));
    if (loops.has_value()) channels_.push_back(*std::move(loops));
    return absl::OkStatus();
  }

  void AddNotes() {
    std::set<std::string> names;
    for (const SensorChannel& channel : channels_) names.insert(channel.name);
    if (names.contains("cam0") != names.contains("cam1")) {
      info_.notes.push_back(absl::StrCat(
          "there is ", names.contains("cam0") ? "cam0 but no cam1" : "cam1 but no cam0",
          ": the log has no stereo pair"));
    }
    if (!unread_.empty()) {
      info_.notes.push_back(
          absl::StrCat("folders that are not read: ", absl::StrJoin(unread_, ", ")));
    }
  }

  // What log.json counted when the log was written must still be there.
  absl::Status CheckCounts() {
    if (!manifest_.is_object()) return absl::OkStatus();
    TimeNs first_ns = kTimeMax;
    for (const SensorChannel& channel : channels_) {
      if (!channel.times.empty()) first_ns = std::min(first_ns, channel.times.front());
      const auto counts = manifest_.find("counts");
      if (channel.name == "poses" || counts == manifest_.end() || !counts->is_object()) continue;
      const auto count = counts->find(channel.name);
      if (count == counts->end() || !count->is_number_integer()) continue;
      if (count->get<int64_t>() == static_cast<int64_t>(channel.times.size())) continue;
      return MalformedFile(
          ManifestPath(),
          absl::StrCat("counts ", count->get<int64_t>(), " measurements of channel ", channel.name,
                       ", the log holds ", channel.times.size(), "; copy the log again"));
    }
    info_.clock = ClockOf(first_ns);
    return absl::OkStatus();
  }

  std::string folder_;
  fs::path root_;
  const LogOptions& options_;
  LogInfo info_;
  LogDigest digest_;
  nlohmann::json manifest_;
  std::vector<SensorChannel> channels_;
  std::vector<std::string> unread_;
};

}  // namespace

std::string FindSensorRoot(const std::string& folder) {
  for (const fs::path& root : {fs::path(folder) / "mav0", fs::path(folder)}) {
    for (const std::string& name : FoldersIn(root)) {
      if (IsChannelFolder(name) &&
          (IsFile(root / name / "data.csv") || IsFile(root / name / "data.jsonl"))) {
        return root.string();
      }
    }
  }
  return "";
}

OpenedLog OpenSensorFolder(const std::string& folder, const LogOptions& options) {
  return FolderReader(folder, options).Open();
}

}  // namespace dsg::ingest
