// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/place_memory.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/bit_stream.h"

namespace dsg::ingest {
namespace {

constexpr std::string_view kMagic = "dsgplace";
constexpr uint64_t kVersion = 1;
constexpr size_t kPartBytes = size_t{1} << 20;
// More than any image has (sensor/image.h).
constexpr uint64_t kPixelMax = uint64_t{1} << 20;
constexpr size_t kFeatureBytes = sizeof(OrbDescriptor) + 5 * sizeof(float);

constexpr OptionField<PlaceMemoryOptions> kMemoryFields[] = {
    {"remember-way", &PlaceMemoryOptions::way_m, 0.0, 100.0,
     "Keyframes this far from all that are remembered are kept for other sessions, metres: views "
     "that are twice as far apart are known again"},
    {"remember-turn", &PlaceMemoryOptions::turn_deg, 0.0, 180.0,
     "... or turned by this, degrees: the same"},
    {"remember-count", &PlaceMemoryOptions::keyframe_count_max, 2, 10'000,
     "Keyframes at most; then every way and turn is taken twice as large: 52 MB"},
    {"remember-features", &PlaceMemoryOptions::feature_count_max, 10, 10'000,
     "Features of each, the strongest ones: as many as vote"},
};

bool IsSame(const CameraCalibration& a, const CameraCalibration& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
         a.cx == b.cx && a.cy == b.cy && a.body_T_camera.position == b.body_T_camera.position &&
         a.body_T_camera.orientation.coeffs() == b.body_T_camera.orientation.coeffs();
}

void AppendCamera(const CameraCalibration& camera, std::string* out) {
  AppendVarint(static_cast<uint64_t>(camera.width), out);
  AppendVarint(static_cast<uint64_t>(camera.height), out);
  for (const double number : {camera.fx, camera.fy, camera.cx, camera.cy}) AppendFixed(number, out);
  for (int i = 0; i < 3; ++i) AppendFixed(camera.body_T_camera.position[i], out);
  for (int i = 0; i < 4; ++i) AppendFixed(camera.body_T_camera.orientation.coeffs()[i], out);
}

void AppendFeature(const OrbDescriptor& descriptor, const KeyframeFeature& feature,
                   std::string* out) {
  out->append(reinterpret_cast<const char*>(descriptor.data()), descriptor.size());
  for (const float number : {feature.pixel.x(), feature.pixel.y(), feature.pixel_sigma_px,
                             feature.depth_m, feature.depth_sigma_m}) {
    AppendFixed(number, out);
  }
}

absl::Status Damaged(const std::string& what) {
  return MakeError(Reason::kStoreCorrupt, absl::StrCat("remembered places are damaged: ", what,
                                                       "; ingest their log again"));
}

std::optional<CameraCalibration> ReadCamera(ByteReader* reader) {
  CameraCalibration camera;
  camera.name = "cam0";
  const uint64_t width = reader->Varint();
  const uint64_t height = reader->Varint();
  for (double* const number : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) {
    *number = reader->Fixed<double>();
  }
  for (int i = 0; i < 3; ++i) camera.body_T_camera.position[i] = reader->Fixed<double>();
  for (int i = 0; i < 4; ++i)
    camera.body_T_camera.orientation.coeffs()[i] = reader->Fixed<double>();
  if (!reader->ok() || width >= kPixelMax || height >= kPixelMax) return std::nullopt;
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
  return camera.Validate().ok() ? std::optional(camera) : std::nullopt;
}

bool ReadFeature(const CameraCalibration& camera, ByteReader* reader, KeyframeFeatures* keyframe) {
  OrbDescriptor& descriptor = keyframe->descriptors.emplace_back();
  const std::string_view bits = reader->Bytes(descriptor.size());
  if (!reader->ok()) return false;
  std::memcpy(descriptor.data(), bits.data(), bits.size());
  KeyframeFeature& feature = keyframe->features.emplace_back();
  for (float* const number : {&feature.pixel.x(), &feature.pixel.y(), &feature.pixel_sigma_px,
                              &feature.depth_m, &feature.depth_sigma_m}) {
    *number = reader->Fixed<float>();
    if (!reader->ok() || !std::isfinite(*number) || *number < 0.0F) return false;
  }
  return feature.pixel.x() < static_cast<float>(camera.width) &&
         feature.pixel.y() < static_cast<float>(camera.height) && feature.pixel_sigma_px > 0.0F;
}

std::string EncodePart(std::span<const KeyframeFeatures> keyframes) {
  std::vector<const CameraCalibration*> cameras;
  std::string body;
  for (const KeyframeFeatures& keyframe : keyframes) {
    const auto known = std::find_if(cameras.begin(), cameras.end(), [&](const auto* camera) {
      return IsSame(*camera, keyframe.camera);
    });
    const auto camera = static_cast<uint64_t>(known - cameras.begin());
    if (known == cameras.end()) cameras.push_back(&keyframe.camera);
    AppendFixed(keyframe.stamp.time_ns, &body);
    AppendVarint(camera, &body);
    AppendVarint(keyframe.features.size(), &body);
    for (size_t i = 0; i < keyframe.features.size(); ++i) {
      AppendFeature(keyframe.descriptors[i], keyframe.features[i], &body);
    }
  }
  std::string bytes(kMagic);
  AppendVarint(kVersion, &bytes);
  AppendVarint(cameras.size(), &bytes);
  for (const CameraCalibration* camera : cameras) AppendCamera(*camera, &bytes);
  AppendVarint(keyframes.size(), &bytes);
  return bytes + body;
}

}  // namespace

std::vector<BoundOption> PlaceMemoryOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<PlaceMemoryOptions>(kMemoryFields, this, &bound);
  return bound;
}

void KeptPlaces::Add(const Pose3d& odom_T_body, const KeyframeFeatures& keyframe) {
  if (!IsNew(odom_T_body)) return;
  if (std::ssize(keyframes_) >= options_.keyframe_count_max) {
    Thin();
    if (!IsNew(odom_T_body)) return;
  }
  poses_.push_back(odom_T_body);
  keyframes_.push_back(keyframe);
  const size_t count =
      std::min(keyframe.features.size(), static_cast<size_t>(options_.feature_count_max));
  keyframes_.back().features.resize(count);
  keyframes_.back().descriptors.resize(count);
}

bool KeptPlaces::IsNew(const Pose3d& odom_T_body) const {
  return std::none_of(poses_.begin(), poses_.end(), [&](const Pose3d& kept) {
    return (kept.position - odom_T_body.position).norm() < way_m_ &&
           AngleBetween(kept.orientation, odom_T_body.orientation) < turn_deg_ * M_PI / 180.0;
  });
}

void KeptPlaces::Thin() {
  way_m_ *= 2.0;
  turn_deg_ = std::min(2.0 * turn_deg_, 90.0);
  const std::vector<Pose3d> poses = std::exchange(poses_, {});
  std::vector<KeyframeFeatures> keyframes = std::exchange(keyframes_, {});
  for (size_t i = 0; i < poses.size(); ++i) {
    if (!IsNew(poses[i])) continue;
    poses_.push_back(poses[i]);
    keyframes_.push_back(std::move(keyframes[i]));
  }
}

std::vector<std::string> EncodePlaceMemory(std::span<const KeyframeFeatures> keyframes) {
  std::vector<std::string> parts;
  while (!keyframes.empty()) {
    size_t count = 1;
    size_t bytes = keyframes.front().features.size() * kFeatureBytes;
    for (; count < keyframes.size(); ++count) {
      bytes += keyframes[count].features.size() * kFeatureBytes;
      if (bytes > kPartBytes) break;
    }
    parts.push_back(EncodePart(keyframes.first(count)));
    keyframes = keyframes.subspan(count);
  }
  return parts;
}

absl::StatusOr<std::vector<KeyframeFeatures>> DecodePlaceMemory(std::string_view bytes, int track) {
  ByteReader reader(bytes);
  if (reader.Bytes(kMagic.size()) != kMagic) return Damaged("they do not begin with their name");
  const uint64_t version = reader.Varint();
  if (!reader.ok()) return Damaged("they end in their head");
  if (version != kVersion) {
    return MakeError(Reason::kFormatTooNew,
                     absl::StrCat("remembered places are of version ", version,
                                  ", this build reads version ", kVersion));
  }
  std::vector<CameraCalibration> cameras;
  for (uint64_t left = reader.Varint(); left > 0; --left) {
    const std::optional<CameraCalibration> camera = ReadCamera(&reader);
    if (!camera.has_value()) return Damaged(absl::StrCat("camera ", cameras.size()));
    cameras.push_back(*camera);
  }
  std::vector<KeyframeFeatures> keyframes;
  for (uint64_t left = reader.Varint(); left > 0; --left) {
    KeyframeFeatures keyframe;
    keyframe.stamp = {track, reader.Fixed<TimeNs>()};
    const uint64_t camera = reader.Varint();
    const uint64_t count = reader.Varint();
    const bool is_in_order =
        keyframes.empty() || keyframe.stamp.time_ns > keyframes.back().stamp.time_ns;
    if (!reader.ok() || !is_in_order || camera >= cameras.size() ||
        count > reader.remaining() / kFeatureBytes) {
      return Damaged(absl::StrCat("keyframe ", keyframes.size()));
    }
    keyframe.camera = cameras[camera];
    keyframe.descriptors.reserve(count);
    keyframe.features.reserve(count);
    for (uint64_t i = 0; i < count; ++i) {
      if (!ReadFeature(keyframe.camera, &reader, &keyframe)) {
        return Damaged(absl::StrCat("feature ", i, " of keyframe ", keyframes.size()));
      }
    }
    keyframes.push_back(std::move(keyframe));
  }
  if (!reader.ok() || reader.remaining() > 0) return Damaged("they do not end where they should");
  return keyframes;
}

}  // namespace dsg::ingest
