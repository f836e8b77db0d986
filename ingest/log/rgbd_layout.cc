// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/rgbd_layout.h"

#include <charconv>
#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/calibration_file.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/image_channel.h"
#include "ingest/log/rgbd_poses.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

using Names = std::map<int64_t, std::string>;

// A rotation that is further off than this was not merely printed with few digits.
constexpr double kNotedDeviation = 1e-3;

// "frame-000008.color.jpg" with what stands around the number; nullopt for other names.
std::optional<int64_t> FrameNumber(std::string_view name, std::string_view prefix,
                                   std::string_view suffix) {
  if (name.size() <= prefix.size() + suffix.size() || !name.starts_with(prefix) ||
      !name.ends_with(suffix)) {
    return std::nullopt;
  }
  const std::string_view digits =
      name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
  int64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool is_number = error == std::errc() && end == digits.data() + digits.size();
  // Frame numbers times a period of a day still fit in nanoseconds.
  if (!is_number || number < 0 || number > 100'000'000) return std::nullopt;
  return number;
}

Names FindFrames(const fs::path& folder, std::string_view prefix, std::string_view suffix) {
  Names names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (const auto number = FrameNumber(name, prefix, suffix)) names[*number] = name;
  }
  return names;
}

// The first of the endings that occurs.
Names FindImages(const fs::path& folder, std::string_view prefix,
                 const std::vector<std::string>& suffixes) {
  for (const std::string& suffix : suffixes) {
    Names names = FindFrames(folder, prefix, suffix);
    if (!names.empty()) return names;
  }
  return {};
}

const std::vector<std::string>& ColorSuffixes() {
  static const auto* const suffixes = new std::vector<std::string>{".jpg", ".jpeg", ".png"};
  return *suffixes;
}

// 7-Scenes puts the frames into a folder; some copies do not.
fs::path SevenScenesFolder(const fs::path& root) {
  return FindFrames(root, "frame-", ".depth.png").empty() ? root / "frames" : root;
}

class LayoutReader {
 public:
  LayoutReader(const std::string& folder, LogDigest* digest) : root_(folder), digest_(digest) {}

  absl::StatusOr<RgbdFrames> Read(RgbdLayout layout) {
    switch (layout) {
      case RgbdLayout::kSevenScenes:
        DSG_RETURN_IF_ERROR(ReadSevenScenes());
        break;
      case RgbdLayout::kRedwood:
        DSG_RETURN_IF_ERROR(ReadRedwood());
        break;
      case RgbdLayout::kReplica:
        DSG_RETURN_IF_ERROR(ReadReplica());
        break;
      case RgbdLayout::kKimera:
        DSG_RETURN_IF_ERROR(ReadKimera());
        break;
      case RgbdLayout::kNone:
        break;
    }
    DSG_RETURN_IF_ERROR(CheckPairs());
    return std::move(frames_);
  }

 private:
  absl::StatusOr<LogFile> ReadTable(const fs::path& path) {
    DSG_ASSIGN_OR_RETURN(LogFile file, ReadLogFile(path.string()));
    digest_->Add(path.lexically_relative(root_).string(), file.bytes);
    return file;
  }

  void Add(const std::string& channel, const fs::path& folder, Names names) {
    for (const auto& [number, name] : names) {
      std::error_code error;
      const uintmax_t size = fs::file_size(folder / name, error);
      digest_->AddSize(absl::StrCat(channel, "/", name), error ? 0 : size);
    }
    frames_.sets.push_back({channel, DecodingOf(channel), folder.string(), std::move(names)});
  }

  // Depth and colour of one camera, which is the body.
  void AddPair(const fs::path& color_folder, Names color, const fs::path& depth_folder,
               Names depth) {
    Add("color0", color_folder, std::move(color));
    Add("depth0", depth_folder, std::move(depth));
  }

  void SetPoses(FramePoses poses, bool is_camera) {
    if (poses.deviation_max > kNotedDeviation) {
      frames_.notes.push_back(absl::StrCat("rotations were off by up to ", poses.deviation_max,
                                           " from orthonormal and were mended"));
    }
    if (is_camera && !poses.map_T_camera.empty()) {
      frames_.notes.push_back("the poses are the camera's: the body is the camera");
    }
    frames_.map_T_body = std::move(poses.map_T_camera);
    frames_.stamps = std::move(poses.stamps);
  }

  // Takes the size from the first image of each channel.
  absl::Status SetCameras(const CameraCalibration& camera) {
    for (const FrameSet& set : frames_.sets) {
      CameraCalibration own = camera;
      own.name = set.channel;
      const std::string path = (fs::path(set.folder) / set.names.begin()->second).string();
      DSG_ASSIGN_OR_RETURN(const ImageHeader header, LoadImageHeader(path));
      own.width = header.width;
      own.height = header.height;
      const absl::Status valid = own.Validate();
      if (!valid.ok()) {
        return MakeError(Reason::kFileMalformed,
                         absl::StrCat(root_.string(), ": ", valid.message()),
                         {{"file", root_.string()}});
      }
      frames_.rig.cameras.push_back(std::move(own));
    }
    return absl::OkStatus();
  }

  absl::Status SetDefaultCameras(double fx, double cx, double cy, const std::string& whose) {
    CameraCalibration camera;
    camera.fx = camera.fy = fx;
    camera.cx = cx;
    camera.cy = cy;
    frames_.notes.push_back(absl::StrCat("no camera-intrinsics.txt: taken for ", whose));
    return SetCameras(camera);
  }

  absl::StatusOr<bool> SetCamerasFromFile() {
    const fs::path path = root_ / "camera-intrinsics.txt";
    if (!IsFile(path)) return false;
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadTable(path));
    CameraCalibration camera;
    DSG_RETURN_IF_ERROR(ReadIntrinsics(file, &camera));
    DSG_RETURN_IF_ERROR(SetCameras(camera));
    return true;
  }

  absl::Status ReadSevenScenes() {
    const fs::path folder = SevenScenesFolder(root_);
    AddPair(folder, FindImages(folder, "frame-", {".color.jpg", ".color.png"}), folder,
            FindFrames(folder, "frame-", ".depth.png"));
    frames_.sets.back().decoding.is_max_no_reading = true;
    FramePoses poses;
    int64_t lost_count = 0;
    for (const auto& [number, name] : FindFrames(folder, "frame-", ".pose.txt")) {
      DSG_ASSIGN_OR_RETURN(const LogFile file, ReadTable(folder / name));
      // How trackers of this layout write that they were lost.
      if (file.bytes.find("inf") != std::string::npos ||
          file.bytes.find("nan") != std::string::npos) {
        ++lost_count;
        continue;
      }
      DSG_RETURN_IF_ERROR(AddMatrixFile(file, number, &poses));
    }
    if (lost_count > 0) {
      frames_.notes.push_back(absl::StrCat(lost_count, " frames have no pose: tracking was lost"));
    }
    SetPoses(std::move(poses), true);
    DSG_ASSIGN_OR_RETURN(const bool has_file, SetCamerasFromFile());
    if (!has_file) frames_.notes.push_back("no camera-intrinsics.txt: no calibration");
    return absl::OkStatus();
  }

  absl::Status ReadRedwood() {
    AddPair(root_ / "image", FindImages(root_ / "image", "", ColorSuffixes()), root_ / "depth",
            FindFrames(root_ / "depth", "", ".png"));
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadTable(root_ / "trajectory.log"));
    DSG_ASSIGN_OR_RETURN(FramePoses poses, ReadRedwoodTrajectory(file));
    SetPoses(std::move(poses), true);
    DSG_ASSIGN_OR_RETURN(const bool has_file, SetCamerasFromFile());
    if (has_file) return absl::OkStatus();
    return SetDefaultCameras(525.0, 319.5, 239.5, "a PrimeSense, as Open3D does");
  }

  absl::Status ReadReplica() {
    const fs::path folder = root_ / "results";
    AddPair(folder, FindImages(folder, "frame", ColorSuffixes()), folder,
            FindFrames(folder, "depth", ".png"));
    frames_.sets.back().decoding.depth_units_per_m = 6553.5;
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadTable(root_ / "traj.txt"));
    DSG_ASSIGN_OR_RETURN(FramePoses poses, ReadMatrixLines(file));
    SetPoses(std::move(poses), true);
    frames_.notes.push_back("depth counts 1 / 6553.5 m, as renderings of Replica do");
    DSG_ASSIGN_OR_RETURN(const bool has_file, SetCamerasFromFile());
    if (has_file) return absl::OkStatus();
    return SetDefaultCameras(600.0, 599.5, 339.5, "the usual rendering of Replica");
  }

  absl::Status AddYamlCamera(const std::string& file_name, const std::string& channel) {
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadTable(root_ / file_name));
    DSG_ASSIGN_OR_RETURN(CameraCalibration camera, ReadCameraYaml(file, channel));
    frames_.rig.cameras.push_back(std::move(camera));
    return absl::OkStatus();
  }

  absl::Status ReadKimera() {
    const Names left = FindFrames(root_, "left_img_", ".png");
    if (left.empty()) return ReadKimeraPair();
    const Names right = FindFrames(root_, "right_img_", ".png");
    const Names depth = FindFrames(root_, "depth_img_", ".tiff");
    if (right.empty()) {
      AddPair(root_, left, root_, depth);
      DSG_RETURN_IF_ERROR(AddYamlCamera("sensorLeft.yaml", "color0"));
      DSG_RETURN_IF_ERROR(AddYamlCamera("sensorLeft.yaml", "depth0"));
    } else {
      Add("cam0", root_, left);
      Add("cam1", root_, right);
      DSG_RETURN_IF_ERROR(AddYamlCamera("sensorLeft.yaml", "cam0"));
      DSG_RETURN_IF_ERROR(AddYamlCamera("sensorRight.yaml", "cam1"));
    }
    if (!IsFile(root_ / "poses.csv")) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadTable(root_ / "poses.csv"));
    DSG_ASSIGN_OR_RETURN(FramePoses poses, ReadIndexedPoses(file));
    SetPoses(std::move(poses), false);
    return absl::OkStatus();
  }

  absl::Status ReadKimeraPair() {
    AddPair(root_, FindFrames(root_, "img_", ".png"), root_, FindFrames(root_, "depth_", ".tiff"));
    frames_.notes.push_back("no sensorLeft.yaml: no calibration");
    if (!IsFile(root_ / "image_poses.yaml")) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const LogFile file, ReadTable(root_ / "image_poses.yaml"));
    DSG_ASSIGN_OR_RETURN(const std::vector<NumberedPose> list, ReadPosesYaml(file));
    FramePoses poses;
    for (const NumberedPose& pose : list) poses.map_T_camera[pose.number] = pose.map_T_camera;
    SetPoses(std::move(poses), true);
    return absl::OkStatus();
  }

  // Each frame has all its images.
  absl::Status CheckPairs() const {
    for (const FrameSet& set : frames_.sets) {
      for (const FrameSet& other : frames_.sets) {
        for (const auto& [number, name] : set.names) {
          if (other.names.contains(number)) continue;
          const std::string path = (fs::path(set.folder) / name).string();
          return MakeError(Reason::kFileMalformed,
                           absl::StrCat(path, ": frame ", number, " has no image of channel ",
                                        other.channel, "; copy it, or remove the frame"),
                           {{"file", path}});
        }
      }
    }
    return absl::OkStatus();
  }

  fs::path root_;
  LogDigest* digest_;
  RgbdFrames frames_;
};

}  // namespace

RgbdLayout FindRgbdLayout(const std::string& folder) {
  const fs::path root(folder);
  if (!FindFrames(SevenScenesFolder(root), "frame-", ".depth.png").empty()) {
    return RgbdLayout::kSevenScenes;
  }
  if (IsFile(root / "trajectory.log") && !FindFrames(root / "depth", "", ".png").empty()) {
    return RgbdLayout::kRedwood;
  }
  if (IsFile(root / "traj.txt") && !FindFrames(root / "results", "depth", ".png").empty()) {
    return RgbdLayout::kReplica;
  }
  const bool has_left = !FindFrames(root, "left_img_", ".png").empty();
  const bool has_pair =
      !FindFrames(root, "img_", ".png").empty() && !FindFrames(root, "depth_", ".tiff").empty();
  if ((has_left && IsFile(root / "sensorLeft.yaml")) || has_pair) return RgbdLayout::kKimera;
  return RgbdLayout::kNone;
}

absl::StatusOr<RgbdFrames> ReadRgbdFolder(const std::string& folder, RgbdLayout layout,
                                          LogDigest* digest) {
  return LayoutReader(folder, digest).Read(layout);
}

}  // namespace dsg::ingest
