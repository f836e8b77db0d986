// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/tum_folder.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/calibration_file.h"
#include "ingest/log/image_channel.h"
#include "ingest/log/label_folder.h"
#include "ingest/log/loop_file.h"
#include "ingest/log/pose_table.h"
#include "ingest/log/rgbd_poses.h"
#include "ingest/log/sensor_log.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

constexpr double kTumDepthUnitsPerM = 5000.0;

struct PublishedCamera {
  const char* name;
  double fx, fy, cx, cy;
  std::vector<double> distortion;
};

// The calibrations that TUM published with the recordings, which have none in their folders.
const std::vector<PublishedCamera>& PublishedCameras() {
  static const auto* const cameras = new std::vector<PublishedCamera>{
      {"freiburg1", 517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
      {"freiburg2", 520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}},
      {"freiburg3", 535.4, 539.2, 320.1, 247.6, {}}};
  return *cameras;
}

// Files within the folder only.
bool IsInside(std::string_view name) {
  const fs::path path(name);
  return !name.empty() && name.size() <= 1024 && name.find('\0') == std::string_view::npos &&
         path.is_relative() && std::find(path.begin(), path.end(), "..") == path.end();
}

class TumFolderReader {
 public:
  TumFolderReader(const std::string& folder, const LogOptions& options)
      : root_(folder), options_(options) {}

  OpenedLog Open() {
    info_.format = "tum-rgbd";
    info_.path = root_.string();
    DSG_ASSIGN_OR_RETURN(ImageList color, ReadTable("rgb.txt"));
    DSG_ASSIGN_OR_RETURN(ImageList depth, ReadTable("depth.txt"));
    DSG_ASSIGN_OR_RETURN(std::optional<TrackTable> truth, ReadTruth());
    if (truth.has_value()) NumbersToStamps(*truth, {&color, &depth});
    DSG_RETURN_IF_ERROR(SetClocks(&color, &depth, truth.has_value() ? &*truth : nullptr));
    ImageDecoding depth_decoding = DecodingOf("depth0");
    depth_decoding.depth_units_per_m = kTumDepthUnitsPerM;
    DSG_RETURN_IF_ERROR(SetCameras(color, depth, &depth_decoding));
    std::vector<SensorChannel> channels;
    if (!options_.label_folder.empty()) {
      const std::vector<LabelledPictures> pictures = {{"depth0", depth.times, depth.names, {}},
                                                      {"color0", color.times, color.names, {}}};
      DSG_ASSIGN_OR_RETURN(
          SensorChannel labels,
          ReadLabelFolder(options_, pictures, info_.has_clock ? 0 : options_.epoch_ns, &digest_,
                          &info_));
      channels.push_back(std::move(labels));
    }
    channels.push_back(MakeImageChannel("color0", DecodingOf("color0"), std::move(color)));
    channels.push_back(MakeImageChannel("depth0", depth_decoding, std::move(depth)));
    PoseTables tables{.ground_truth = std::move(truth), .external = std::nullopt};
    DSG_ASSIGN_OR_RETURN(std::optional<TrackTable> poses,
                         ChoosePoses(options_, std::move(tables), &digest_, &info_));
    if (poses.has_value()) {
      info_.notes.push_back("the poses are the camera's: the body is the camera");
      channels.push_back(MakePoseChannel(*std::move(poses)));
    }
    DSG_ASSIGN_OR_RETURN(std::optional<SensorChannel> loops,
                         ReadLoopChannel(options_, /*log_path=*/"", &digest_, &info_));
    if (loops.has_value()) channels.push_back(*std::move(loops));
    if (IsFile(root_ / "accelerometer.txt")) {
      info_.notes.push_back("accelerometer.txt is not read: there is no gyroscope beside it");
    }
    info_.content_sha256 = digest_.Hex();
    return MakeSensorLog(std::move(channels), options_, std::move(info_));
  }

 private:
  absl::StatusOr<LogFile> ReadFile(const std::string& name) {
    DSG_ASSIGN_OR_RETURN(LogFile file, ReadLogFile((root_ / name).string()));
    digest_.Add(name, file.bytes);
    return file;
  }

  // Rows of a stamp in seconds and a file, between blanks.
  absl::StatusOr<ImageList> ReadTable(const std::string& name) {
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadFile(name));
    ImageList list;
    list.folder = root_.string();
    LineReader lines(file.bytes);
    TextLine line;
    std::vector<std::string_view> fields;
    while (lines.Next(&line)) {
      if (line.text.starts_with('#')) continue;
      const LinePosition at{file.path, line.number};
      SplitAtBlanks(line.text, &fields);
      DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), 2, "timestamp filename"));
      DSG_ASSIGN_OR_RETURN(const TimeNs time_ns, ParseSeconds(at, "timestamp", fields[0]));
      DSG_RETURN_IF_ERROR(CheckGrows(file.path, line.number, name, list.times, time_ns));
      if (!IsInside(fields[1])) {
        return at.FieldError("filename", fields[1], "the path of a file in the folder is due");
      }
      list.times.push_back(time_ns);
      list.names.emplace_back(fields[1]);
    }
    if (list.names.empty()) {
      return LinePosition{file.path, 1}.Error("names no picture; copy the log again");
    }
    DSG_RETURN_IF_ERROR(CheckPictures(file.path, list));
    return list;
  }

  absl::Status CheckPictures(const std::string& table, const ImageList& list) {
    int64_t absent_count = 0;
    std::string first_absent;
    for (const std::string& name : list.names) {
      std::error_code error;
      const uintmax_t size = fs::file_size(root_ / name, error);
      if (error && absent_count++ == 0) first_absent = (root_ / name).string();
      if (!error) digest_.AddSize(name, size);
    }
    if (absent_count == 0) return absl::OkStatus();
    return MakeError(
        Reason::kFileMalformed,
        absl::StrCat(first_absent, ": ", table, " names this picture, but it is not there; ",
                     absent_count, " of ", list.names.size(),
                     " are absent: copy the log again, or remove their lines"),
        {{"file", first_absent}, {"count", absl::StrCat(absent_count)}});
  }

  // The benchmark's own trajectory, or that of a key-frame selection of it.
  absl::StatusOr<std::optional<TrackTable>> ReadTruth() {
    for (const char* const name : {"groundtruth.txt", "truth_cam_poses.txt"}) {
      if (!IsFile(root_ / name)) continue;
      DSG_ASSIGN_OR_RETURN(const LogFile file, ReadFile(name));
      DSG_ASSIGN_OR_RETURN(TrackTable table, ReadTumPoses(file, RobotName(options_)));
      DSG_RETURN_IF_ERROR(CheckRows(table));
      return table;
    }
    return std::nullopt;
  }

  // Selections of key frames count them, and have the stamps in the trajectory: a row a frame.
  void NumbersToStamps(const TrackTable& truth, const std::vector<ImageList*>& lists) {
    const auto count = static_cast<TimeNs>(truth.rows.size());
    for (const ImageList* list : lists) {
      for (const TimeNs time_ns : list->times) {
        const bool is_number =
            time_ns >= 0 && time_ns % kNsPerSecond == 0 && time_ns / kNsPerSecond < count;
        if (!is_number) return;
      }
      // On the clock of the trajectory they would be stamps.
      if (list->times.back() >= truth.rows.front().time_ns) return;
    }
    for (ImageList* list : lists) {
      for (TimeNs& time_ns : list->times) {
        time_ns = truth.rows[static_cast<size_t>(time_ns / kNsPerSecond)].time_ns;
      }
    }
    info_.notes.push_back(absl::StrCat(
        "rgb.txt and depth.txt count frames: each has the stamp of its row in ", truth.file));
  }

  absl::Status SetClocks(ImageList* color, ImageList* depth, TrackTable* truth) {
    info_.clock = ClockOf(std::min(color->times.front(), depth->times.front()));
    info_.has_clock = info_.clock == Clock::kUnix;
    if (info_.has_clock) return absl::OkStatus();
    const std::string table = (root_ / "rgb.txt").string();
    for (ImageList* list : {color, depth}) {
      for (TimeNs& time_ns : list->times) {
        DSG_ASSIGN_OR_RETURN(time_ns,
                             AddToEpoch(LinePosition{table, 1}, options_.epoch_ns, time_ns));
      }
    }
    if (truth == nullptr) return absl::OkStatus();
    return SetClock(options_, truth, &info_);
  }

  // What the folder says of its camera, or what was published of it.
  absl::StatusOr<CameraCalibration> FindCamera(ImageDecoding* depth) {
    CameraCalibration camera;
    if (IsFile(root_ / "camera-intrinsics.txt")) {
      DSG_ASSIGN_OR_RETURN(const LogFile file, ReadFile("camera-intrinsics.txt"));
      DSG_RETURN_IF_ERROR(ReadIntrinsics(file, &camera));
      return camera;
    }
    if (const std::string name = FindSettings(); !name.empty()) {
      DSG_ASSIGN_OR_RETURN(const LogFile file, ReadFile(name));
      DSG_ASSIGN_OR_RETURN(const RgbdSettings settings, ReadRgbdSettings(file));
      depth->depth_units_per_m = settings.depth_units_per_m;
      info_.notes.push_back(absl::StrCat("the camera is that of ", name));
      return settings.camera;
    }
    const std::string folder = fs::absolute(root_ / "rgb.txt").parent_path().lexically_normal();
    for (const PublishedCamera& known : PublishedCameras()) {
      if (folder.find(known.name) == std::string::npos) continue;
      SetCamera(known, &camera);
      info_.notes.push_back(
          absl::StrCat("no camera-intrinsics.txt: by the folder's name, taken "
                       "for the camera that TUM published for ",
                       known.name));
      return camera;
    }
    SetCamera({"", 525.0, 525.0, 319.5, 239.5, {}}, &camera);
    info_.notes.push_back("no camera-intrinsics.txt: taken for a PrimeSense (525 px)");
    return camera;
  }

  static void SetCamera(const PublishedCamera& known, CameraCalibration* camera) {
    camera->fx = known.fx;
    camera->fy = known.fy;
    camera->cx = known.cx;
    camera->cy = known.cy;
    camera->distortion_coefficients = known.distortion;
    if (!known.distortion.empty()) camera->distortion = Distortion::kRadialTangential;
  }

  // The only file of settings in the folder; none if there are several.
  std::string FindSettings() const {
    std::string found;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(root_, error)) {
      if (entry.path().extension() != ".yaml" || !IsFile(entry.path())) continue;
      if (!found.empty()) return "";
      found = entry.path().filename().string();
    }
    return found;
  }

  // Depth is registered to colour: one camera. The first picture of each says how large it is.
  absl::Status SetCameras(const ImageList& color, const ImageList& depth, ImageDecoding* decoding) {
    DSG_ASSIGN_OR_RETURN(CameraCalibration camera, FindCamera(decoding));
    for (const auto& [channel, list] : {std::pair("color0", &color), std::pair("depth0", &depth)}) {
      camera.name = channel;
      DSG_ASSIGN_OR_RETURN(const ImageHeader header,
                           LoadImageHeader((root_ / list->names.front()).string()));
      camera.width = header.width;
      camera.height = header.height;
      const absl::Status valid = camera.Validate();
      if (!valid.ok()) {
        return MalformedFile(root_.string(), std::string(valid.message()));
      }
      info_.rig.cameras.push_back(camera);
    }
    return absl::OkStatus();
  }

  fs::path root_;
  const LogOptions& options_;
  LogDigest digest_;
  LogInfo info_;
};

}  // namespace

bool IsTumFolder(const std::string& folder) {
  return IsFile(fs::path(folder) / "rgb.txt") && IsFile(fs::path(folder) / "depth.txt");
}

OpenedLog OpenTumFolder(const std::string& folder, const LogOptions& options) {
  return TumFolderReader(folder, options).Open();
}

}  // namespace dsg::ingest
