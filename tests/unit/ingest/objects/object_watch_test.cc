// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/object_watch.h"

#include <gtest/gtest.h>

#include <vector>

namespace dsg::ingest {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr uint16_t kWatchedCup = 20;
constexpr uint16_t kBehindCup = 16;

// A camera at the origin looks along z at a table 2 m away; the cup stands 10 cm before it in the
// middle of the picture.
DepthFrame Picture(TimeNs time_ns, bool with_cup) {
  DepthFrame frame;
  frame.time_ns = time_ns;
  frame.camera.width = kWidth;
  frame.camera.height = kHeight;
  frame.camera.fx = frame.camera.fy = 200.0;
  frame.camera.cx = kWidth / 2;
  frame.camera.cy = kHeight / 2;
  frame.depth_m.assign(kWidth * kHeight, 2.0F);
  frame.labels.assign(kWidth * kHeight, kBehindCup << 8 | 1);
  for (int y = 54; with_cup && y < 66; ++y) {
    for (int x = 74; x < 86; ++x) {
      frame.depth_m[static_cast<size_t>(y * kWidth + x)] = 1.9F;
      frame.labels[static_cast<size_t>(y * kWidth + x)] = kWatchedCup << 8 | 1;
    }
  }
  return frame;
}

TrackedObject Cup() {
  TrackedObject cup;
  cup.id = 7;
  cup.cluster.class_id = kWatchedCup;
  cup.cluster.center_map = Eigen::Vector3d(0, 0, 1.9);
  cup.cluster.size = Eigen::Vector3d(0.1, 0.1, 0.1);
  cup.cluster.map_T_box.position = cup.cluster.center_map;
  for (const float x : {-0.05F, 0.0F, 0.05F}) {
    for (const float y : {-0.05F, 0.0F, 0.05F}) cup.cluster.points_map.push_back({x, y, 1.9F});
  }
  return cup;
}

class Watch : public testing::Test {
 protected:
  Watch() { watch_.Follow({Cup()}); }

  void See(int count, bool with_cup) {
    for (int i = 0; i < count; ++i) watch_.Watch(Picture(time_ns_++, with_cup));
  }

  ObjectWatch watch_;
  TimeNs time_ns_ = 0;
};

TEST_F(Watch, TellsWhenAThingWasLastSeenAndFirstMissed) {
  See(3, true);
  See(6, false);
  const auto vacated = watch_.TakeVacated();
  ASSERT_EQ(vacated.size(), 1u);
  EXPECT_EQ(vacated[0].id, 7);
  EXPECT_EQ(vacated[0].last_present_ns, 2);
  EXPECT_EQ(vacated[0].first_absent_ns, 3);
  EXPECT_TRUE(watch_.TakeVacated().empty());
}

TEST_F(Watch, NeedsSeveralPicturesInARow) {
  See(3, true);
  for (int i = 0; i < 5; ++i) {
    See(4, false);
    See(1, true);
  }
  EXPECT_TRUE(watch_.TakeVacated().empty());
}

TEST_F(Watch, TakesWhatStandsBeforeItForNoVote) {
  See(3, true);
  for (int i = 0; i < 20; ++i) {
    DepthFrame frame = Picture(time_ns_++, false);
    frame.depth_m.assign(frame.depth_m.size(), 1.0F);
    watch_.Watch(frame);
  }
  for (int i = 0; i < 20; ++i) {
    DepthFrame frame = Picture(time_ns_++, false);
    frame.dynamic.assign(frame.depth_m.size(), 1);
    watch_.Watch(frame);
  }
  EXPECT_TRUE(watch_.TakeVacated().empty());
}

TEST_F(Watch, FindsDepthBesideWhereTheCameraWasBlind) {
  See(3, true);
  for (int i = 0; i < 6; ++i) {
    DepthFrame frame = Picture(time_ns_++, false);
    for (int y = 50; y < 70; ++y) {
      for (int x = 70; x < 90; ++x) frame.depth_m[static_cast<size_t>(y * kWidth + x)] = 0.0F;
    }
    watch_.Watch(frame);
  }
  EXPECT_EQ(watch_.TakeVacated().size(), 1u);
}

TEST_F(Watch, DropsTheResidueUntilAThingOfTheClassIsBack) {
  See(3, true);
  See(6, false);
  watch_.TakeVacated();
  watch_.Follow({});
  std::vector<ObjectCluster> clusters = {Cup().cluster};
  watch_.DropResidues(&clusters);
  EXPECT_TRUE(clusters.empty());
  See(3, true);
  clusters = {Cup().cluster};
  watch_.DropResidues(&clusters);
  EXPECT_EQ(clusters.size(), 1u);
}

TEST_F(Watch, DoesNotMissWhatItNeverSaw) {
  See(20, false);
  EXPECT_TRUE(watch_.TakeVacated().empty());
}

}  // namespace
}  // namespace dsg::ingest
