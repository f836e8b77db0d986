// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/detection_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "ingest/log/body_topology.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"

namespace dsg::ingest {
namespace {

using Json = nlohmann::json;

constexpr size_t kDetectionBytesMax = size_t{1} << 20;
constexpr int kJsonDepthMax = 8;
constexpr double kPixelMax = 1e6;
// A joint is on its own body.
constexpr double kJointMaxM = 10.0;
constexpr double kPelvisMaxM = 1000.0;
constexpr double kMmPerM = 1000.0;
// Axis-angle beyond a full turn, or a shape ten deviations out, is no body.
constexpr double kAngleMax = 10.0;
constexpr double kShapeMax = 50.0;

bool JsonNestsTooDeep(std::string_view text) {
  int depth = 0;
  bool is_in_string = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_in_string && c == '\\') {
      ++i;
      continue;
    }
    if (c == '"') is_in_string = !is_in_string;
    if (is_in_string) continue;
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (depth > kJsonDepthMax) return true;
  }
  return false;
}

// Reads the fields of one object, with errors that name them.
class Fields {
 public:
  Fields(const LinePosition& at, const Json& object) : at_(at), object_(object) {}

  bool Has(const char* key) const { return object_.contains(key); }

  absl::StatusOr<const Json*> Find(const char* key) const {
    const auto found = object_.find(key);
    if (found == object_.end()) {
      return at_.Error(
          absl::StrCat("the detection has no field \"", key, "\"; see docs/sensor_logs.md"));
    }
    return &*found;
  }

  absl::StatusOr<double> Number(const char* key, double min, double max) const {
    DSG_ASSIGN_OR_RETURN(const Json* value, Find(key));
    return Number(key, *value, min, max);
  }

  absl::StatusOr<int64_t> Integer(const char* key) const {
    DSG_ASSIGN_OR_RETURN(const Json* value, Find(key));
    const bool fits = value->is_number_integer() &&
                      (!value->is_number_unsigned() || value->get<uint64_t>() <= INT64_MAX);
    if (!fits) return at_.FieldError(key, Show(*value), "an integer is due");
    return value->get<int64_t>();
  }

  absl::StatusOr<std::string> Text(const char* key) const {
    DSG_ASSIGN_OR_RETURN(const Json* value, Find(key));
    if (!value->is_string()) return at_.FieldError(key, Show(*value), "a text is due");
    return value->get<std::string>();
  }

  // `count` numbers.
  absl::StatusOr<std::vector<double>> List(const char* key, size_t count, double max) const {
    DSG_ASSIGN_OR_RETURN(const Json* value, Find(key));
    return List(key, *value, count, max);
  }

  // `count` lists of three.
  absl::StatusOr<std::vector<Eigen::Vector3d>> Triples(const char* key, size_t count,
                                                       double max) const {
    DSG_ASSIGN_OR_RETURN(const Json* value, Find(key));
    DSG_RETURN_IF_ERROR(CheckSize(key, *value, count));
    std::vector<Eigen::Vector3d> triples;
    for (const Json& item : *value) {
      DSG_ASSIGN_OR_RETURN(const std::vector<double> three, List(key, item, 3, max));
      triples.emplace_back(three[0], three[1], three[2]);
    }
    return triples;
  }

  // Lists of three or one flat list, as far as `count_max` threes; flat.
  absl::StatusOr<std::vector<float>> FlatTriples(const char* key, size_t count_max,
                                                 double max) const {
    DSG_ASSIGN_OR_RETURN(const Json* value, Find(key));
    const bool is_flat = value->is_array() && !value->empty() && value->front().is_number();
    const size_t per_item = is_flat ? 1 : 3;
    if (!value->is_array() || value->size() * per_item > 3 * count_max ||
        (is_flat && value->size() % 3 != 0)) {
      return at_.FieldError(key, absl::StrCat(value->type_name(), " of ", value->size()),
                            absl::StrCat("a list of at most ", count_max, " [x,y,z] is due"));
    }
    std::vector<float> flat;
    flat.reserve(value->size() * per_item);
    for (const Json& item : *value) {
      if (is_flat) {
        DSG_ASSIGN_OR_RETURN(const double number, Number(key, item, -max, max));
        flat.push_back(static_cast<float>(number));
        continue;
      }
      DSG_ASSIGN_OR_RETURN(const std::vector<double> three, List(key, item, 3, max));
      for (const double number : three) flat.push_back(static_cast<float>(number));
    }
    return flat;
  }

  // x y z in whole millimetres, 16 bits each, little-endian, as base64; flat, metres.
  absl::StatusOr<std::vector<float>> Millimetres(const char* key, size_t count_max,
                                                 double max_m) const {
    DSG_ASSIGN_OR_RETURN(const std::string text, Text(key));
    std::string bytes;
    constexpr size_t kVertexBytes = 6;
    if (!absl::Base64Unescape(text, &bytes)) {
      return at_.FieldError(key, absl::StrCat(text.substr(0, 20), "..."),
                            "base64 of 16-bit numbers is due");
    }
    if (bytes.size() % kVertexBytes != 0 || bytes.size() > count_max * kVertexBytes) {
      return at_.FieldError(
          key, absl::StrCat(bytes.size(), " bytes"),
          absl::StrCat("six bytes for each of at most ", count_max, " vertices are due"));
    }
    std::vector<float> flat;
    flat.reserve(bytes.size() / 2);
    for (size_t i = 0; i < bytes.size(); i += 2) {
      const auto low = static_cast<uint8_t>(bytes[i]);
      const auto high = static_cast<uint8_t>(bytes[i + 1]);
      const auto mm = static_cast<int16_t>(static_cast<uint16_t>(low | high << 8));
      const double metres = static_cast<double>(mm) / kMmPerM;
      if (std::abs(metres) > max_m) {
        return at_.FieldError(key, absl::StrCat(mm, " mm"),
                              absl::StrCat("vertex ", i / kVertexBytes, " is to be within ", max_m,
                                           " m of the pelvis"));
      }
      flat.push_back(static_cast<float>(metres));
    }
    return flat;
  }

 private:
  // Nested values are not printed: they may be as large as the line.
  static std::string Show(const Json& value) {
    return value.is_structured() ? value.type_name()
                                 : value.dump(-1, ' ', true, Json::error_handler_t::replace);
  }

  absl::Status CheckSize(const char* key, const Json& value, size_t count) const {
    if (value.is_array() && value.size() == count) return absl::OkStatus();
    return at_.FieldError(key, absl::StrCat(value.type_name(), " of ", value.size()),
                          absl::StrCat("a list of ", count, " is due"));
  }

  absl::StatusOr<double> Number(const char* key, const Json& value, double min, double max) const {
    const double number = value.is_number() ? value.get<double>() : NAN;
    if (number >= min && number <= max) return number;
    return at_.FieldError(key, Show(value),
                          absl::StrCat("a number from ", min, " to ", max, " is due"));
  }

  absl::StatusOr<std::vector<double>> List(const char* key, const Json& value, size_t count,
                                           double max) const {
    DSG_RETURN_IF_ERROR(CheckSize(key, value, count));
    std::vector<double> numbers;
    for (const Json& item : value) {
      DSG_ASSIGN_OR_RETURN(const double number, Number(key, item, -max, max));
      numbers.push_back(number);
    }
    return numbers;
  }

  const LinePosition& at_;
  const Json& object_;
};

absl::Status ReadHead(const LinePosition& at, const Fields& fields, HumanDetection* detection) {
  DSG_ASSIGN_OR_RETURN(detection->time_ns, fields.Integer("time_ns"));
  if (detection->time_ns < 0 || detection->time_ns == kTimeMax) {
    return at.FieldError("time_ns", absl::StrCat(detection->time_ns), "nanoseconds from 0 are due");
  }
  DSG_ASSIGN_OR_RETURN(detection->camera, fields.Text("camera"));
  if (detection->camera.empty() || detection->camera.size() > 64) {
    return at.FieldError("camera", detection->camera, "a channel's name is due, such as cam0");
  }
  DSG_ASSIGN_OR_RETURN(detection->id, fields.Integer("id"));
  DSG_ASSIGN_OR_RETURN(detection->score, fields.Number("score", 0.0, 1.0));
  DSG_ASSIGN_OR_RETURN(const std::vector<double> box, fields.List("box", 4, kPixelMax));
  if (!(box[0] < box[2] && box[1] < box[3])) {
    return at.FieldError("box", absl::StrCat(box[0], " ", box[1], " ", box[2], " ", box[3]),
                         "left < right and top < bottom are due");
  }
  detection->box_px = {box[0], box[1], box[2], box[3]};
  DSG_ASSIGN_OR_RETURN(const int64_t instance, fields.Integer("mask_instance"));
  if (instance < 0 || instance > 65535) {
    return at.FieldError("mask_instance", absl::StrCat(instance), "0 to 65535 is due");
  }
  detection->mask_instance = static_cast<int>(instance);
  return absl::OkStatus();
}

absl::Status ReadJoints(const LinePosition& at, const Fields& fields, HumanDetection* detection) {
  detection->has_joints = fields.Has("joints");
  if (!detection->has_joints) {
    detection->joints_root.fill(Eigen::Vector3d::Zero());
    detection->joints_px.fill(Eigen::Vector2d::Zero());
    if (!fields.Has("joints_px")) return absl::OkStatus();
    return at.Error(
        "the detection has a field \"joints_px\" and no field \"joints\"; give both, or "
        "neither for a box alone");
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<Eigen::Vector3d> joints,
                       fields.Triples("joints", kJointCount, kJointMaxM));
  DSG_ASSIGN_OR_RETURN(const std::vector<Eigen::Vector3d> pixels,
                       fields.Triples("joints_px", kJointCount, kPixelMax));
  for (size_t i = 0; i < size_t{kJointCount}; ++i) {
    detection->joints_root[i] = joints[i];
    detection->joints_px[i] = pixels[i].head<2>();
    detection->joint_visibility[i] = pixels[i].z();
    if (!(pixels[i].z() >= 0.0 && pixels[i].z() <= 1.0)) {
      return at.FieldError("joints_px", absl::StrCat(pixels[i].z()), "visibility is 0 to 1");
    }
  }
  return absl::OkStatus();
}

absl::Status ReadBody(const LinePosition& at, const Fields& fields, HumanDetection* detection) {
  if (fields.Has("pose")) {
    DSG_ASSIGN_OR_RETURN(const std::vector<double> pose,
                         fields.List("pose", kPoseCoefficientCount, kAngleMax));
    detection->pose_coefficients.assign(pose.begin(), pose.end());
  }
  if (fields.Has("shape")) {
    DSG_ASSIGN_OR_RETURN(const std::vector<double> shape,
                         fields.List("shape", kShapeCount, kShapeMax));
    detection->shape_coefficients.assign(shape.begin(), shape.end());
  }
  if (fields.Has("vertices")) {
    DSG_ASSIGN_OR_RETURN(detection->vertices_root,
                         fields.FlatTriples("vertices", kBodyVertexCountMax, kJointMaxM));
  }
  if (fields.Has("vertices_mm")) {
    if (fields.Has("vertices")) {
      return at.Error("the detection has both \"vertices\" and \"vertices_mm\"; give one of them");
    }
    DSG_ASSIGN_OR_RETURN(detection->vertices_root,
                         fields.Millimetres("vertices_mm", kBodyVertexCountMax, kJointMaxM));
  }
  return absl::OkStatus();
}

absl::Status ReadPelvis(const LinePosition& at, const Fields& fields, HumanDetection* detection) {
  DSG_ASSIGN_OR_RETURN(const std::vector<double> pelvis, fields.List("pelvis", 3, kPelvisMaxM));
  if (!(pelvis[2] > 0.0)) {
    return at.FieldError("pelvis", absl::StrCat(pelvis[0], " ", pelvis[1], " ", pelvis[2]),
                         "a point before the camera is due, z above 0");
  }
  detection->pelvis_camera = Eigen::Vector3d(pelvis[0], pelvis[1], pelvis[2]);
  return absl::OkStatus();
}

absl::Status ReadWeakCamera(const LinePosition& at, const Json& value, HumanDetection* detection) {
  if (!value.is_object())
    return at.FieldError("weak_camera", value.type_name(), "an object is due");
  const Fields fields(at, value);
  DSG_ASSIGN_OR_RETURN(detection->weak_scale, fields.Number("scale", 0.0, kPixelMax));
  DSG_ASSIGN_OR_RETURN(const std::vector<double> t, fields.List("t", 2, kPixelMax));
  DSG_ASSIGN_OR_RETURN(const std::vector<double> center, fields.List("crop_center", 2, kPixelMax));
  DSG_ASSIGN_OR_RETURN(detection->crop_px, fields.Number("crop_px", 0.0, kPixelMax));
  detection->weak_translation = {t[0], t[1]};
  detection->crop_center_px = {center[0], center[1]};
  return absl::OkStatus();
}

// A box alone is placed by its height; joints need a camera of one kind.
absl::Status ReadPlacement(const LinePosition& at, const Fields& fields,
                           HumanDetection* detection) {
  const bool has_pelvis = fields.Has("pelvis");
  if (has_pelvis) DSG_RETURN_IF_ERROR(ReadPelvis(at, fields, detection));
  const bool may_be_missing = has_pelvis || !detection->has_joints;
  if (may_be_missing && !fields.Has("weak_camera")) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const Json* weak_camera, fields.Find("weak_camera"));
  return ReadWeakCamera(at, *weak_camera, detection);
}

}  // namespace

absl::StatusOr<HumanDetection> ParseDetection(const LinePosition& at, std::string_view line) {
  if (line.size() > kDetectionBytesMax) {
    return at.Error(absl::StrCat("the line has ", line.size(), " bytes; a detection has at most ",
                                 kDetectionBytesMax));
  }
  if (!IsUtf8(line)) return at.Error("the line is not UTF-8; is this a table of detections?");
  if (JsonNestsTooDeep(line)) return at.Error("the line nests too deep for a detection");
  const Json object = Json::parse(line, nullptr, false);
  if (!object.is_object()) {
    return at.Error("is no JSON object; was the line cut? Correct or remove it");
  }
  const Fields fields(at, object);
  HumanDetection detection;
  DSG_RETURN_IF_ERROR(ReadHead(at, fields, &detection));
  DSG_RETURN_IF_ERROR(ReadJoints(at, fields, &detection));
  DSG_RETURN_IF_ERROR(ReadBody(at, fields, &detection));
  DSG_RETURN_IF_ERROR(ReadPlacement(at, fields, &detection));
  return detection;
}

}  // namespace dsg::ingest
