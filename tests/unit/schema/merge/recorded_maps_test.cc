// SPDX-License-Identifier: Apache-2.0
// Two recorded scene graphs of one house, the one put elsewhere, become one.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "schema/interop/scene_graph_file.h"
#include "schema/merge/refine.h"
#include "schema/model/rigid_motion.h"
#include "tests/unit/schema/merge/perceived_half.h"
#include "tests/unit/schema/merge/small_map.h"

namespace dsg::merge {
namespace {

std::string ReadFile(const std::string& name) {
  const char* folder = std::getenv("DSG_DATA");
  const std::string path = std::string(folder == nullptr ? "../shared/data" : folder);
  std::ifstream file(path + "/dsg-spark/" + name, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

TEST(RecordedMaps, OfOneHouseMeetWhateverTheFrame) {
  const std::string early = ReadFile("mp3d_x8F5xyUWy9e_0_partial_dsg_600.json");
  const std::string late = ReadFile("mp3d_x8F5xyUWy9e_0_partial_dsg_1447.json");
  if (early.empty() || late.empty()) {
    GTEST_SKIP() << "the recorded scene graphs are not there; set DSG_DATA";
  }
  auto first = ReadSceneGraph(late, "late", 2.0);
  auto second = ReadSceneGraph(early, "early", 2.0);
  ASSERT_TRUE(first.ok() && second.ok());
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    test::SmallMaps maps;
    const Pose3d other_T_map = test::SomeTransform(seed);
    GraphDelta moved = second->delta;
    for (Node& node : moved.nodes) TransformNode(other_T_map, &node);
    for (TrajectoryAppend& track : moved.appends) {
      for (TimedPose& pose : track.poses) TransformPose(other_T_map, &pose);
    }
    FitBoxesToChildren(&moved);
    test::StoreMap(maps.store(), "a", first->delta);
    test::StoreMap(maps.store(), "b", std::move(moved));
    const auto found = FindTransform(*maps.Newest("a"), *maps.Newest("b"), {}, {});
    ASSERT_TRUE(found.ok()) << found.status();
    const Pose3d error = found->map_T_other * other_T_map;
    // In the middle of the house.
    const double error_m = (error * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d(0, 0, 1)).norm();
    const double error_rad = AngleBetween(error.orientation, Eigen::Quaterniond::Identity());
    const MergePlan plan = maps.Merge("a", "b", found->map_T_other);
    std::printf(
        "house, frame %d: error %.3f m %.2f degrees, %d agree, fused %d objects %d places "
        "%d rooms\n",
        static_cast<int>(seed), error_m, error_rad * 57.2957795, found->agreeing_count,
        static_cast<int>(plan.counts.fused_object_count),
        static_cast<int>(plan.counts.fused_place_count),
        static_cast<int>(plan.counts.fused_room_count));
    EXPECT_LT(error_m, 0.1);
    EXPECT_LT(error_rad, 0.0175);
    EXPECT_EQ(plan.counts.fused_room_count, 3);
    EXPECT_EQ(maps.Problems("a"), std::vector<std::string>());
  }
}

}  // namespace
}  // namespace dsg::merge
