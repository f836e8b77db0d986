// SPDX-License-Identifier: Apache-2.0
// The keyframes of a session as bytes: what a later session, or another robot, knows its places by.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/config/option_field.h"
#include "ingest/recognition/keyframe_features.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

inline constexpr std::string_view kPlaceMemoryType = "application/x-dsg-places";

struct PlaceMemoryOptions {
  /// A keyframe is kept if it is this far from all that were, or turned by as much.
  double way_m = 0.5;
  double turn_deg = 20.0;
  /// Keyframes at most, and features of each, the strongest ones.
  int keyframe_count_max = 2000;
  int feature_count_max = 500;

  std::vector<BoundOption> Bind();
};

/// The keyframes of a path that are worth being remembered: some of each place, however often the
/// robot was there. When there are too many, those that are nearer than twice as far are left out,
/// and so on: a large building is remembered more thinly.
///
/// Memory: 28 kB a keyframe. Cost of a keyframe: those that are kept. Threads: one caller at a
/// time.
class KeptPlaces {
 public:
  explicit KeptPlaces(const PlaceMemoryOptions& options = {})
      : options_(options), way_m_(options.way_m), turn_deg_(options.turn_deg) {}

  /// Requires: keyframes come in the order of time.
  void Add(const Pose3d& odom_T_body, const KeyframeFeatures& keyframe);

  const std::vector<KeyframeFeatures>& keyframes() const { return keyframes_; }

 private:
  bool IsNew(const Pose3d& odom_T_body) const;
  void Thin();

  PlaceMemoryOptions options_;
  double way_m_;
  double turn_deg_;
  std::vector<Pose3d> poses_;
  std::vector<KeyframeFeatures> keyframes_;
};

/// In parts of about 1 MB, which a message to a server holds; each can be read alone. 52 bytes a
/// feature. Requires: keyframes ascend in time and have cameras without distortion.
std::vector<std::string> EncodePlaceMemory(std::span<const KeyframeFeatures> keyframes);

/// The keyframes of a part, of `track`. Memory: that of the bytes, twice.
/// Errors: STORE_CORRUPT for bytes that EncodePlaceMemory has not made; FORMAT_TOO_NEW for those of
/// a later version.
absl::StatusOr<std::vector<KeyframeFeatures>> DecodePlaceMemory(std::string_view bytes, int track);

}  // namespace dsg::ingest
