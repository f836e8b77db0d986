// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/place_recognizer.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

absl::Status CheckKeyframe(const KeyframeFeatures& keyframe) {
  DSG_RETURN_IF_ERROR(keyframe.camera.Validate());
  if (keyframe.camera.distortion != Distortion::kNone) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat(keyframe.camera.name, ": the keyframe at ", keyframe.stamp.time_ns,
                     " ns has distortion; give features of a rectified camera"),
        {{"field", "camera.distortion"}});
  }
  if (keyframe.descriptors.size() == keyframe.features.size()) return absl::OkStatus();
  const std::string counts = absl::StrCat(keyframe.descriptors.size(), " descriptors of ",
                                          keyframe.features.size(), " features");
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(keyframe.camera.name, ": the keyframe at ", keyframe.stamp.time_ns,
                                " ns has ", counts, "; give as many"),
                   {{"field", "descriptors"}, {"value", counts}});
}

}  // namespace

absl::StatusOr<PlaceRecognizer> PlaceRecognizer::Make(const RecognitionOptions& options) {
  DSG_ASSIGN_OR_RETURN(PlaceIndex index, PlaceIndex::Make(options.index));
  DSG_ASSIGN_OR_RETURN(const PlaceVerifier verifier, PlaceVerifier::Make(options.verifier));
  return PlaceRecognizer(std::move(index), verifier);
}

absl::StatusOr<RecognizedPlaces> PlaceRecognizer::Add(KeyframeFeatures keyframe) {
  DSG_RETURN_IF_ERROR(CheckKeyframe(keyframe));
  RecognizedPlaces result;
  for (const PlaceCandidate& candidate : index_.Query(keyframe)) {
    const KeyframeFeatures& from = *candidate.keyframe;
    const PlaceVerdict verdict = verifier_.Verify(from, keyframe);
    result.checked.push_back({from.stamp, candidate.vote_count, candidate.score, verdict});
    if (verdict.outcome != PlaceOutcome::kVerified) continue;
    result.loops.push_back({keyframe.stamp.track, keyframe.stamp.time_ns, from.stamp.track,
                            from.stamp.time_ns, verdict.from_T_to, verdict.information,
                            static_cast<double>(verdict.inlier_count)});
  }
  index_.Add(std::make_shared<const KeyframeFeatures>(std::move(keyframe)));
  return result;
}

}  // namespace dsg::ingest
