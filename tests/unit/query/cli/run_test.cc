// SPDX-License-Identifier: Apache-2.0
// The whole program on a small store on disk: the contract that scripts rely on.
#include "query/cli/run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "schema/base/status.h"
#include "schema/base/time.h"
#include "schema/store/graph_store.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::Arguments;
using test::MakeEdge;
using test::MakeNode;
using test::Outcome;
using test::RunDsg;

constexpr TimeNs kEpoch = 100 * kNsPerSecond;
constexpr NodeId kHuman('H', 12);

Edge Contains(NodeId parent, NodeId child) { return MakeEdge(parent, relations::kContains, child); }

// One metre a second along x for ten seconds, then nothing seen until the twentieth.
TrajectoryAppend WalkWithGap() {
  TrajectoryAppend walk{.agent = kHuman, .poses = {}};
  for (const int second : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 20}) {
    TimedPose pose;
    pose.time_ns = kEpoch + second * kNsPerSecond;
    pose.map_T_agent.position = Eigen::Vector3d(second, 0.0, 0.0);
    walk.poses.push_back(pose);
  }
  return walk;
}

// A hall and a kitchen in a building; human 12 walks from one into the other.
GraphDelta Office() {
  const NodeId building('B', 0), hall('R', 1), kitchen('R', 2), place1('p', 1), place2('p', 2);
  GraphDelta delta;
  delta.map = "office";
  delta.session_id = "test";
  delta.sequence = 1;
  delta.author = "run_test";
  delta.message = "the office";
  delta.nodes = {
      MakeNode(building, kinds::kBuilding, "", 5.0),   MakeNode(hall, kinds::kRoom, "hall", 2.5),
      MakeNode(kitchen, kinds::kRoom, "kitchen", 7.5), MakeNode(place1, kinds::kPlace, "", 2.5),
      MakeNode(place2, kinds::kPlace, "", 7.5),        MakeNode(kHuman, kinds::kHuman, "12", 0.0)};
  delta.edges = {Contains(building, hall), Contains(building, kitchen), Contains(hall, place1),
                 Contains(kitchen, place2)};
  delta.appends = {WalkWithGap()};
  const TimeNs door_ns = kEpoch + 5 * kNsPerSecond;
  delta.stays = {{kHuman, place1, hall, kEpoch, door_ns},
                 {kHuman, place2, kitchen, door_ns, kEpoch + 10 * kNsPerSecond}};
  FitBoxesToChildren(&delta);
  return delta;
}

// A second revision: somebody put down a cup.
GraphDelta CupDelta() {
  GraphDelta delta;
  delta.map = "office";
  delta.session_id = "test";
  delta.sequence = 2;
  delta.nodes = {MakeNode(NodeId('O', 1), kinds::kObject, "cup", 7.5)};
  delta.nodes[0].class_id = 3;
  delta.nodes[0].class_name = "cup";
  delta.labels = {{3, "cup"}};
  return delta;
}

class RunTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "dsg-cli-XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    store_ = folder_ + "/store";
    const auto store = GraphStore::Open(store_, {.create = true});
    ASSERT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = "office";
    spec.epoch_ns = kEpoch;
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
    const auto writer = (*store)->OpenWriter("office");
    ASSERT_TRUE(writer.ok()) << writer.status();
    for (const GraphDelta& delta : {Office(), CupDelta()}) {
      const auto committed = (*writer)->Commit(delta);
      ASSERT_TRUE(committed.ok()) << committed.status();
    }
  }
  void TearDown() override { fs::remove_all(folder_); }

  Outcome Ask(Arguments arguments) {
    arguments.insert(arguments.end(), {"--store", store_});
    return RunDsg(arguments);
  }
  Json AskJson(Arguments arguments) {
    arguments.push_back("--json");
    const Outcome outcome = Ask(std::move(arguments));
    EXPECT_EQ(outcome.code, 0) << outcome.errors;
    EXPECT_EQ(outcome.errors, "");
    return Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  }
  // The question fails with this exit code and says this; nothing is printed as an answer.
  void ExpectRefused(int code, const std::string& what, Arguments arguments) {
    const Outcome outcome = Ask(std::move(arguments));
    EXPECT_EQ(outcome.code, code) << outcome.errors;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(outcome.errors.substr(0, 5), "dsg: ");
    EXPECT_NE(outcome.errors.find(what), std::string::npos) << outcome.errors;
  }
  void AddMap(const std::string& name) {
    const auto store = GraphStore::Open(store_, {});
    ASSERT_TRUE(store.ok());
    MapSpec spec;
    spec.name = name;
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
  }

  std::string folder_;
  std::string store_;
};

TEST_F(RunTest, WhereGivesPoseQualityPlaceAndRoom) {
  const Json reply = AskJson({"where", "H12", "--at", "+2.5s"});
  EXPECT_NEAR(reply["pose"]["position"]["x"].get<double>(), 2.5, 2e-4);
  for (const char* axis : {"x", "y", "z"}) EXPECT_TRUE(reply["pose"]["position"].contains(axis));
  for (const char* axis : {"x", "y", "z", "w"}) {
    EXPECT_TRUE(reply["pose"]["orientation"].contains(axis));
  }
  EXPECT_EQ(reply["quality"], "INTERPOLATED");
  EXPECT_EQ(reply["place_id"], "p1");
  EXPECT_EQ(reply["room_id"], "R1");
  EXPECT_EQ(reply["at_ns"], "102500000000");
}

TEST_F(RunTest, AgentsAreKnownByIdAndByTheNameOfTheLog) {
  EXPECT_EQ(Ask({"where", "H12", "--at", "+3s", "--json"}).out,
            Ask({"where", "12", "--at", "103000000000", "--json"}).out);
}

TEST_F(RunTest, WhereSpeaksToPeople) {
  const Outcome outcome = Ask({"where", "12", "--at", "+7.5s"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(outcome.out,
            "12 (H12) at +7.5s (revision 2): x 7.50 y 0.00 z 0.00 m, yaw 0.0 deg, interpolated "
            "between +7s and +8s; place p2, room R2 \"kitchen\", building B0\n");
}

TEST_F(RunTest, AGapIsAnAnswerWithoutAPose) {
  const Json reply = AskJson({"where", "H12", "--at", "+15s"});
  EXPECT_EQ(reply["quality"], "IN_GAP");
  EXPECT_FALSE(reply.contains("pose"));
}

TEST_F(RunTest, AGapIsDrawnByItsEnds) {
  const std::string file = folder_ + "/gap.png";
  const Outcome outcome = Ask({"where", "12", "--at", "+15s", "--png", file, "--width", "300"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_TRUE(fs::exists(file));
}

TEST_F(RunTest, WhatIsNotThereExitsWithOne) {
  ExpectRefused(1, "AGENT_UNKNOWN", {"where", "H99", "--at", "+1s"});
  ExpectRefused(1, "TIME_OUTSIDE_TRACK", {"where", "H12", "--at", "+21s"});
  ExpectRefused(1, "(the track: +0s to +20s)", {"where", "H12", "--at", "-3s"});
  ExpectRefused(1, "MAP_UNKNOWN", {"stats", "--map", "attic"});
  ExpectRefused(1, "REVISION_IN_FUTURE", {"stats", "--revision", "3"});
  ExpectRefused(1, "NODE_UNKNOWN", {"show", "O77"});
  ExpectRefused(1, "NODE_UNKNOWN", {"who", "--room", "pantry"});
}

TEST_F(RunTest, MisspeltNamesGetThoseThatAreNear) {
  ExpectRefused(1, "near in spelling: \"office\"", {"stats", "--map", "ofice"});
  ExpectRefused(1, "near in spelling: \"12\"", {"where", "13", "--at", "+1s"});
  ExpectRefused(1, "near in spelling: \"kitchen\"", {"who", "--room", "kitchn"});
  ExpectRefused(1, "near in spelling: \"cup\"", {"show", "cupp"});
  ExpectRefused(1, "near in spelling: \"p2\"", {"show", "pp2"});
  // An id is not a word.
  EXPECT_EQ(Ask({"show", "O2"}).errors.find("near in spelling"), std::string::npos);
}

TEST_F(RunTest, ListsComeAsCsvAndAsJsonLines) {
  const Outcome csv = Ask({"ls", "--kind", "room", "--format", "csv"});
  EXPECT_EQ(csv.code, 0) << csv.errors;
  EXPECT_EQ(csv.out,
            "id,kind,layer,name,class,x_m,y_m,z_m\r\n"
            "R1,room,rooms,hall,,2.5,0,0\r\n"
            "R2,room,rooms,kitchen,,7.5,0,0\r\n");
  const Outcome lines = Ask({"track", "12", "--limit", "2", "--format", "jsonl"});
  EXPECT_EQ(lines.code, 0) << lines.errors;
  EXPECT_EQ(std::count(lines.out.begin(), lines.out.end(), '\n'), 2) << lines.out;
  EXPECT_EQ(Json::parse(lines.out.substr(0, lines.out.find('\n')))["time_ns"], "100000000000");
  for (const Arguments& verb : {Arguments{"edges"},
                                {"near", "1,0,0"},
                                {"around", "R1"},
                                {"find", "cup"},
                                {"log"},
                                {"maps"},
                                {"tag"},
                                {"who", "--room", "hall"},
                                {"met"},
                                {"factors", "12"}}) {
    for (const char* format : {"csv", "jsonl"}) {
      Arguments arguments = verb;
      arguments.insert(arguments.end(), {"--format", format});
      const Outcome outcome = Ask(arguments);
      EXPECT_EQ(outcome.code, 0) << verb[0] << " " << outcome.errors;
      EXPECT_EQ(outcome.errors, "") << verb[0];
      EXPECT_TRUE(format[0] == 'j' || outcome.out.find("\r\n") != std::string::npos) << verb[0];
    }
  }
}

// The parts of a long list make the same JSON as the whole.
TEST_F(RunTest, JsonOfPagesIsOfOneReply) {
  const Json nodes = AskJson({"ls"});
  EXPECT_EQ(nodes["nodes"].size(), 7u);
  EXPECT_EQ(nodes["next_page_token"], "");
  EXPECT_NE(AskJson({"ls", "--limit", "2"})["next_page_token"], "");
  EXPECT_EQ(AskJson({"who", "--room", "hall"})["observed_agent_count"], "1");
}

TEST_F(RunTest, WhatIsAskedWronglyExitsWithTwo) {
  ExpectRefused(2, "--at", {"where", "H12", "--at", "noon"});
  ExpectRefused(2, "MAP_NAME_INVALID", {"stats", "--map", "../x"});
  ExpectRefused(2, "BOX_INVERTED", {"who", "--box", "1,0,0,0,1,1"});
  ExpectRefused(2, "--every", {"track", "H12", "--every", "0"});
  ExpectRefused(2, "POSITION", {"near", "1,2"});
  ExpectRefused(2, "--from +2s is not before --to +1s;",
                {"who", "--room", "R1", "--from", "+2s", "--to", "+1s"});
  ExpectRefused(2, "--from +2s is not before --to +1s;",
                {"track", "H12", "--from", "+2s", "--to", "+1s"});
  // The end that is not given is one of all poses.
  ExpectRefused(2, "--from +60s is behind the last pose of the map, +20s",
                {"who", "--room", "R1", "--from", "+1m"});
  ExpectRefused(2, "--to -3s is not behind the first pose of the map, +0s",
                {"who", "--room", "R1", "--to=-3s"});
}

TEST_F(RunTest, NoServerExitsWithThree) {
  const Outcome outcome = RunDsg({"stats", "--server", "unix:" + folder_ + "/none", "--map", "m"});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_NE(outcome.errors.find("dsg-server --store"), std::string::npos) << outcome.errors;
}

TEST_F(RunTest, TrackHoldsTimedPoses) {
  const Json reply = AskJson({"track", "H12"});
  ASSERT_EQ(reply["poses"].size(), 12u);
  EXPECT_EQ(reply["poses"][0]["time_ns"], "100000000000");
  EXPECT_NEAR(reply["poses"][11]["pose"]["position"]["x"].get<double>(), 20.0, 1e-4);
  EXPECT_EQ(AskJson({"track", "H12", "--from", "+2s", "--to", "+4s"})["poses"].size(), 2u);
  EXPECT_EQ(AskJson({"track", "H12", "--limit", "5"})["poses"].size(), 5u);
}

TEST_F(RunTest, TrackCanBeResampledButNotInsideGaps) {
  const Json reply = AskJson({"track", "H12", "--every", "500ms", "--from", "+8s", "--to", "+19s"});
  ASSERT_EQ(reply["poses"].size(), 5u);
  EXPECT_NEAR(reply["poses"][1]["pose"]["position"]["x"].get<double>(), 8.5, 2e-4);
}

TEST_F(RunTest, WhoKnowsRoomsByIdAndName) {
  const Json reply = AskJson({"who", "--room", "R2", "--from", "+0s", "--to", "+8s"});
  ASSERT_EQ(reply["intervals"].size(), 1u);
  EXPECT_EQ(reply["intervals"][0]["agent_id"], "H12");
  EXPECT_EQ(reply["intervals"][0]["enter_ns"], "105000000000");
  EXPECT_EQ(reply["intervals"][0]["exit_ns"], "108000000000");
  EXPECT_EQ(reply["observed_agent_count"], "1");
  EXPECT_EQ(reply, AskJson({"who", "--room", "kitchen", "--from", "+0s", "--to", "+8s"}));
}

TEST_F(RunTest, WhoAsksAboutTheWholeSpanByDefault) {
  const Json reply = AskJson({"who", "--box", "2,-1,-1,4,1,1"});
  ASSERT_EQ(reply["intervals"].size(), 1u);
  EXPECT_NEAR(std::stod(reply["intervals"][0]["enter_ns"].get<std::string>()), 102e9, 1e6);
  EXPECT_NEAR(std::stod(reply["intervals"][0]["exit_ns"].get<std::string>()), 104e9, 1e6);
}

TEST_F(RunTest, NobodyThereIsAnAnswer) {
  const Outcome outcome = Ask({"who", "--room", "R2", "--from", "+0s", "--to", "+1s"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.out.find("0 stays; 1 agent observed"), std::string::npos) << outcome.out;
}

TEST_F(RunTest, ListsNodesByLayerParentKindAndClass) {
  const Json rooms = AskJson({"ls", "--layer", "rooms"});
  ASSERT_EQ(rooms["nodes"].size(), 2u);
  EXPECT_EQ(rooms["nodes"][0]["id"], "R1");
  EXPECT_EQ(rooms["nodes"][0]["name"], "hall");
  EXPECT_EQ(rooms["nodes"][0]["kind"], "room");
  EXPECT_EQ(AskJson({"ls", "--parent", "R2"})["nodes"][0]["id"], "p2");
  EXPECT_EQ(AskJson({"ls", "--kind", "human"})["nodes"][0]["id"], "H12");
  EXPECT_EQ(AskJson({"ls", "--class", "cup"})["nodes"][0]["id"], "O1");
  EXPECT_EQ(AskJson({"ls"})["nodes"].size(), 7u);
  EXPECT_EQ(AskJson({"ls", "--limit", "3"})["nodes"].size(), 3u);
}

TEST_F(RunTest, AsOfIsTheNewestRevisionCommittedUntilThen) {
  // Newest first.
  const Json revisions = AskJson({"log"})["revisions"];
  ASSERT_EQ(revisions.size(), 2u);
  const TimeNs second_ns = std::stoll(revisions[0]["committed_ns"].get<std::string>());
  const TimeNs first_ns = std::stoll(revisions[1]["committed_ns"].get<std::string>());
  ASSERT_LT(first_ns, second_ns);
  EXPECT_EQ(AskJson({"ls", "--as-of", FormatRfc3339(first_ns)})["nodes"].size(), 6u);
  EXPECT_EQ(AskJson({"ls", "--as-of", FormatRfc3339(second_ns - 1)})["nodes"].size(), 6u);
  EXPECT_EQ(AskJson({"ls", "--as-of", FormatRfc3339(second_ns)})["nodes"].size(), 7u);
  ExpectRefused(1, "no revision that was committed at or before",
                {"ls", "--as-of", FormatRfc3339(first_ns - 1)});
  // A tag can be set at one.
  const Outcome tagged = Ask({"tag", "before", "--as-of", FormatRfc3339(first_ns)});
  EXPECT_EQ(tagged.out, "tag before is revision 1\n") << tagged.errors;
}

TEST_F(RunTest, AFolderWithoutMapsIsNotServed) {
  const std::string empty = folder_ + "/empty";
  fs::create_directory(empty);
  for (const auto& [folder, what] : {std::pair(empty, " has no maps; name the folder of a store"),
                                     std::pair(folder_ + "/none", " is not there; ")}) {
    const Outcome outcome = RunDsg({"view", folder});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_NE(outcome.errors.find(folder + what), std::string::npos) << outcome.errors;
  }
  EXPECT_TRUE(fs::is_empty(empty));
}

TEST_F(RunTest, AnEmptyPictureIsDrawnWithANote) {
  const std::string file = folder_ + "/empty.png";
  using Words = std::vector<std::string>;
  for (const auto& [words, note] :
       {std::pair(Words{"--mesh"}, "map office has no mesh at revision 2"),
        std::pair(Words{"--revision", "0"}, "map office has nothing at revision 0"),
        std::pair(Words{"--bodies", "--at", "+1s"}, "no body of anybody is known at +1s")}) {
    Words arguments = {"map", "--png", file, "--width", "300", "--force"};
    arguments.insert(arguments.end(), words.begin(), words.end());
    const Outcome outcome = Ask(arguments);
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.errors.find(note), std::string::npos) << outcome.errors;
    EXPECT_TRUE(fs::exists(file));
  }
}

TEST_F(RunTest, PastRevisionsAnswerAsTheyDid) {
  EXPECT_EQ(AskJson({"ls", "--revision", "1"})["nodes"].size(), 6u);
  EXPECT_EQ(AskJson({"stats", "--revision", "1"})["node_count"], "6");
  EXPECT_EQ(AskJson({"stats"})["node_count"], "7");
}

TEST_F(RunTest, ShowsEdgesNodesAndNeighbours) {
  EXPECT_EQ(AskJson({"edges", "--source", "B0"})["edges"].size(), 2u);
  EXPECT_EQ(AskJson({"edges", "--relation", "CONTAINS"})["edges"].size(), 4u);
  EXPECT_EQ(AskJson({"show", "p2"})["ancestor_ids"], Json({"R2", "B0"}));
  EXPECT_EQ(AskJson({"show", "H12"})["pose_count"], "12");
  const Json near = AskJson({"near", "7,0,0", "--k", "1", "--layer", "objects"});
  ASSERT_EQ(near["nodes"].size(), 1u);
  EXPECT_EQ(near["nodes"][0]["node"]["id"], "O1");
  EXPECT_NEAR(near["nodes"][0]["distance_m"].get<double>(), 0.5, 1e-9);
}

TEST_F(RunTest, LogIsNewestFirst) {
  const Json reply = AskJson({"log"});
  ASSERT_EQ(reply["revisions"].size(), 2u);
  EXPECT_EQ(reply["revisions"][0]["revision"], "2");
  EXPECT_EQ(reply["revisions"][1]["message"], "the office");
  EXPECT_EQ(AskJson({"log", "--limit", "1"})["revisions"].size(), 1u);
}

TEST_F(RunTest, StatsHoldsWhatTheContractNames) {
  const Json reply = AskJson({"stats"});
  EXPECT_EQ(reply["head_revision"], "2");
  EXPECT_EQ(reply["edge_count"], "4");
  EXPECT_EQ(reply["agent_count"], "1");
  EXPECT_EQ(reply["pose_count"], "12");
  EXPECT_GT(std::stoll(reply["bytes_on_disk"].get<std::string>()), 0);
  bool has_rooms = false;
  for (const Json& layer : reply["layers"]) {
    if (layer["name"] == "rooms") has_rooms = layer["node_count"] == "2";
  }
  EXPECT_TRUE(has_rooms) << reply["layers"];
}

TEST_F(RunTest, EveryVerbAlsoSpeaksToPeople) {
  for (const Arguments& arguments : std::vector<Arguments>{{"track", "H12"},
                                                           {"who", "--room", "R1"},
                                                           {"ls"},
                                                           {"edges"},
                                                           {"show", "R1"},
                                                           {"near", "0,0,0"},
                                                           {"log"},
                                                           {"stats"},
                                                           {"maps"},
                                                           {"verify"}}) {
    const Outcome outcome = Ask(arguments);
    EXPECT_EQ(outcome.code, 0) << arguments[0] << ": " << outcome.errors;
    EXPECT_NE(outcome.out, "") << arguments[0];
    EXPECT_NE(outcome.out[0], '{') << arguments[0];
  }
}

TEST_F(RunTest, SeveralMapsMustBeTold) {
  AddMap("attic");
  ExpectRefused(2, "attic office", {"stats"});
  EXPECT_EQ(AskJson({"stats", "--map", "attic"})["head_revision"], "0");
  EXPECT_EQ(AskJson({"maps"})["maps"].size(), 2u);
}

TEST_F(RunTest, EnvironmentNamesStoreAndMap) {
  AddMap("attic");
  const Outcome outcome =
      RunDsg({"stats", "--json"}, {.store = store_, .map = "office", .version = "0.1.0"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
}

TEST_F(RunTest, VerifyFindsNothingInASoundStore) {
  const Outcome outcome = Ask({"verify"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_NE(outcome.out.find("office: 2 revisions"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("12 poses, 0 problems"), std::string::npos) << outcome.out;
}

TEST_F(RunTest, VersionNeedsNoStore) {
  const Outcome outcome = RunDsg({"version", "--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(Json::parse(outcome.out)["version"], "0.1.0");
}

// Importing: a file of another project, from the data folder.
class ImportTest : public RunTest {
 protected:
  void SetUp() override {
    RunTest::SetUp();
    const char* data = std::getenv("DSG_DATA");
    file_ = fs::path(data != nullptr ? data : DSG_SOURCE_DIR "/../shared/data") / "dsg-spark" /
            "scene_graph_content.json";
    if (!fs::exists(file_)) {
      GTEST_SKIP() << "the folder of data logs is not here; set DSG_DATA to run this";
    }
  }
  Outcome Import(const std::string& file, const std::string& map) {
    return Ask({"import", file, "--map", map});
  }
  std::string file_;
};

TEST_F(ImportTest, TheSameFileTwiceAddsNothing) {
  const Outcome first = Import(file_, "spark");
  ASSERT_EQ(first.code, 0) << first.errors;
  EXPECT_NE(first.out.find("imported"), std::string::npos) << first.out;
  const Json before = AskJson({"log", "--map", "spark"});
  EXPECT_GE(before["revisions"].size(), 1u);
  const Outcome second = Import(file_, "spark");
  ASSERT_EQ(second.code, 0) << second.errors;
  EXPECT_NE(second.out.find("nothing added"), std::string::npos) << second.out;
  EXPECT_EQ(AskJson({"log", "--map", "spark"}), before);
}

TEST_F(ImportTest, ATruncatedFileLeavesNoMapBehind) {
  const std::string cut = folder_ + "/cut.json";
  fs::copy_file(file_, cut);
  fs::permissions(cut, fs::perms::owner_all);
  fs::resize_file(cut, fs::file_size(cut) / 2);
  const Outcome outcome = Import(cut, "spark");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.errors.find("FILE_MALFORMED"), std::string::npos) << outcome.errors;
  EXPECT_NE(outcome.errors.find("cut.json"), std::string::npos) << outcome.errors;
  EXPECT_EQ(AskJson({"maps"})["maps"].size(), 1u);
}

// A file of three nodes and three edges, of which one leads nowhere.
constexpr char kDangling[] = R"({"nodes": [
    {"id": 5908722711110090753, "layer": 4, "attributes": {"type": "RoomNodeAttributes",
     "position": [0, 0, 0]}},
    {"id": 5692549928996306945, "layer": 2, "attributes": {"type": "ObjectNodeAttributes",
     "position": [1, 0, 0]}},
    {"id": 5692549928996306946, "layer": 2, "attributes": {"type": "ObjectNodeAttributes",
     "position": [2, 0, 0]}}], "edges": [
    {"source": 5908722711110090753, "target": 5692549928996306945, "info": {}},
    {"source": 5908722711110090753, "target": 5692549928996306946, "info": {}},
    {"source": 5908722711110090753, "target": 5692549928996306999, "info": {}}]})";
constexpr char kDanglingWords[] =
    "skipped 1 edges to nodes that are not there: edge R1 to O55: node 5692549928996306999 (O55) "
    "is not in the file";

TEST_F(RunTest, ImportsAFileButForTheEdgesThatLeadNowhere) {
  const std::string file = folder_ + "/dangling.json";
  std::ofstream(file) << kDangling;
  const Outcome done = Ask({"import", file, "--map", "lenient"});
  ASSERT_EQ(done.code, 0) << done.errors;
  EXPECT_NE(done.errors.find(kDanglingWords), std::string::npos) << done.errors;
  EXPECT_NE(done.out.find("3 nodes, 2 edges"), std::string::npos) << done.out;
  const Outcome again = Ask({"import", file, "--map", "lenient", "--json"});
  EXPECT_EQ(Json::parse(again.out)["skipped"][0]["count"], "1") << again.out;
}

TEST_F(RunTest, RefusesAFileWithSuchEdgesIfStrict) {
  const std::string file = folder_ + "/dangling.json";
  std::ofstream(file) << kDangling;
  const Outcome refused = Ask({"import", file, "--map", "strict", "--strict"});
  EXPECT_EQ(refused.code, 2) << refused.errors;
  EXPECT_NE(refused.errors.find(kDanglingWords), std::string::npos) << refused.errors;
  EXPECT_EQ(Ask({"stats", "--map", "strict"}).code, 1);
}

TEST_F(ImportTest, RefusesMissingFilesAndWrongNames) {
  EXPECT_EQ(Import(folder_ + "/none.json", "spark").code, 1);
  EXPECT_EQ(Import(file_, "../x").code, 2);
  EXPECT_EQ(AskJson({"maps"})["maps"].size(), 1u);
}

}  // namespace
}  // namespace dsg::cli
