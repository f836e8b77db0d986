// SPDX-License-Identifier: Apache-2.0
// The verbs export and map on a store on disk: what is read, written, refused and told.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "query/cli/run.h"
#include "schema/store/graph_store.h"
#include "tests/support/full_disk.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/query/cli/cli_test_util.h"
#include "tests/unit/query/cli/example_content.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::Arguments;
using test::Outcome;
using test::ReadFile;

class ExportVerbs : public testing::Test {
 protected:
  void SetUp() override {
    const auto store = GraphStore::Open(store_, {.create = true});
    ASSERT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = "example";
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
    const auto writer = (*store)->OpenWriter("example");
    ASSERT_TRUE(writer.ok()) << writer.status();
    for (const GraphDelta& delta : {First(), Second()}) {
      const auto committed = (*writer)->Commit(delta);
      ASSERT_TRUE(committed.ok()) << committed.status();
    }
  }

  static GraphDelta First() {
    const MapContent content = test::ExampleContent();
    GraphDelta delta;
    delta.map = "example";
    delta.session_id = "test";
    delta.sequence = 1;
    delta.nodes = content.nodes;
    delta.edges = content.edges;
    delta.labels = {{3, "chair"}};
    TrajectoryAppend walk{.agent = NodeId('H', 1), .poses = {}};
    for (const int second : {0, 1, 2, 3, 9, 10}) {
      TimedPose pose;
      pose.time_ns = second * kNsPerSecond;
      pose.map_T_agent.position = Eigen::Vector3d(0.5 * second, 3.0, 1.0);
      walk.poses.push_back(pose);
    }
    delta.appends = {walk};
    return delta;
  }

  // The chair is taken away after six seconds, and the mesh becomes known.
  static GraphDelta Second() {
    GraphDelta delta;
    delta.map = "example";
    delta.session_id = "test";
    delta.sequence = 2;
    delta.retirements = {{.id = NodeId('O', 1), .valid_to_ns = 6 * kNsPerSecond}};
    delta.mesh_blocks = test::ExampleContent().mesh;
    return delta;
  }

  Outcome Ask(Arguments arguments) {
    arguments.insert(arguments.end(), {"--store", store_});
    return test::RunDsg(arguments);
  }
  std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }

  // The text part of a .glb, which names the nodes.
  std::string Scene(Arguments arguments) {
    arguments.insert(arguments.begin(), {"export", "--gltf", Path("a.glb"), "--force"});
    const Outcome outcome = Ask(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.errors;
    return ReadFile(Path("a.glb"));
  }

  test::TempFolder folder_;
  const std::string store_ = folder_.path() + "/store";
};

TEST_F(ExportVerbs, WritesAllFilesOfOneRunAndTellsWhatIsInThem) {
  const Outcome outcome = Ask({"export", "--ply", Path("m.ply"), "--graph-ply", Path("g.ply"),
                               "--gltf", Path("a.glb"), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const Json told = Json::parse(outcome.out);
  EXPECT_EQ(told["read_revision"], "2");
  ASSERT_EQ(told["files"].size(), 3u);
  EXPECT_EQ(told["files"][0]["vertices"], "8");
  EXPECT_EQ(told["files"][0]["faces"], "4");
  for (const Json& file : told["files"]) {
    EXPECT_EQ(file["byte_count"], std::to_string(fs::file_size(file["path"].get<std::string>())));
  }
}

TEST_F(ExportVerbs, SaysThatAMapHasNoMesh) {
  const std::string path = Path("m.ply");
  const Outcome before = Ask({"export", "--ply", path, "--revision", "1"});
  ASSERT_EQ(before.code, 0) << before.errors;
  EXPECT_NE(before.errors.find("note: map example has no mesh at revision 1, so " + path +
                               " has no vertices\n"),
            std::string::npos)
      << before.errors;
  EXPECT_EQ(Ask({"export", "--ply", path, "--force"}).errors.find("no mesh"), std::string::npos);
  EXPECT_EQ(Ask({"export", "--gltf", Path("a.glb"), "--revision", "1"}).errors.find("no mesh"),
            std::string::npos);
}

TEST_F(ExportVerbs, WritesTheMeshOfOneNode) {
  // All of it lies in the first room.
  for (const auto& [room, faces] : {std::pair{"R1", "4"}, {"R2", "0"}}) {
    const Outcome outcome =
        Ask({"export", "--ply", Path("m.ply"), "--node", room, "--force", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    EXPECT_EQ(Json::parse(outcome.out)["files"][0]["faces"], faces) << room;
    EXPECT_EQ(outcome.errors.find("no triangles of R2") != std::string::npos, faces[0] == '0');
  }
  EXPECT_NE(Ask({"export", "--ply", Path("h.ply"), "--node", "H1"}).code, 0);
  EXPECT_EQ(Ask({"export", "--gltf", Path("a.glb"), "--node", "R1"}).code, 2);
  EXPECT_EQ(Ask({"export", Path("a.dsgz"), "--node", "R1"}).code, 2);
}

TEST_F(ExportVerbs, LeavesOutWhatHasEndedUnlessAskedForThen) {
  EXPECT_EQ(Scene({}).find("\"O1\""), std::string::npos);
  EXPECT_NE(Scene({"--at", "+5s"}).find("\"O1\""), std::string::npos);
  EXPECT_EQ(Scene({"--at", "+6s"}).find("\"O1\""), std::string::npos);
  // As believed before the chair was known to be gone, and before there was a mesh.
  const std::string before = Scene({"--revision", "1"});
  EXPECT_NE(before.find("\"O1\""), std::string::npos);
  EXPECT_EQ(before.find("\"name\":\"mesh\",\"mesh\""), std::string::npos);
  EXPECT_NE(Scene({}).find("\"name\":\"mesh\",\"mesh\""), std::string::npos);
}

TEST_F(ExportVerbs, WritesAWorldForPhysicsAndItsMeshBesideIt) {
  const Outcome outcome = Ask({"export", "--sdf", Path("a.sdf"), "--at", "+5s", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const Json told = Json::parse(outcome.out);
  ASSERT_EQ(told["files"].size(), 2u);
  EXPECT_EQ(told["files"][0]["path"], Path("a.stl"));
  EXPECT_EQ(told["files"][0]["faces"], "4");
  EXPECT_EQ(told["files"][1]["objects"], "1");
  EXPECT_EQ(told["files"][1]["movable"], "0");
  EXPECT_EQ(told["files"][1]["agents"], "1");
  const std::string world = ReadFile(Path("a.sdf"));
  EXPECT_NE(world.find("<uri>a.stl</uri>"), std::string::npos);
  // At 5 s the human was last seen at 3 s, 1.5 m along.
  EXPECT_NE(world.find("<pose>1.500000 3.000000 1.000000 "), std::string::npos);
  // Without an instant nobody is anywhere, and the chair has been taken away.
  fs::remove(Path("a.sdf"));
  const Outcome refused = Ask({"export", "--sdf", Path("a.sdf")});
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.errors.find("a.stl"), std::string::npos) << refused.errors;
  EXPECT_EQ(Ask({"export", "--sdf", Path("a.sdf"), "--force"}).code, 0);
  EXPECT_EQ(ReadFile(Path("a.sdf")).find("H1"), std::string::npos);
  EXPECT_EQ(ReadFile(Path("a.sdf")).find("O1"), std::string::npos);
  EXPECT_EQ(Ask({"export", "--sdf", Path("a.xml")}).code, 2);
  EXPECT_EQ(Ask({"export", "--sdf", Path("b.sdf"), "--density", "nan"}).code, 2);
}

TEST_F(ExportVerbs, EndsTracksAtTheInstant) {
  // At 5 s the human was last seen at 3 s, 1.5 m along.
  EXPECT_NE(Scene({"--at", "+5s"}).find("\"translation\":[1.5,3.0,1.0]"), std::string::npos);
  EXPECT_NE(Scene({}).find("\"translation\":[5.0,3.0,1.0]"), std::string::npos);
}

TEST_F(ExportVerbs, RefusesToReplaceFilesAndWritesNoneThen) {
  std::ofstream(Path("g.ply")) << "mine";
  const Arguments arguments = {"export", "--gltf", Path("a.glb"), "--graph-ply", Path("g.ply")};
  const Outcome refused = Ask(arguments);
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.errors.find("--force"), std::string::npos);
  EXPECT_TRUE(refused.out.empty());
  EXPECT_EQ(ReadFile(Path("g.ply")), "mine");
  EXPECT_FALSE(fs::exists(Path("a.glb")));
  Arguments forced = arguments;
  forced.push_back("--force");
  EXPECT_EQ(Ask(forced).code, 0);
  EXPECT_NE(ReadFile(Path("g.ply")), "mine");
}

TEST_F(ExportVerbs, SayWhatIsMissingOrWrong) {
  EXPECT_EQ(Ask({"export"}).code, 2);
  EXPECT_EQ(Ask({"map"}).code, 2);
  EXPECT_EQ(Ask({"export", "--ply", Path("m.ply"), "--color", "loud"}).code, 2);
  EXPECT_EQ(Ask({"map", "--png", Path("a.png"), "--width", "100000"}).code, 2);
  EXPECT_EQ(Ask({"map", "--png", Path("a.png"), "--floor", "attic"}).code, 1);
  EXPECT_EQ(Ask({"map", "--png", Path("a.png"), "--revision", "9"}).code, 1);
  EXPECT_EQ(Ask({"map", "--png", Path("no/a.png")}).code, 2);
  EXPECT_EQ(Ask({"map", "--png", "/dev/full", "--force"}).code, 2);
  EXPECT_EQ(Ask({"map", "--png", Path("a.png"), "--at", "soon"}).code, 2);
  EXPECT_EQ(Ask({"map", "--png", Path("a.png"), "--mesh", "--exploded"}).code, 2);
  EXPECT_EQ(Ask({"map", "--png", Path("a.png"), "--beside", "example"}).code, 2);
  EXPECT_EQ(Ask({"map", "--png", Path("a.png"), "--mesh", "--beside", "nowhere"}).code, 1);
  EXPECT_EQ(Ask({"map", "--png", Path("a.png"), "--bodies"}).code, 2) << "no instant";
  EXPECT_EQ(Ask({"export", "--ply", Path("m.ply"), "--bodies"}).code, 2) << "no instant";
  EXPECT_EQ(Ask({"export", "--graph-ply", Path("g.ply"), "--bodies"}).code, 2) << "no place";
  const Outcome none = Ask({"export", "--gltf", Path("b.glb"), "--bodies"});
  EXPECT_EQ(none.code, 0) << none.errors;
  EXPECT_NE(none.errors.find("no agent has a body"), std::string::npos) << none.errors;
  const Outcome nobody = Ask({"map", "--png", Path("b.png"), "--bodies", "--at", "0ns"});
  EXPECT_EQ(nobody.code, 0) << nobody.errors;
  EXPECT_NE(nobody.errors.find("no agent has a body"), std::string::npos) << nobody.errors;
}

TEST_F(ExportVerbs, AFullDiskIsToldAndLeavesNoFile) {
  // The first reader of a map writes the index of its log.
  const auto store = GraphStore::Open(store_, {});
  const auto map = (*store)->OpenMap("example");
  ASSERT_TRUE(map.ok() && (*map)->Latest().ok());
  for (const auto& [verb, option, name] : {std::tuple{"export", "--gltf", "x.glb"},
                                           {"export", "--ply", "x.ply"},
                                           {"export", "--graph-ply", "x.ply"},
                                           {"export", "--geojson", "x.geojson"},
                                           {"export", "--csv", "x"},
                                           {"export", "--tum", "x"},
                                           {"map", "--png", "x.png"}}) {
    const Outcome outcome = [&] {
      const dsg::test::FullDisk full;
      Arguments arguments = {verb, option, Path(name)};
      if (name == std::string("x.geojson"))
        arguments.insert(arguments.end(), {"--origin", "0,0,0"});
      return Ask(arguments);
    }();
    EXPECT_EQ(outcome.code, 3) << verb << " " << option << " " << outcome.errors;
    EXPECT_NE(outcome.errors.find("DISK_FULL"), std::string::npos) << outcome.errors;
    EXPECT_TRUE(!fs::exists(Path(name)) || fs::is_empty(Path(name))) << name;
  }
}

TEST_F(ExportVerbs, TheEndingOfAFileSaysItsFormatOrIsRefused) {
  for (const auto& [verb, option, name] : {std::tuple{"export", "--gltf", "a.gltf"},
                                           {"export", "--ply", "a.obj"},
                                           {"export", "--graph-ply", "a"},
                                           {"export", "--spark", "a.txt"},
                                           {"export", "--sdf", "a.xml"},
                                           {"map", "--png", "a.jpg"}}) {
    const Outcome outcome = Ask({verb, option, Path(name)});
    EXPECT_EQ(outcome.code, 2) << option;
    EXPECT_NE(outcome.errors.find(" is written: "), std::string::npos) << outcome.errors;
    EXPECT_FALSE(fs::exists(Path(name)));
  }
  EXPECT_EQ(Ask({"map", "--png", Path("A.PNG"), "--width", "200"}).code, 0);
}

TEST_F(ExportVerbs, DrawsAPicture) {
  const Outcome outcome = Ask({"map", "--png", Path("a.png"), "--width", "640"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(outcome.out.find("wrote " + Path("a.png") + ": 640 columns, "), 0u) << outcome.out;
  const std::string png = ReadFile(Path("a.png"));
  EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(png.substr(16, 4), std::string("\0\0\x02\x80", 4));
  // The mesh of the map twice, side by side, as wide together as asked for.
  const Outcome meshes = Ask({"map", "--png", Path("m.png"), "--width", "640", "--mesh", "--beside",
                              "example", "--at", "+5s"});
  ASSERT_EQ(meshes.code, 0) << meshes.errors;
  EXPECT_EQ(meshes.out.find("wrote " + Path("m.png") + ": 640 columns, "), 0u) << meshes.out;
  // A height without a floor is no picture.
  const Outcome nothing = Ask({"map", "--png", Path("b.png"), "--width", "640", "--floor", "40"});
  EXPECT_EQ(nothing.code, 2);
  EXPECT_NE(nothing.errors.find("--floor 40: the map has nothing between"), std::string::npos)
      << nothing.errors;
}

}  // namespace
}  // namespace dsg::cli
