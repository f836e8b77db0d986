// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/detection_json.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace dsg::simulator {
namespace {

constexpr int kMetreDecimals = 4;
constexpr int kPixelDecimals = 2;
constexpr int kScaleDecimals = 6;

std::string Number(double value, int decimals) {
  const std::string text = absl::StrFormat("%.*f", decimals, value);
  // "-0.00" and "0.00" are one number, so they get one spelling.
  const bool is_zero = text.find_first_not_of("-0.") == std::string::npos;
  return is_zero ? absl::StrFormat("%.*f", decimals, 0.0) : text;
}

// `values` has size() and operator[].
template <typename Values>
std::string List(const Values& values, int decimals) {
  std::string text = "[";
  for (decltype(values.size()) i = 0; i < values.size(); ++i) {
    absl::StrAppend(&text, i > 0 ? "," : "", Number(values[i], decimals));
  }
  return text + "]";
}

std::string Quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (static_cast<unsigned char>(c) < 0x20) {
      absl::StrAppendFormat(&out, "\\u%04x", static_cast<unsigned char>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string JointsText(const ingest::HumanDetection& detection) {
  std::string text = ",\"joints\":[";
  for (int j = 0; j < ingest::kJointCount; ++j) {
    absl::StrAppend(&text, j > 0 ? "," : "", List(detection.joints_root[j], kMetreDecimals));
  }
  absl::StrAppend(&text, "],\"joints_px\":[");
  for (int j = 0; j < ingest::kJointCount; ++j) {
    absl::StrAppend(&text, j > 0 ? ",[" : "[", Number(detection.joints_px[j].x(), kPixelDecimals),
                    ",", Number(detection.joints_px[j].y(), kPixelDecimals), ",",
                    Number(detection.joint_visibility[j], kPixelDecimals), "]");
  }
  return text + "]";
}

// Whole millimetres, 16 bits each, little-endian, as base64: a third of the numbers' text.
std::string VerticesText(const std::vector<float>& vertices_root) {
  constexpr double kLargestMm = 10'000.0;
  std::string bytes;
  bytes.reserve(2 * vertices_root.size());
  for (const float number : vertices_root) {
    const double mm = std::clamp(1000.0 * static_cast<double>(number), -kLargestMm, kLargestMm);
    const auto bits = static_cast<uint16_t>(std::lround(mm));
    bytes.push_back(static_cast<char>(bits & 0xff));
    bytes.push_back(static_cast<char>(bits >> 8));
  }
  return absl::StrCat(",\"vertices_mm\":\"", absl::Base64Escape(bytes), "\"");
}

}  // namespace

std::string TopologyJson(size_t vertex_count, const std::vector<std::array<uint32_t, 3>>& faces) {
  std::string text = absl::StrCat("{\"vertex_count\":", vertex_count, ",\"faces\":[");
  for (size_t i = 0; i < faces.size(); ++i) {
    const auto& [a, b, c] = faces[i];
    absl::StrAppend(&text, i > 0 ? ",[" : "[", a, ",", b, ",", c, "]");
  }
  return text + "]}\n";
}

std::string DetectionJson(const ingest::HumanDetection& detection) {
  std::string text =
      absl::StrCat("{\"time_ns\":", detection.time_ns, ",\"camera\":", Quoted(detection.camera),
                   ",\"id\":", detection.id, ",\"score\":", Number(detection.score, kMetreDecimals),
                   ",\"box\":", List(detection.box_px, kPixelDecimals),
                   ",\"mask_instance\":", detection.mask_instance, JointsText(detection));
  if (!detection.pose_coefficients.empty()) {
    absl::StrAppend(&text, ",\"pose\":", List(detection.pose_coefficients, kMetreDecimals));
  }
  if (!detection.shape_coefficients.empty()) {
    absl::StrAppend(&text, ",\"shape\":", List(detection.shape_coefficients, kMetreDecimals));
  }
  if (!detection.vertices_root.empty()) text += VerticesText(detection.vertices_root);
  absl::StrAppend(&text,
                  ",\"weak_camera\":{\"scale\":", Number(detection.weak_scale, kScaleDecimals),
                  ",\"t\":", List(detection.weak_translation, kScaleDecimals),
                  ",\"crop_center\":", List(detection.crop_center_px, kPixelDecimals),
                  ",\"crop_px\":", Number(detection.crop_px, kPixelDecimals), "}}");
  return text;
}

}  // namespace dsg::simulator
