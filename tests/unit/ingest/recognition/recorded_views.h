// SPDX-License-Identifier: Apache-2.0
// Recorded images as keyframes, with where they were really taken.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ingest/recognition/keyframe_features.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

struct RecordedView {
  std::string name;
  KeyframeFeatures features;
  /// Of the body; of the camera where there is no body.
  Pose3d world_T_body;
};

/// DSG_DATA, or where it is beside the sources.
std::filesystem::path RecordedFolder(const std::string& name);

/// How long the features took, together.
struct FeatureTime {
  double seconds = 0.0;
  int count = 0;
};

/// The four stereo pairs of euroc-loop-pairs, of one track each.
std::vector<RecordedView> EurocPairViews(FeatureTime* time);

struct IndoorPair {
  RecordedView first;
  RecordedView second;
  /// Of the cameras.
  Pose3d first_T_second;
};
/// indoor-pairs, at half of their size and without depth.
std::vector<IndoorPair> IndoorPairs(FeatureTime* time);

/// Frames with depth and poses, every `step`th, as one track; stamps are a second apart.
std::vector<RecordedView> KitchenViews(int track, int step, FeatureTime* time);
std::vector<RecordedView> CabinetViews(int track, int step, FeatureTime* time);
std::vector<RecordedView> LivingRoomViews(int track, int step, FeatureTime* time);

}  // namespace dsg::ingest
