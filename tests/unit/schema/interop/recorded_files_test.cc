// SPDX-License-Identifier: Apache-2.0
// The recorded scene graphs, against the counts of their READMEs and against their own text.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "schema/interop/scene_graph_file.h"
#include "tests/unit/schema/interop/interop_test_util.h"

namespace dsg {
namespace {

struct Recorded {
  const char* path;
  const char* format;
  int64_t node_count;
  int64_t edge_count;
  int64_t pose_count;
};

constexpr Recorded kRecorded[] = {
    {"dsg-spark/apartment_dsg.json", "spark-dsg", 296, 742, 102},
    {"dsg-spark/mp3d_x8F5xyUWy9e_0_partial_dsg_600.json", "spark-dsg", 873, 1951, 600},
    {"dsg-spark/mp3d_x8F5xyUWy9e_0_partial_dsg_1447.json", "spark-dsg", 1939, 4615, 1445},
    {"dsg-spark/b45_rooms_places2d_objects.json", "spark-dsg", 166, 402, 0},
    {"dsg-spark/scene_graph_content.json", "region-json", 438, 194, 0},
    {"dsg-kimera-office/office_scene_graph_esdf_slice_1-3_medium.json", "kimera-json", 4821, 4730,
     0},
    {"dsg-kimera-office/uHumans2_office_s1_06h_large.json", "kimera-json", 3141, 3296, 0},
};

class RecordedFiles : public testing::TestWithParam<Recorded> {
 protected:
  void SetUp() override {
    bytes_ = ReadDataFile(GetParam().path);
    if (bytes_.empty()) GTEST_SKIP() << "the recorded scene graphs are not there; set DSG_DATA";
    auto imported = ReadSceneGraph(bytes_, GetParam().path, 2.0);
    ASSERT_TRUE(imported.ok()) << imported.status();
    imported_ = *std::move(imported);
  }

  std::string bytes_;
  ImportedGraph imported_;
};

// Those with ids of their own, and those with poses.
class RecordedSparkFiles : public RecordedFiles {};
class RecordedTracks : public RecordedFiles {};

template <typename Wanted>
std::vector<Recorded> Select(Wanted wanted) {
  std::vector<Recorded> selected;
  std::copy_if(std::begin(kRecorded), std::end(kRecorded), std::back_inserter(selected), wanted);
  return selected;
}

std::string NameOfCase(const testing::TestParamInfo<Recorded>& file) {
  std::string name = file.param.path;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !std::isalnum(c); }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, RecordedFiles, testing::ValuesIn(kRecorded), NameOfCase);
INSTANTIATE_TEST_SUITE_P(Spark, RecordedSparkFiles,
                         testing::ValuesIn(Select([](const Recorded& file) {
                           return std::string_view(file.format) == "spark-dsg";
                         })),
                         NameOfCase);
INSTANTIATE_TEST_SUITE_P(Posed, RecordedTracks, testing::ValuesIn(Select([](const Recorded& file) {
                           return file.pose_count > 0;
                         })),
                         NameOfCase);

TEST_P(RecordedFiles, HaveTheCountsOfTheirReadme) {
  EXPECT_TRUE(LooksLikeSceneGraph(bytes_));
  EXPECT_EQ(imported_.format, GetParam().format);
  EXPECT_EQ(imported_.node_count, GetParam().node_count);
  EXPECT_EQ(imported_.edge_count, GetParam().edge_count);
  EXPECT_EQ(imported_.pose_count, GetParam().pose_count);
}

TEST_P(RecordedFiles, LoseNoNodeAndNoEdgeAndPassCheckDelta) {
  EXPECT_TRUE(CheckImport(imported_).ok()) << CheckImport(imported_);
  Coalesce(&imported_.delta);
  const size_t robots = imported_.delta.appends.size();
  EXPECT_EQ(imported_.delta.nodes.size(), static_cast<size_t>(GetParam().node_count) + robots);
  EXPECT_EQ(imported_.delta.edges.size(), static_cast<size_t>(GetParam().edge_count));
  EXPECT_EQ(robots, GetParam().pose_count > 0 ? 1u : 0u);
}

TEST_P(RecordedSparkFiles, KeepIdsPositionsAndEndsOfTheText) {
  const auto json = nlohmann::json::parse(bytes_);
  std::map<uint64_t, const Node*> nodes;
  for (const Node& node : imported_.delta.nodes) nodes[node.id.value] = &node;
  for (const auto& item : json["nodes"]) {
    const auto found = nodes.find(item["id"].get<uint64_t>());
    ASSERT_NE(found, nodes.end()) << item["id"];
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(found->second->map_T_node.position[axis],
                item["attributes"]["position"][axis].get<double>());
    }
  }
  std::set<std::pair<uint64_t, uint64_t>> ends;
  for (const Edge& edge : imported_.delta.edges) {
    ends.insert(std::minmax(edge.source.value, edge.target.value));
  }
  for (const auto& item : json["edges"]) {
    const auto source = item["source"].get<uint64_t>();
    const auto target = item["target"].get<uint64_t>();
    EXPECT_TRUE(ends.contains(std::minmax(source, target))) << source << " " << target;
  }
}

TEST_P(RecordedTracks, KeepEveryPoseAndItsTimeInTheTrack) {
  const auto json = nlohmann::json::parse(bytes_);
  std::map<TimeNs, nlohmann::json> poses;
  for (const auto& item : json["nodes"]) {
    if (item.contains("timestamp")) poses[item["timestamp"].get<TimeNs>()] = item["attributes"];
  }
  const auto& track = imported_.delta.appends.at(0).poses;
  ASSERT_EQ(track.size(), poses.size());
  EXPECT_EQ(imported_.first_ns, poses.begin()->first);
  for (const TimedPose& pose : track) {
    ASSERT_TRUE(poses.contains(pose.time_ns)) << pose.time_ns;
    const auto& attributes = poses[pose.time_ns];
    EXPECT_EQ(pose.map_T_agent.position.y(), attributes["position"][1].get<double>());
    EXPECT_NEAR(pose.map_T_agent.orientation.w(), attributes["world_R_body"]["w"].get<double>(),
                1e-9);
  }
}

// The place that the text gives to each pose must be the place of the stay that covers its time.
TEST_P(RecordedTracks, CoverEveryPoseByAStayInItsPlace) {
  const auto json = nlohmann::json::parse(bytes_);
  std::map<uint64_t, TimeNs> time_of;
  for (const auto& item : json["nodes"]) {
    if (item.contains("timestamp")) {
      time_of[item["id"].get<uint64_t>()] = item["timestamp"].get<TimeNs>();
    }
  }
  int64_t checked_count = 0;
  for (const auto& item : json["edges"]) {
    auto pose = item["source"].get<uint64_t>();
    auto place = item["target"].get<uint64_t>();
    if (!time_of.contains(pose)) std::swap(pose, place);
    if (!time_of.contains(pose) || time_of.contains(place)) continue;
    const TimeNs time_ns = time_of[pose];
    const auto covers = [&](const Stay& stay) {
      return stay.enter_ns <= time_ns && time_ns < stay.exit_ns;
    };
    const auto& stays = imported_.delta.stays;
    ASSERT_EQ(std::count_if(stays.begin(), stays.end(), covers), 1) << time_ns;
    EXPECT_EQ(std::find_if(stays.begin(), stays.end(), covers)->place.value, place) << time_ns;
    ++checked_count;
  }
  EXPECT_EQ(checked_count, GetParam().pose_count);
}

TEST(RecordedFile, TracksTheApartmentFrom3Point6To28Point4Seconds) {
  const std::string bytes = ReadDataFile("dsg-spark/apartment_dsg.json");
  if (bytes.empty()) GTEST_SKIP() << "the recorded scene graphs are not there; set DSG_DATA";
  const auto imported = ReadSceneGraph(bytes, "apartment", 2.0);
  ASSERT_TRUE(imported.ok()) << imported.status();
  const auto& poses = imported->delta.appends.at(0).poses;
  EXPECT_EQ(poses.front().time_ns, 3'647'910'000);
  EXPECT_EQ(poses.back().time_ns, 28'447'910'000);
  double length_m = 0.0;
  for (size_t i = 1; i < poses.size(); ++i) {
    length_m += (poses[i].map_T_agent.position - poses[i - 1].map_T_agent.position).norm();
  }
  EXPECT_NEAR(length_m, 9.1, 0.05);
}

TEST(RecordedFile, NamesTheClassesOfBuilding45) {
  const std::string bytes = ReadDataFile("dsg-spark/b45_rooms_places2d_objects.json");
  if (bytes.empty()) GTEST_SKIP() << "the recorded scene graphs are not there; set DSG_DATA";
  const auto imported = ReadSceneGraph(bytes, "b45", 2.0);
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_EQ(NodeNamed(*imported, "O0").class_name, "seating");
  EXPECT_EQ(NodeNamed(*imported, "R1").class_name, "lounge");
  EXPECT_EQ(imported->delta.labels.size(), 51u);
}

}  // namespace
}  // namespace dsg
