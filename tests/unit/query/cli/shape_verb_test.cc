// SPDX-License-Identifier: Apache-2.0
// The verb shape on a store on disk: what is listed, written, refused and told.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "query/cli/run.h"
#include "schema/codec/checksum.h"
#include "schema/codec/topology.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::Arguments;
using test::Outcome;
using test::ReadFile;

constexpr NodeId kAnn('H', 12);

// A tetrahedron with hands, a second apart.
BodyShape BodyAt(TimeNs time_ns) {
  BodyShape body;
  body.time_ns = time_ns;
  body.pose_coefficients.assign(72, 0.25f);
  body.shape_coefficients.assign(10, 0.5f);
  body.joints.assign(72, 0.0f);
  body.joints[3 * 22] = 0.5f;
  body.joints[3 * 23 + 1] = -0.25f;
  body.vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  return body;
}

class ShapeVerbs : public testing::Test {
 protected:
  void SetUp() override {
    const auto store = GraphStore::Open(store_, {.create = true});
    ASSERT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = "example";
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
    const auto writer = (*store)->OpenWriter("example");
    ASSERT_TRUE(writer.ok()) << writer.status();
    const auto committed = (*writer)->Commit(Bodies());
    ASSERT_TRUE(committed.ok()) << committed.status();
  }

  // Human 12 stands at x = 10 m, turned by 90 degrees; poses from 0 s to 2 s, bodies to 3 s.
  static GraphDelta Bodies() {
    GraphDelta delta;
    delta.map = "example";
    delta.session_id = "test";
    delta.sequence = 1;
    Node human;
    human.id = kAnn;
    human.kind = kinds::kHuman;
    human.layer = layers::kAgents;
    human.name = "ann";
    delta.nodes = {human};
    const std::string faces = EncodeTopology({4, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}});
    delta.assets = {{ComputeSha256(faces), kTopologyMediaType, faces}};
    delta.shapes = {{kAnn, delta.assets[0].sha256, {}}};
    delta.appends = {{kAnn, {}}};
    for (int second = 0; second <= 3; ++second) {
      TimedPose pose;
      pose.time_ns = second * kNsPerSecond;
      pose.map_T_agent.position = Eigen::Vector3d(10.0, 0.0, 0.0);
      pose.map_T_agent.orientation =
          Eigen::AngleAxisd(1.5707963267948966, Eigen::Vector3d::UnitZ());
      if (second < 3) delta.appends[0].poses.push_back(pose);
      delta.shapes[0].shapes.push_back(BodyAt(pose.time_ns));
    }
    return delta;
  }

  Outcome Dsg(Arguments arguments) const {
    arguments.insert(arguments.begin(), "shape");
    arguments.insert(arguments.end(), {"--store", store_});
    return test::RunDsg(arguments);
  }

  test::TempFolder folder_;
  const std::string store_ = folder_.path() + "/store";
};

TEST_F(ShapeVerbs, ListWhatIsStoredAndWhereTheHandsAre) {
  const Outcome outcome = Dsg({"ann", "--from", "+1s", "--to", "+4s"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(outcome.out,
            "time  pose  shape  joints  vertices  left hand m      right hand m\n"
            " +1s    72     10      24         4  10.00 0.50 0.00  10.25 0.00 0.00\n"
            " +2s    72     10      24         4  10.00 0.50 0.00  10.25 0.00 0.00\n"
            " +3s    72     10      24         4  -                -\n"
            "3 body shapes of H12 (revision 1)\n");
}

TEST_F(ShapeVerbs, GiveTheReplyAsJsonWithoutVertices) {
  const Outcome outcome = Dsg({"H12", "--json", "--limit", "2"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const Json reply = Json::parse(outcome.out);
  EXPECT_EQ(reply["agent_id"], "H12");
  EXPECT_EQ(reply["header"]["read_revision"], "1");
  ASSERT_EQ(reply["shapes"].size(), 2u);
  EXPECT_EQ(reply["shapes"][1]["shape"]["time_ns"], "1000000000");
  EXPECT_EQ(reply["shapes"][1]["shape"]["joints"].size(), 72u);
  EXPECT_EQ(reply["shapes"][1]["shape"]["vertices"].size(), 0u);
  EXPECT_EQ(reply["shapes"][1]["vertex_count"], 4);
}

TEST_F(ShapeVerbs, WriteTheFirstBodyAsPlyInTheFrameOfTheMap) {
  const std::string path = folder_.path() + "/body.ply";
  const Outcome outcome = Dsg({"ann", "--from", "+1s", "--ply", path});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const std::string ply = ReadFile(path);
  EXPECT_EQ(outcome.out, "wrote " + path + ": 4 vertices, 4 faces, " + std::to_string(ply.size()) +
                             " bytes (revision 1)\n");
  EXPECT_NE(ply.find("element vertex 4\n"), std::string::npos);
  EXPECT_NE(ply.find("comment agent H12 at +1s, revision 1"), std::string::npos);
  const size_t body = ply.find("end_header\n") + 11;
  ASSERT_EQ(ply.size() - body, 4u * 12 + 4u * 13);
  float second[3];
  std::memcpy(second, ply.data() + body + 12, sizeof(second));
  EXPECT_NEAR(second[0], 10.0f, 1e-3f);
  EXPECT_NEAR(second[1], 1.0f, 1e-3f);
}

TEST_F(ShapeVerbs, ShowTheBodyNearestToAnInstant) {
  const std::string folder = folder_.path() + "/bodies";
  for (const char* at : {"+0.6s", "+1.4s", "+1.5s"}) {
    const Outcome outcome = Dsg({"ann", "--at", at, "--obj", folder, "--force", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.errors;
    const Json files = Json::parse(outcome.out)["files"];
    ASSERT_EQ(files.size(), 1u);
    EXPECT_EQ(files[0]["path"], folder + "/H12_1000000000.obj") << at;
  }
  const Outcome list = Dsg({"ann", "--at", "+0.2s"});
  ASSERT_EQ(list.code, 0) << list.errors;
  EXPECT_NE(list.out.find("1 body shape of H12"), std::string::npos) << list.out;
  const Outcome late = Dsg({"ann", "--at", "+9s", "--obj", folder});
  EXPECT_EQ(late.code, 1);
  EXPECT_NE(late.errors.find("within 1 s of --at +9s"), std::string::npos) << late.errors;
  EXPECT_EQ(Dsg({"ann", "--at", "+1s", "--from", "+0s"}).code, 2);
}

TEST_F(ShapeVerbs, DrawBodiesAndSkeletons) {
  const std::string path = folder_.path() + "/bodies.png";
  const Outcome outcome = Dsg({"ann", "--png", path, "--width", "300", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const Json file = Json::parse(outcome.out)["files"][0];
  EXPECT_EQ(file["bodies"], "3");
  EXPECT_EQ(file["columns"], "300");
  EXPECT_EQ(ReadFile(path).substr(1, 3), "PNG");
  EXPECT_EQ(Dsg({"ann", "--png", path}).code, 2) << "replaced without --force";
  EXPECT_EQ(Dsg({"ann", "--png", path, "--ply", path, "--force"}).code, 2);
  EXPECT_EQ(Dsg({"ann", "--from", "+3s", "--png", path, "--force"}).code, 1) << "has no pose";
}

TEST_F(ShapeVerbs, WriteAnObjABodyThatHasAPose) {
  const std::string folder = folder_.path() + "/bodies";
  const Outcome outcome = Dsg({"ann", "--obj", folder, "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(Json::parse(outcome.out)["files"].size(), 3u);
  const std::string obj = ReadFile(folder + "/H12_2000000000.obj");
  EXPECT_NE(obj.find("\nv 10.0000 1.0000 0.0000\n"), std::string::npos) << obj;
  EXPECT_NE(obj.find("\nf 1 3 2\n"), std::string::npos) << obj;
  EXPECT_FALSE(fs::exists(folder + "/H12_3000000000.obj"));
}

TEST_F(ShapeVerbs, RefuseToReplaceFilesUnlessTold) {
  const std::string path = folder_.path() + "/body.ply";
  std::ofstream(path) << "mine";
  EXPECT_EQ(Dsg({"ann", "--ply", path}).code, 2);
  EXPECT_EQ(ReadFile(path), "mine");
  EXPECT_EQ(Dsg({"ann", "--ply", path, "--force"}).code, 0);
  EXPECT_NE(ReadFile(path), "mine");
}

TEST_F(ShapeVerbs, SayWhenThereIsNoBodyToWrite) {
  const std::string path = folder_.path() + "/body.ply";
  const Outcome outcome = Dsg({"ann", "--from", "+3s", "--ply", path});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.errors.find("agent H12 has no body"), std::string::npos) << outcome.errors;
  EXPECT_FALSE(fs::exists(path));
  EXPECT_EQ(Dsg({"nobody"}).code, 1);
  EXPECT_EQ(Dsg({"ann", "--ply", path, "--obj", folder_.path()}).code, 2);
}

}  // namespace
}  // namespace dsg::cli
