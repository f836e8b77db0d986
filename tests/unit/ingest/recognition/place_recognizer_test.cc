// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/place_recognizer.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <set>

#include "schema/base/status.h"
#include "tests/unit/ingest/recognition/made_places.h"

namespace dsg::ingest {
namespace {

PlaceRecognizer MadeRecognizer(const RecognitionOptions& options = {}) {
  absl::StatusOr<PlaceRecognizer> recognizer = PlaceRecognizer::Make(options);
  EXPECT_TRUE(recognizer.ok()) << recognizer.status();
  return *std::move(recognizer);
}

// At a place, a little aside each time.
ViewSpec ViewOf(int track, double time_s) {
  ViewSpec spec;
  spec.stamp = {track, static_cast<TimeNs>(time_s * kNsPerSecond)};
  spec.place_T_camera = PoseAt({0.002 * time_s, 0.1 * track, 0.0}, {0.0, 0.05 * time_s, 0.0});
  spec.body_T_camera = PoseAt({0.1, 0.0, 0.2}, {-90.0, 0.0, -90.0});
  spec.seed = static_cast<uint64_t>(100.0 * time_s + 13.0 * track + 1.0);
  return spec;
}

RecognizedPlaces AddedView(uint64_t place, const ViewSpec& spec, PlaceRecognizer* recognizer) {
  absl::StatusOr<RecognizedPlaces> added =
      recognizer->Add(MadeKeyframe(MakePlace(place, 200), spec));
  EXPECT_TRUE(added.ok()) << added.status();
  return *std::move(added);
}

TEST(PlaceRecognizer, ClosesLoopsWhereThePathComesBack) {
  PlaceRecognizer recognizer = MadeRecognizer();
  // Twelve places in twelve times two seconds, twice.
  int loop_count = 0;
  for (int i = 0; i < 24; ++i) {
    const double time_s = 2.0 * i;
    const RecognizedPlaces places =
        AddedView(static_cast<uint64_t>(i % 12), ViewOf(0, time_s), &recognizer);
    EXPECT_EQ(places.loops.size(), i < 12 ? 0u : 1u) << i;
    for (const PlaceLoop& loop : places.loops) {
      ++loop_count;
      EXPECT_EQ(loop.time_ns, 2 * int64_t{i} * kNsPerSecond);
      EXPECT_EQ(loop.from_ns, loop.time_ns - 24 * kNsPerSecond);
      const ViewSpec from = ViewOf(0, time_s - 24.0);
      const ViewSpec to = ViewOf(0, time_s);
      const Pose3d truth = from.body_T_camera * from.place_T_camera.Inverse() * to.place_T_camera *
                           to.body_T_camera.Inverse();
      EXPECT_LT((loop.from_T_to.position - truth.position).norm(), 0.05);
      EXPECT_LT(DegreesOfTurn(loop.from_T_to.orientation, truth.orientation), 0.5);
      EXPECT_TRUE(IsValidPose(loop.from_T_to));
      EXPECT_EQ((Eigen::LLT<Eigen::Matrix<double, 6, 6>>(loop.information).info()), Eigen::Success);
      EXPECT_GT(loop.score, 50.0);
    }
  }
  EXPECT_EQ(loop_count, 12);
  EXPECT_EQ(recognizer.size(), 24);
}

TEST(PlaceRecognizer, OtherRobotsAndSessionsAreSeenAtOnce) {
  PlaceRecognizer recognizer = MadeRecognizer();
  for (int i = 0; i < 6; ++i) {
    EXPECT_TRUE(AddedView(static_cast<uint64_t>(i), ViewOf(0, i), &recognizer).loops.empty());
  }
  // At the same time by another clock, and by the first robot right after: one loop each.
  const RecognizedPlaces other = AddedView(3, ViewOf(1, 5.0), &recognizer);
  ASSERT_EQ(other.loops.size(), 1u);
  EXPECT_EQ(other.loops[0].track, 1);
  EXPECT_EQ(other.loops[0].from_track, 0);
  EXPECT_EQ(other.loops[0].from_ns, 3 * kNsPerSecond);
  EXPECT_NEAR(other.loops[0].from_T_to.position.norm(), 0.1, 0.05);
  const RecognizedPlaces first = AddedView(3, ViewOf(0, 6.0), &recognizer);
  ASSERT_EQ(first.loops.size(), 1u);
  EXPECT_EQ(first.loops[0].from_track, 1);
  // Both of them from then on.
  const RecognizedPlaces third = AddedView(3, ViewOf(2, 0.0), &recognizer);
  std::set<int> tracks;
  for (const PlaceLoop& loop : third.loops) tracks.insert(loop.from_track);
  EXPECT_EQ(tracks, (std::set<int>{0, 1}));
}

TEST(PlaceRecognizer, WithoutDepthsItTellsNoLoops) {
  PlaceRecognizer recognizer = MadeRecognizer();
  ViewSpec spec = ViewOf(0, 0.0);
  spec.has_depth = false;
  AddedView(1, spec, &recognizer);
  spec = ViewOf(0, 60.0);
  spec.place_T_camera = PoseAt({0.3, 0.0, 0.0}, {0.0, 3.0, 0.0});
  spec.has_depth = false;
  const RecognizedPlaces places = AddedView(1, spec, &recognizer);
  EXPECT_TRUE(places.loops.empty());
  ASSERT_EQ(places.checked.size(), 1u);
  EXPECT_EQ(places.checked[0].verdict.outcome, PlaceOutcome::kDirectionOnly);
  // A robot with depth closes the loop with it.
  const RecognizedPlaces again = AddedView(1, ViewOf(1, 0.0), &recognizer);
  EXPECT_GE(again.loops.size(), 1u);
}

TEST(PlaceRecognizer, WhatLooksAlikeAndIsNotIsTold) {
  PlaceRecognizer recognizer = MadeRecognizer();
  AddedView(1, ViewOf(0, 0.0), &recognizer);
  ViewSpec spec = ViewOf(0, 60.0);
  spec.moved_share = 1.0;
  const RecognizedPlaces places = AddedView(1, spec, &recognizer);
  EXPECT_TRUE(places.loops.empty());
  ASSERT_EQ(places.checked.size(), 1u);
  EXPECT_GT(places.checked[0].vote_count, 100);
  EXPECT_NE(places.checked[0].verdict.outcome, PlaceOutcome::kVerified);
}

TEST(PlaceRecognizer, RefusesBrokenKeyframes) {
  PlaceRecognizer recognizer = MadeRecognizer();
  KeyframeFeatures keyframe = MadeKeyframe(MakePlace(1), ViewOf(0, 0.0));
  keyframe.descriptors.pop_back();
  EXPECT_EQ(ReasonOf(recognizer.Add(keyframe).status()), Reason::kFieldInvalid);
  keyframe = MadeKeyframe(MakePlace(1), ViewOf(0, 0.0));
  keyframe.camera.fx = 0.0;
  EXPECT_EQ(ReasonOf(recognizer.Add(keyframe).status()), Reason::kFieldInvalid);
  keyframe.camera = PlaceCamera();
  keyframe.camera.distortion = Distortion::kRadialTangential;
  keyframe.camera.distortion_coefficients = {0.1, 0.0, 0.0, 0.0};
  EXPECT_EQ(ReasonOf(recognizer.Add(keyframe).status()), Reason::kFieldInvalid);
  EXPECT_EQ(recognizer.size(), 0);
}

TEST(RecognitionOptions, DefaultsAreInRangeAndNamesDiffer) {
  RecognitionOptions options;
  EXPECT_TRUE(ValidateOptions(options).ok()) << ValidateOptions(options);
  std::set<std::string> names;
  for (const BoundOption& option : options.Bind()) EXPECT_TRUE(names.insert(option.name).second);
  EXPECT_EQ(DigestOptions(options), "");
  options.verifier.consensus.seed = 5;
  EXPECT_EQ(DigestOptions(options), "recognition-seed=5");
}

}  // namespace
}  // namespace dsg::ingest
