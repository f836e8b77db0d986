// SPDX-License-Identifier: Apache-2.0
// Loop closures of keyframes, as they come: within a path, across sessions, and between robots.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/recognition/keyframe_features.h"
#include "ingest/recognition/place_index.h"
#include "ingest/recognition/place_verifier.h"
#include "ingest/recognition/recognition_options.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {

/// Where the robot of `track` was at `time_ns`, seen from where that of `from_track` was at
/// `from_ns`: bodies, metres.
struct PlaceLoop {
  int track = 0;
  TimeNs time_ns = 0;
  int from_track = 0;
  TimeNs from_ns = 0;
  Pose3d from_T_to;
  /// Inverse covariance, translation before rotation (on the right of the pose), metres and
  /// radians; symmetric positive definite.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Identity();
  /// Features that agree: as a source of loop closures counts how sure it is.
  double score = 0.0;
};

/// A keyframe that looked like the new one, and what became of it.
struct CheckedPlace {
  KeyframeStamp from;
  int vote_count = 0;
  double score = 0.0;
  PlaceVerdict verdict;
};

struct RecognizedPlaces {
  /// At most PlaceIndexOptions::candidate_count, each from another place of the past.
  std::vector<PlaceLoop> loops;
  /// All that were looked at, best first; those of kDirectionOnly are no loops, because they have
  /// no scale.
  std::vector<CheckedPlace> checked;
};

/// Keyframes of several tracks may come in any order, those of one track ascending in time.
///
/// Memory and results as PlaceIndex and PlaceVerifier have them. Threads: one caller at a time.
class PlaceRecognizer {
 public:
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for options out of their ranges.
  static absl::StatusOr<PlaceRecognizer> Make(const RecognitionOptions& options = {});

  /// Seeks a keyframe among those before, then remembers it.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for as many descriptors as features are not, and for a
  /// camera that is not valid or has distortion; the keyframe is not remembered.
  absl::StatusOr<RecognizedPlaces> Add(KeyframeFeatures keyframe);

  /// Keyframes that are remembered.
  int size() const { return index_.size(); }

 private:
  PlaceRecognizer(PlaceIndex index, const PlaceVerifier& verifier)
      : index_(std::move(index)), verifier_(verifier) {}

  PlaceIndex index_;
  PlaceVerifier verifier_;
};

}  // namespace dsg::ingest
