// SPDX-License-Identifier: Apache-2.0
// The exports that are written while the map is read: TUM, CSV and GeoJSON, read back here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "query/cli/export_tum.h"
#include "query/cli/run.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::Arguments;
using test::MakeEdge;
using test::MakeNode;
using test::Outcome;
using test::ReadFile;

constexpr TimeNs kHouseEpoch = 1'403'715'524'907'143'168;
constexpr NodeId kAdaId('H', 1), kBobId('H', 2), kHallId('R', 1), kKitchenId('R', 2),
    kPlaceId('p', 1);

TimedPose PoseAt(double second, double x_m, uint32_t flags = 0) {
  TimedPose pose;
  pose.time_ns = kHouseEpoch + static_cast<TimeNs>(second * 1e9);
  pose.map_T_agent.position = Eigen::Vector3d(x_m, 1.0, 0.5);
  pose.map_T_agent.orientation = Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ());
  pose.flags = flags;
  return pose;
}

// Two rooms, a cup that is taken away after four seconds, and two people.
GraphDelta HouseOfTwo() {
  GraphDelta delta;
  delta.map = "house";
  delta.session_id = "test";
  delta.sequence = 1;
  Node hall = MakeNode(kHallId, kinds::kRoom, "the \"hall\", below", {1, 1, 1});
  // Clockwise, which GeoJSON does not take.
  hall.region = RegionInfo{{{0, 0}, {0, 2}, {2, 2}, {2, 0}}, 0.0, 3.0, {}};
  hall.attributes["floor"] = std::string("oak");
  Node cup = MakeNode(NodeId('O', 1), kinds::kObject, "cup", {1, 1, 0.8});
  cup.box_node = Box3d(Eigen::Vector3d(-0.1, -0.1, -0.1), Eigen::Vector3d(0.1, 0.1, 0.1));
  cup.valid = {kHouseEpoch, kHouseEpoch + 4 * kNsPerSecond};
  delta.nodes = {hall,
                 MakeNode(kKitchenId, kinds::kRoom, "kitchen", {3, 1, 1}),
                 MakeNode(kPlaceId, kinds::kPlace, "", {1, 1, 0}),
                 cup,
                 MakeNode(kAdaId, kinds::kHuman, "ada", 0.0),
                 MakeNode(kBobId, kinds::kHuman, "../bob", 0.0)};
  delta.edges = {MakeEdge(kHallId, relations::kContains, kPlaceId)};
  // A gap of five seconds, then one pose alone.
  delta.appends = {
      {.agent = kAdaId, .poses = {PoseAt(0, 0.0), PoseAt(1, 0.5), PoseAt(2, 1.0), PoseAt(7, 3.0)}},
      {.agent = kBobId, .poses = {PoseAt(0, 2.0, pose_flags::kNoOrientation)}}};
  delta.stays = {{kAdaId, kPlaceId, kHallId, kHouseEpoch, kHouseEpoch + 2 * kNsPerSecond},
                 {kAdaId, NodeId(), kKitchenId, kHouseEpoch + 7 * kNsPerSecond, kTimeMax}};
  FitBoxesToChildren(&delta);
  return delta;
}

class ExportRows : public testing::Test {
 protected:
  void SetUp() override { MakeMap(Clock::kUnix); }

  void MakeMap(Clock clock) {
    const auto store = OpenStore(store_, {.create = true});
    ASSERT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = "house";
    spec.clock = clock;
    spec.epoch_ns = kHouseEpoch;
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
    const auto writer = (*store)->OpenWriter("house");
    ASSERT_TRUE(writer.ok()) << writer.status();
    const auto committed = (*writer)->Commit(HouseOfTwo());
    ASSERT_TRUE(committed.ok()) << committed.status();
  }

  Outcome Export(Arguments arguments) {
    arguments.insert(arguments.begin(), "export");
    arguments.insert(arguments.end(), {"--store", store_});
    return test::RunDsg(arguments);
  }
  std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }

  // Lines without their ends.
  std::vector<std::string> Lines(const std::string& name) const {
    std::istringstream text(ReadFile(Path(name)));
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      lines.push_back(line);
    }
    return lines;
  }

  test::TempFolder folder_;
  std::string store_ = folder_.path() + "/store";
};

TEST_F(ExportRows, TumHasALineAPoseAndAFileAnAgent) {
  const Outcome outcome = Export({"--tum", Path("tracks"), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const Json told = Json::parse(outcome.out);
  ASSERT_EQ(told["files"].size(), 2u);
  EXPECT_EQ(told["files"][0]["path"], Path("tracks/ada.tum"));
  EXPECT_EQ(told["files"][0]["poses"], "4");
  // A name that leads out of the folder is no name of a file.
  EXPECT_EQ(told["files"][1]["path"], Path("tracks/H2.tum"));
  EXPECT_FALSE(fs::exists(Path("bob.tum")));
  const std::vector<std::string> lines = Lines("tracks/ada.tum");
  ASSERT_EQ(lines.size(), 6u);
  EXPECT_EQ(lines[0].substr(0, 1), "#");
  EXPECT_EQ(lines[1], "# timestamp tx ty tz qx qy qz qw");
  EXPECT_EQ(lines[3].substr(0, 21), "1403715525.907143168 ");
  std::istringstream numbers(lines[3]);
  std::vector<double> row;
  for (double number; numbers >> number;) row.push_back(number);
  ASSERT_EQ(row.size(), 8u);
  const double half = std::sqrt(0.5);
  const std::vector<double> expected = {0.5, 1.0, 0.5, 0.0, 0.0, half, half};
  for (size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(row[i + 1], expected[i], 2e-4) << i;
  // Bob's log gave no orientation.
  EXPECT_NE(outcome.errors.find("1 pose without orientation"), std::string::npos) << outcome.errors;
  EXPECT_NE(Lines("tracks/H2.tum")[2].find(" 0.000000000 1.000000000"), std::string::npos);
}

TEST_F(ExportRows, TracksEndAtTheInstant) {
  ASSERT_EQ(Export({"--tum", Path("t"), "--at", "+1.5s"}).code, 0);
  EXPECT_EQ(Lines("t/ada.tum").size(), 4u);
  // Bob's track ended before.
  EXPECT_FALSE(fs::exists(Path("t/H2.tum")));
}

TEST(FileStems, AreNamesOnlyWhereTheyAreSafeAndTheAgentsOwn) {
  const std::vector<AgentRow> agents = {{.id = "H1", .name = "ada"},  {.id = "H2", .name = "Bob"},
                                        {.id = "H3", .name = "bob"},  {.id = "H4", .name = ""},
                                        {.id = "H5", .name = "H6"},   {.id = "H6", .name = "x y"},
                                        {.id = "H7", .name = ".ssh"}, {.id = "H8", .name = "a/b"},
                                        {.id = "H9", .name = "H9"},   {.id = "r1", .name = "-rf"}};
  EXPECT_EQ(FileStems(agents), (std::vector<std::string>{"ada", "H2", "H3", "H4", "H5", "H6", "H7",
                                                         "H8", "H9", "r1"}));
}

TEST_F(ExportRows, TablesHaveAllRowsWithExactTimes) {
  const Outcome outcome = Export({"--csv", Path("t")});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const std::string nodes = ReadFile(Path("t/nodes.csv"));
  EXPECT_EQ(nodes.substr(0, 27), "id,kind,layer,name,class,cl");
  EXPECT_NE(nodes.find("valid_from_ns,valid_from_utc,valid_to_ns,valid_to_utc"), std::string::npos);
  EXPECT_NE(nodes.find("\"the \"\"hall\"\", below\""), std::string::npos) << nodes;
  EXPECT_NE(nodes.find("\"{\"\"floor\"\":\"\"oak\"\"}\"\r\n"), std::string::npos) << nodes;
  // What has ended is there, with its end.
  EXPECT_NE(nodes.find(",1403715528907143168,2014-06-25T16:58:48.907143168Z,"), std::string::npos)
      << nodes;
  EXPECT_EQ(Lines("t/nodes.csv").size(), 7u);
  EXPECT_EQ(Lines("t/edges.csv")[1].substr(0, 14), "R1,CONTAINS,p1");
  const std::vector<std::string> tracks = Lines("t/tracks.csv");
  ASSERT_EQ(tracks.size(), 6u);
  EXPECT_EQ(tracks[1].substr(0, 72),
            "H1,ada,human,1403715524907143168,2014-06-25T16:58:44.907143168Z,0,1,0.5,")
      << tracks[1];
  // No orientation is no number.
  EXPECT_NE(tracks[5].find(",,,,,0,0"), std::string::npos) << tracks[5];
  const std::vector<std::string> stays = Lines("t/stays.csv");
  ASSERT_EQ(stays.size(), 4u);
  EXPECT_EQ(stays[0], "agent_id,agent_name,node_id,node_kind,enter_ns,enter_utc,exit_ns,exit_utc");
  // A stay that goes on ends behind the last pose.
  EXPECT_NE(stays[2].find("H1,ada,R2,room,1403715531907143168,"), std::string::npos) << stays[2];
  EXPECT_NE(stays[2].find(",1403715531907143169,"), std::string::npos) << stays[2];
  EXPECT_NE(stays[3].find("H1,ada,p1,place,"), std::string::npos) << stays[3];
}

TEST_F(ExportRows, MapsWithoutDatesHaveNoColumnsOfThem) {
  store_ = Path("other");
  MakeMap(Clock::kMonotonic);
  ASSERT_EQ(Export({"--csv", Path("m")}).code, 0);
  EXPECT_EQ(ReadFile(Path("m/nodes.csv")).find("utc"), std::string::npos);
  EXPECT_EQ(Lines("m/stays.csv")[0], "agent_id,agent_name,node_id,node_kind,enter_ns,exit_ns");
}

TEST_F(ExportRows, GeoJsonIsInDegreesAndPlaysInTime) {
  const Outcome outcome =
      Export({"--geojson", Path("house.geojson"), "--origin", "0,10,90", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const Json map = Json::parse(ReadFile(Path("house.geojson")));
  EXPECT_EQ(map["type"], "FeatureCollection");
  std::map<std::string, Json> features;
  for (const Json& feature : map["features"]) features[feature["id"]] = feature;
  // Not the cup, which has been taken away.
  EXPECT_EQ(features.size(), 6u) << map.dump(1);
  const Json ring = features["R1"]["geometry"]["coordinates"][0];
  ASSERT_EQ(ring.size(), 5u);
  EXPECT_EQ(ring.front(), ring.back());
  // Counter-clockwise: the area below the path from corner to corner is positive.
  double area = 0.0;
  for (size_t i = 0; i + 1 < ring.size(); ++i) {
    area += (ring[i][0].get<double>() - 10.0) * ring[i + 1][1].get<double>() -
            (ring[i + 1][0].get<double>() - 10.0) * ring[i][1].get<double>();
  }
  EXPECT_GT(area, 0.0);
  const double metre_deg = 180.0 / M_PI / 6378137.0;
  const Json walk = features["H1/0"];
  EXPECT_EQ(walk["geometry"]["type"], "LineString");
  ASSERT_EQ(walk["geometry"]["coordinates"].size(), 3u);
  const Json second = walk["geometry"]["coordinates"][1];
  EXPECT_NEAR(second[0].get<double>(), 10.0 + 0.5 * metre_deg, 2e-9);
  EXPECT_NEAR(second[2].get<double>(), 0.5, 1e-3);
  EXPECT_NEAR(second[3].get<double>(), 1403715525.907143, 1e-6);
  EXPECT_EQ(walk["properties"]["from_ns"], "1403715524907143168");
  // One pose behind the gap, and Bob's only one.
  EXPECT_EQ(features["H1/1"]["geometry"]["type"], "Point");
  EXPECT_EQ(features["H2/2"]["properties"]["name"], "../bob");
  EXPECT_EQ(features["p1"]["geometry"]["type"], "Point");
  ASSERT_EQ(Export({"--geojson", Path("then.json"), "--origin", "0,10,90", "--at", "+1s"}).code, 0);
  EXPECT_NE(ReadFile(Path("then.json")).find("\"O1\""), std::string::npos);
}

TEST_F(ExportRows, SayWhatIsMissing) {
  const Outcome outcome = Export({"--geojson", Path("a.geojson")});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.errors.find("--origin LAT,LON,HEADING"), std::string::npos) << outcome.errors;
  EXPECT_EQ(Export({"--geojson", Path("a.geojson"), "--origin", "100,0,0"}).code, 2);
  EXPECT_EQ(Export({"--csv", Path("t"), "--origin", "0,0,0"}).code, 2);
  EXPECT_FALSE(fs::exists(Path("a.geojson")));
}

TEST_F(ExportRows, RefuseToReplaceFilesAndWriteNoneThen) {
  fs::create_directories(Path("t"));
  std::ofstream(Path("t/stays.csv")) << "mine";
  std::ofstream(Path("t/H2.tum")) << "mine";
  for (const char* option : {"--csv", "--tum"}) {
    const Outcome refused = Export({option, Path("t")});
    EXPECT_EQ(refused.code, 2);
    EXPECT_NE(refused.errors.find("--force"), std::string::npos) << refused.errors;
  }
  EXPECT_FALSE(fs::exists(Path("t/nodes.csv")));
  EXPECT_FALSE(fs::exists(Path("t/ada.tum")));
  EXPECT_EQ(Export({"--csv", Path("t"), "--force"}).code, 0);
  EXPECT_NE(ReadFile(Path("t/stays.csv")), "mine");
  std::ofstream(Path("file")) << "mine";
  EXPECT_EQ(Export({"--csv", Path("file"), "--force"}).code, 2);
}

// All files of a run are of one revision and told together.
TEST_F(ExportRows, GoTogetherWithOtherFiles) {
  const Outcome outcome =
      Export({"--csv", Path("t"), "--tum", Path("t"), "--gltf", Path("a.glb"), "--revision", "1"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 7) << outcome.out;
  EXPECT_EQ(Export({Path("a.dsgz"), "--csv", Path("t")}).code, 2);
}

}  // namespace
}  // namespace dsg::cli
