// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/place_memory.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "ingest/recognition/place_recognizer.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/recognition/made_places.h"

namespace dsg::ingest {
namespace {

KeyframeFeatures ViewAt(uint64_t place, TimeNs time_ns, int track) {
  ViewSpec view;
  view.stamp = {track, time_ns};
  view.seed = static_cast<uint64_t>(time_ns + track);
  return MadeKeyframe(MakePlace(place), view);
}

// Ten metres apart.
std::vector<KeyframeFeatures> TwoPlaces(int feature_count_max) {
  PlaceMemoryOptions options;
  options.feature_count_max = feature_count_max;
  KeptPlaces kept(options);
  for (const uint64_t place : {1, 2}) {
    const auto number = static_cast<TimeNs>(place);
    kept.Add(PoseAt({10.0 * static_cast<double>(place), 0, 0}, {0, 0, 0}),
             ViewAt(place, number * 20 * kNsPerSecond, 0));
  }
  return kept.keyframes();
}

TEST(PlaceMemory, ReadsBackWhatWasWritten) {
  const std::vector<KeyframeFeatures> kept = TwoPlaces(200);
  const auto read = DecodePlaceMemory(EncodePlaceMemory(kept).at(0), 7);
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->size(), 2u);
  for (size_t k = 0; k < 2; ++k) {
    const KeyframeFeatures& was = kept[k];
    const KeyframeFeatures& is = (*read)[k];
    EXPECT_EQ(is.stamp.track, 7);
    EXPECT_EQ(is.stamp.time_ns, was.stamp.time_ns);
    EXPECT_EQ(is.camera.width, was.camera.width);
    EXPECT_EQ(is.camera.fx, was.camera.fx);
    ASSERT_EQ(is.features.size(), 200u);
    for (size_t i = 0; i < 200; ++i) {
      EXPECT_EQ(is.descriptors[i], was.descriptors[i]);
      EXPECT_EQ(is.features[i].pixel, was.features[i].pixel);
      EXPECT_EQ(is.features[i].pixel_sigma_px, was.features[i].pixel_sigma_px);
      EXPECT_EQ(is.features[i].depth_m, was.features[i].depth_m);
      EXPECT_EQ(is.features[i].depth_sigma_m, was.features[i].depth_sigma_m);
    }
  }
}

TEST(PlaceMemory, IsKnownAgainByAnotherSession) {
  auto read = DecodePlaceMemory(EncodePlaceMemory(TwoPlaces(500)).at(0), 0);
  ASSERT_TRUE(read.ok()) << read.status();
  auto recognizer = PlaceRecognizer::Make();
  ASSERT_TRUE(recognizer.ok());
  for (KeyframeFeatures& keyframe : *read) {
    ASSERT_TRUE(recognizer->Add(std::move(keyframe)).ok());
  }
  const auto found = recognizer->Add(ViewAt(2, 5, 1));
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_EQ(found->loops.size(), 1u);
  EXPECT_EQ(found->loops[0].from_track, 0);
  EXPECT_EQ(found->loops[0].from_ns, 40 * kNsPerSecond);
  EXPECT_LT(found->loops[0].from_T_to.position.norm(), 0.05);
}

TEST(PlaceMemory, RefusesEachCut) {
  const std::string bytes = EncodePlaceMemory(TwoPlaces(3)).at(0);
  for (size_t size = 0; size < bytes.size(); ++size) {
    const auto cut = DecodePlaceMemory(std::string_view(bytes).substr(0, size), 0);
    ASSERT_EQ(ReasonOf(cut.status()), Reason::kStoreCorrupt) << size << " of " << bytes.size();
  }
  EXPECT_EQ(ReasonOf(DecodePlaceMemory(bytes + "x", 0).status()), Reason::kStoreCorrupt);
}

TEST(PlaceMemory, OfWrongBytesIsRefusedOrHarmless) {
  const std::string bytes = EncodePlaceMemory(TwoPlaces(3)).at(0);
  Random random(1, 0);
  for (int i = 0; i < 5000; ++i) {
    std::string wrong = bytes;
    char& byte = wrong[static_cast<size_t>(random.Index(static_cast<int>(wrong.size())))];
    byte = static_cast<char>(byte ^ (1 << random.Index(8)));
    const auto read = DecodePlaceMemory(wrong, 0);
    if (!read.ok()) continue;
    ASSERT_LE(read->size(), 2u);
    for (const KeyframeFeatures& keyframe : *read) {
      ASSERT_EQ(keyframe.features.size(), keyframe.descriptors.size());
      ASSERT_TRUE(keyframe.camera.Validate().ok());
    }
  }
}

TEST(KeptPlaces, AreSomeOfEachPlace) {
  KeptPlaces kept;
  for (int i = 0; i < 50; ++i) {
    kept.Add(PoseAt({0.1 * i, 0, 0}, {0, 0, 0}), ViewAt(1, i, 0));
  }
  EXPECT_EQ(kept.keyframes().size(), 10u) << "one each half metre of five";
  for (int i = 0; i < 50; ++i) {
    kept.Add(PoseAt({0.1 * i, 0, 0}, {0, 0, 0}), ViewAt(1, 100 + i, 0));
  }
  EXPECT_EQ(kept.keyframes().size(), 10u) << "the same way again";
  kept.Add(PoseAt({0, 0, 0}, {0, 0, 90}), ViewAt(1, 1000, 0));
  EXPECT_EQ(kept.keyframes().size(), 11u) << "another direction";
}

TEST(KeptPlaces, OfALongWayAreThinner) {
  PlaceMemoryOptions options;
  options.keyframe_count_max = 10;
  KeptPlaces kept(options);
  for (int i = 0; i < 100; ++i) {
    kept.Add(PoseAt({0.5 * i, 0, 0}, {0, 0, 0}), ViewAt(1, i, 0));
    ASSERT_LE(kept.keyframes().size(), 10u);
  }
  EXPECT_EQ(kept.keyframes().front().stamp.time_ns, 0);
  EXPECT_GT(kept.keyframes().back().stamp.time_ns, 80);
  EXPECT_GE(kept.keyframes().size(), 5u);
}

TEST(PlaceMemory, ComesInPartsThatAMessageHolds) {
  EXPECT_TRUE(EncodePlaceMemory({}).empty());
  std::vector<KeyframeFeatures> keyframes;
  for (int i = 0; i < 100; ++i) keyframes.push_back(ViewAt(1, i, 0));
  const std::vector<std::string> parts = EncodePlaceMemory(keyframes);
  EXPECT_GE(parts.size(), 2u);
  TimeNs next_ns = 0;
  for (const std::string& part : parts) {
    EXPECT_LT(part.size(), (size_t{1} << 20) + 4096);
    const auto read = DecodePlaceMemory(part, 0);
    ASSERT_TRUE(read.ok()) << read.status();
    for (const KeyframeFeatures& keyframe : *read) EXPECT_EQ(keyframe.stamp.time_ns, next_ns++);
  }
  EXPECT_EQ(next_ns, 100);
}

}  // namespace
}  // namespace dsg::ingest
