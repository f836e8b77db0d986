// SPDX-License-Identifier: Apache-2.0
// The readers against recorded logs; counts are those of the data's README files.
#include <map>
#include <set>

#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

struct RealLog {
  const char* path;
  const char* format;
  size_t pose_count;
  size_t agent_count;
  /// Of the whole log.
  TimeNs duration_ns;
};

class RealLogTest : public testing::TestWithParam<RealLog> {};

TEST_P(RealLogTest, HasTheCountsOfItsReadme) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  const auto log = ReadAll((DataFolder() / GetParam().path).string());
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, GetParam().format);
  EXPECT_EQ(log->poses.size(), GetParam().pose_count);
  EXPECT_EQ(log->info.measurement_count,
            static_cast<int64_t>(log->order.size() + log->graphs.size()));
  std::map<std::string, TimeNs> last;
  for (size_t i = 0; i < log->poses.size(); ++i) {
    const PoseMeasurement& pose = log->poses[i];
    if (i > 0) {
      EXPECT_GE(pose.pose.time_ns, log->poses[i - 1].pose.time_ns);
    }
    const auto [entry, is_new] = last.try_emplace(pose.agent_name, pose.pose.time_ns);
    if (!is_new) {
      EXPECT_GT(pose.pose.time_ns, entry->second) << pose.agent_name;
    }
    entry->second = pose.pose.time_ns;
  }
  EXPECT_EQ(last.size(), GetParam().agent_count);
  EXPECT_EQ(log->info.first_ns, log->order.front().second);
  EXPECT_EQ(log->poses.back().pose.time_ns - log->poses.front().pose.time_ns,
            GetParam().duration_ns);
}

INSTANTIATE_TEST_SUITE_P(
    Data, RealLogTest,
    testing::Values(
        RealLog{"people-eth-ucy/eth/obsmat.txt", "obsmat", 8908, 360, 773'400'000'000},
        RealLog{"people-eth-ucy/zara01/obsmat.txt", "obsmat", 5024, 148, 360'400'000'000},
        RealLog{"people-eth-ucy/zara03/crowds_zara03.txt", "trajnet", 5005, 137, 301'200'000'000},
        RealLog{"people-eth-ucy/students003/students003.txt", "trajnet", 17953, 434,
                216'000'000'000},
        RealLog{"people-lcas/lcas.ndjson", "trajnet-ndjson", 9610, 304, 362'400'000'000},
        RealLog{"people-thor-magni/Scenario_5.csv", "thor", 10040, 502, 333'200'000'000},
        RealLog{"euroc-imu-groundtruth/V1_02_medium", "euroc", 16702, 1, 83'504'999'936},
        RealLog{"euroc-mh01-stereo", "euroc", 1791, 1, 8'949'999'872},
        // One stamp of the 20957 comes twice.
        RealLog{"trajectories/fr2_desk_groundtruth.txt", "tum", 20956, 1, 99'364'500'000},
        RealLog{"trajectories/fr2_desk_ORB.txt", "tum", 2893, 1, 98'822'348'000},
        RealLog{"trajectories/fr2_desk_ORB_kf_mono.txt", "tum", 157, 1, 91'019'051'000}));

TEST(RealLogs, FirstPoseOfEthIsItsFirstRow) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  LogOptions options;
  options.epoch_ns = 5;
  const auto log = ReadAll((DataFolder() / "people-eth-ucy/eth/obsmat.txt").string(), options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->poses[0].agent_name, "1");
  EXPECT_EQ(log->poses[0].pose.time_ns, 5);
  EXPECT_EQ(log->poses[0].pose.map_T_agent.position, Eigen::Vector3d(8.4568443, 3.5880664, 0.0));
  EXPECT_EQ(log->poses[0].pose.flags, pose_flags::kNoOrientation);
}

TEST(RealLogs, ThorKeepsHeightsAndNamesTracklets) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  const auto log = ReadAll((DataFolder() / "people-thor-magni/Scenario_5.csv").string());
  ASSERT_TRUE(log.ok()) << log.status();
  std::set<std::string> names;
  for (const PoseMeasurement& pose : log->poses) {
    names.insert(pose.agent_name);
    EXPECT_GT(pose.pose.map_T_agent.position.z(), 0.9);
  }
  EXPECT_TRUE(names.contains("Helmet_3/0"));
  EXPECT_TRUE(names.contains("Helmet_10/501"));
  EXPECT_NE(log->info.notes.at(1).find("Visitors-Alone 339"), std::string::npos);
}

TEST(RealLogs, LcasCountsItsScenes) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  const auto log = ReadAll((DataFolder() / "people-lcas/lcas.ndjson").string());
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_NE(log->info.notes.at(0).find("889 scene"), std::string::npos);
}

TEST(RealLogs, SceneGraphsComeAsOneMeasurement) {
  if (DataFolder().empty()) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  LogOptions options;
  options.agent_prefix = "run1-";
  const auto log = ReadAll((DataFolder() / "dsg-spark/apartment_dsg.json").string(), options);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, "spark-dsg");
  EXPECT_TRUE(log->info.has_clock);
  ASSERT_EQ(log->graphs.size(), 1u);
  size_t pose_count = 0;
  for (const TrajectoryAppend& append : log->graphs[0].delta.appends) {
    pose_count += append.poses.size();
  }
  EXPECT_EQ(pose_count, 102u);
  int agent_count = 0;
  for (const Node& node : log->graphs[0].delta.nodes) {
    if (!IsAgentKind(node.kind)) continue;
    ++agent_count;
    EXPECT_TRUE(node.name.starts_with("run1-"));
  }
  EXPECT_EQ(agent_count, 1);
  options.format = "kimera-json";
  EXPECT_FALSE(ReadAll((DataFolder() / "dsg-spark/apartment_dsg.json").string(), options).ok());
}

}  // namespace
}  // namespace dsg::ingest
