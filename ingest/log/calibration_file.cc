// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/calibration_file.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "ingest/log/rigid_matrix.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"
#include "schema/files/yaml_text.h"

namespace dsg::ingest {
namespace {

constexpr size_t kCalibrationBytesMax = size_t{1} << 20;

// One map of a file, with errors that name the file and the line.
class Section {
 public:
  Section(const LogFile& file, YAML::Node node) : file_(file), node_(std::move(node)) {}

  LinePosition At(const YAML::Node& node) const { return {file_.path, node.Mark().line + 1}; }
  absl::Status Missing(const std::string& field) const {
    return At(node_).Error(absl::StrCat("the field ", field, " is missing; add it"));
  }
  bool Has(const std::string& field) const { return node_[field].IsDefined(); }

  absl::StatusOr<std::string> Text(const std::string& field) const {
    const YAML::Node value = node_[field];
    if (!value.IsDefined()) return Missing(field);
    if (!value.IsScalar()) return At(value).Error(absl::StrCat("field ", field, " is no scalar"));
    return value.Scalar();
  }

  absl::StatusOr<double> Number(const std::string& field) const {
    DSG_ASSIGN_OR_RETURN(const std::string text, Text(field));
    return ParseNumber(At(node_[field]), field, text);
  }

  absl::StatusOr<std::vector<double>> Numbers(const std::string& field) const {
    const YAML::Node list = node_[field];
    if (!list.IsDefined()) return Missing(field);
    if (!list.IsSequence()) return At(list).Error(absl::StrCat("field ", field, " is no list"));
    std::vector<double> numbers;
    for (const YAML::Node& item : list) {
      if (!item.IsScalar() || numbers.size() == 64) {
        return At(item).Error(absl::StrCat("field ", field, " is no list of a few numbers"));
      }
      DSG_ASSIGN_OR_RETURN(const double number, ParseNumber(At(item), field, item.Scalar()));
      numbers.push_back(number);
    }
    return numbers;
  }

  // Either a plain list of 16, or OpenCV's {cols, rows, data}.
  absl::StatusOr<Pose3d> Pose(const std::string& field) const {
    const YAML::Node value = node_[field];
    if (!value.IsDefined()) return Missing(field);
    DSG_ASSIGN_OR_RETURN(const std::vector<double> numbers,
                         value.IsMap() ? Section(file_, value).Numbers("data") : Numbers(field));
    if (numbers.size() != 16) {
      return At(value).Error(absl::StrCat("field ", field, " holds ", numbers.size(),
                                          " numbers; 16 are due, row by row"));
    }
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix(numbers.data());
    const absl::StatusOr<RigidMatrix> rigid = ToRigid(matrix);
    if (!rigid.ok()) {
      return At(value).Error(absl::StrCat("field ", field, ": ", rigid.status().message()));
    }
    return rigid->pose;
  }

  absl::StatusOr<Section> Child(const std::string& field) const {
    const YAML::Node value = node_[field];
    if (!value.IsDefined()) return Missing(field);
    if (!value.IsMap()) return At(value).Error(absl::StrCat("field ", field, " is no map"));
    return Section(file_, value);
  }

  const YAML::Node& node() const { return node_; }

 private:
  const LogFile& file_;
  YAML::Node node_;
};

absl::StatusOr<Section> ParseYaml(const LogFile& file) {
  const LinePosition at{file.path, 1};
  if (file.bytes.size() > kCalibrationBytesMax) {
    return at.Error(absl::StrCat("holds ", file.bytes.size(), " bytes; a calibration has at most ",
                                 kCalibrationBytesMax));
  }
  std::string text = file.bytes;
  if (YamlNestsTooDeep(text)) return at.Error("nests too deep for a calibration");
  // OpenCV writes a directive that YAML does not know: as a comment it keeps its line.
  if (text.starts_with("%YAML")) text[0] = '#';
  YAML::Node root = YAML::Load(text);
  if (!root.IsMap()) return at.Error("is no map of fields; is this a calibration?");
  return Section(file, root);
}

// yaml-cpp reports by exceptions; here they end.
template <typename T>
absl::StatusOr<T> Guarded(const LogFile& file,
                          absl::StatusOr<T> (*read)(const Section&, const std::string&),
                          const std::string& name) {
  try {
    DSG_ASSIGN_OR_RETURN(const Section section, ParseYaml(file));
    return read(section, name);
  } catch (const YAML::Exception& error) {
    return LinePosition{file.path, error.mark.line + 1}.Error(
        absl::StrCat("does not parse as YAML: ", error.msg, "; correct the file"));
  } catch (const std::exception& error) {
    return LinePosition{file.path, 1}.Error(
        absl::StrCat("does not parse as YAML: ", error.what(), "; correct the file"));
  }
}

// What Validate() says of the numbers, with the file's name.
template <typename Calibration>
absl::Status Check(const Section& section, const Calibration& calibration) {
  const absl::Status status = calibration.Validate();
  if (status.ok()) return status;
  return section.At(section.node()).Error(std::string(status.message()));
}

absl::Status CheckType(const Section& section, const std::string& type) {
  if (!section.Has("sensor_type")) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const std::string found, section.Text("sensor_type"));
  if (found == type) return absl::OkStatus();
  return section.At(section.node())
      .FieldError("sensor_type", found, absl::StrCat(type, " is due here"));
}

// Of the coefficients that the camera has; all zero is none.
void KeepDistortion(Distortion distortion, CameraCalibration* camera) {
  const std::vector<double>& k = camera->distortion_coefficients;
  const bool is_none = std::all_of(k.begin(), k.end(), [](double value) { return value == 0.0; });
  camera->distortion = is_none ? Distortion::kNone : distortion;
  if (is_none) camera->distortion_coefficients.clear();
}

absl::Status ReadDistortion(const Section& section, CameraCalibration* camera) {
  if (!section.Has("distortion_model")) return section.Missing("distortion_model");
  DSG_ASSIGN_OR_RETURN(const std::string model, section.Text("distortion_model"));
  if (model == "none") return absl::OkStatus();
  if (model == "radial-tangential" || model == "radtan" || model == "plumb_bob") {
    camera->distortion = Distortion::kRadialTangential;
  } else if (model == "equidistant") {
    camera->distortion = Distortion::kEquidistant;
  } else {
    return section.At(section.node())
        .FieldError("distortion_model", model, "use radial-tangential, equidistant or none");
  }
  DSG_ASSIGN_OR_RETURN(camera->distortion_coefficients, section.Numbers("distortion_coefficients"));
  KeepDistortion(camera->distortion, camera);
  return absl::OkStatus();
}

absl::StatusOr<CameraCalibration> ReadCamera(const Section& section, const std::string& name) {
  CameraCalibration camera;
  camera.name = name;
  DSG_RETURN_IF_ERROR(CheckType(section, "camera"));
  if (section.Has("camera_model")) {
    DSG_ASSIGN_OR_RETURN(const std::string model, section.Text("camera_model"));
    if (model != "pinhole") {
      return section.At(section.node())
          .FieldError("camera_model", model, "only pinhole cameras are known");
    }
  }
  DSG_ASSIGN_OR_RETURN(camera.body_T_camera, section.Pose("T_BS"));
  if (section.Has("rate_hz")) {
    DSG_ASSIGN_OR_RETURN(camera.rate_hz, section.Number("rate_hz"));
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<double> size, section.Numbers("resolution"));
  if (size.size() != 2 || !(std::abs(size[0]) < 1e6) || !(std::abs(size[1]) < 1e6)) {
    return section.At(section.node()).Error("field resolution must be [width, height]");
  }
  camera.width = static_cast<int>(size[0]);
  camera.height = static_cast<int>(size[1]);
  DSG_ASSIGN_OR_RETURN(const std::vector<double> focal, section.Numbers("intrinsics"));
  if (focal.size() != 4) {
    return section.At(section.node())
        .Error(absl::StrCat("field intrinsics holds ", focal.size(),
                            " numbers; [fu, fv, cu, cv] are due"));
  }
  camera.fx = focal[0];
  camera.fy = focal[1];
  camera.cx = focal[2];
  camera.cy = focal[3];
  DSG_RETURN_IF_ERROR(ReadDistortion(section, &camera));
  DSG_RETURN_IF_ERROR(Check(section, camera));
  return camera;
}

absl::StatusOr<ImuCalibration> ReadImu(const Section& section, const std::string& name) {
  ImuCalibration imu;
  imu.name = name;
  DSG_RETURN_IF_ERROR(CheckType(section, "imu"));
  if (section.Has("T_BS")) {
    DSG_ASSIGN_OR_RETURN(imu.body_T_imu, section.Pose("T_BS"));
  }
  DSG_ASSIGN_OR_RETURN(imu.rate_hz, section.Number("rate_hz"));
  DSG_ASSIGN_OR_RETURN(imu.gyro_noise_density, section.Number("gyroscope_noise_density"));
  DSG_ASSIGN_OR_RETURN(imu.gyro_random_walk, section.Number("gyroscope_random_walk"));
  DSG_ASSIGN_OR_RETURN(imu.accel_noise_density, section.Number("accelerometer_noise_density"));
  DSG_ASSIGN_OR_RETURN(imu.accel_random_walk, section.Number("accelerometer_random_walk"));
  DSG_RETURN_IF_ERROR(Check(section, imu));
  return imu;
}

absl::StatusOr<RgbdSettings> ReadSettings(const Section& section, const std::string&) {
  RgbdSettings settings;
  CameraCalibration& camera = settings.camera;
  DSG_ASSIGN_OR_RETURN(camera.fx, section.Number("Camera.fx"));
  DSG_ASSIGN_OR_RETURN(camera.fy, section.Number("Camera.fy"));
  DSG_ASSIGN_OR_RETURN(camera.cx, section.Number("Camera.cx"));
  DSG_ASSIGN_OR_RETURN(camera.cy, section.Number("Camera.cy"));
  for (const char* const name : {"Camera.k1", "Camera.k2", "Camera.p1", "Camera.p2", "Camera.k3"}) {
    double value = 0.0;
    if (section.Has(name)) {
      DSG_ASSIGN_OR_RETURN(value, section.Number(name));
    }
    camera.distortion_coefficients.push_back(value);
  }
  KeepDistortion(Distortion::kRadialTangential, &camera);
  if (!section.Has("DepthMapFactor")) return settings;
  DSG_ASSIGN_OR_RETURN(settings.depth_units_per_m, section.Number("DepthMapFactor"));
  if (settings.depth_units_per_m >= 1.0 && settings.depth_units_per_m <= 65536.0) return settings;
  return section.At(section.node())
      .FieldError("DepthMapFactor", absl::StrCat(settings.depth_units_per_m),
                  "1 to 65536 units a metre are due");
}

absl::StatusOr<std::vector<NumberedPose>> ReadPoses(const Section& section, const std::string&) {
  std::vector<NumberedPose> poses;
  for (const auto& entry : section.node()) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
    const LinePosition at = section.At(entry.first);
    NumberedPose pose;
    DSG_ASSIGN_OR_RETURN(pose.number, ParseFrame(at, key));
    DSG_ASSIGN_OR_RETURN(const Section both, section.Child(key));
    DSG_ASSIGN_OR_RETURN(const Section q, both.Child("q"));
    DSG_ASSIGN_OR_RETURN(const Section t, both.Child("t"));
    Eigen::Quaterniond rotation;
    DSG_ASSIGN_OR_RETURN(rotation.w(), q.Number("w"));
    DSG_ASSIGN_OR_RETURN(rotation.x(), q.Number("x"));
    DSG_ASSIGN_OR_RETURN(rotation.y(), q.Number("y"));
    DSG_ASSIGN_OR_RETURN(rotation.z(), q.Number("z"));
    DSG_ASSIGN_OR_RETURN(pose.map_T_camera.orientation, Normalize(at, rotation));
    DSG_ASSIGN_OR_RETURN(pose.map_T_camera.position.x(), t.Number("x"));
    DSG_ASSIGN_OR_RETURN(pose.map_T_camera.position.y(), t.Number("y"));
    DSG_ASSIGN_OR_RETURN(pose.map_T_camera.position.z(), t.Number("z"));
    poses.push_back(pose);
  }
  std::sort(poses.begin(), poses.end(),
            [](const NumberedPose& a, const NumberedPose& b) { return a.number < b.number; });
  return poses;
}

}  // namespace

absl::StatusOr<CameraCalibration> ReadCameraYaml(const LogFile& file, const std::string& name) {
  return Guarded<CameraCalibration>(file, &ReadCamera, name);
}

absl::StatusOr<RgbdSettings> ReadRgbdSettings(const LogFile& file) {
  return Guarded<RgbdSettings>(file, &ReadSettings, "");
}

absl::StatusOr<ImuCalibration> ReadImuYaml(const LogFile& file, const std::string& name) {
  return Guarded<ImuCalibration>(file, &ReadImu, name);
}

absl::StatusOr<std::vector<NumberedPose>> ReadPosesYaml(const LogFile& file) {
  return Guarded<std::vector<NumberedPose>>(file, &ReadPoses, "");
}

}  // namespace dsg::ingest
