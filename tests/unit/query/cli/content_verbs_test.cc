// SPDX-License-Identifier: Apache-2.0
// The verbs asset and factors on a store on disk: what is printed, written and refused.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "query/cli/run.h"
#include "schema/codec/checksum.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

using Json = nlohmann::json;
using test::Arguments;
using test::Outcome;
using test::ReadFile;

constexpr char kContent[] = "ply\nformat ascii 1.0\n";

class ContentVerbs : public testing::Test {
 protected:
  void SetUp() override {
    const auto store = GraphStore::Open(store_, {.create = true});
    ASSERT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = "example";
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
    GraphDelta delta;
    delta.map = "example";
    delta.session_id = "test";
    delta.sequence = 1;
    Node robot;
    robot.id = NodeId('r', 0);
    robot.kind = kinds::kRobot;
    robot.layer = layers::kAgents;
    robot.name = "body";
    delta.nodes = {robot};
    delta.assets = {{ComputeSha256(kContent), "model/ply", kContent}};
    PoseFactor odometry;
    odometry.type = "odometry";
    odometry.to_ns = kNsPerSecond;
    odometry.relative_pose.position = Eigen::Vector3d(0.5, 0.0, 0.0);
    odometry.information = Covariance6{};
    PoseFactor loop = odometry;
    loop.type = "loop_closure";
    loop.from_ns = 2 * kNsPerSecond;
    loop.to_ns = 9 * kNsPerSecond;
    loop.information.reset();
    delta.factors = {{robot.id, {odometry, loop}}};
    const auto writer = (*store)->OpenWriter("example");
    ASSERT_TRUE(writer.ok()) << writer.status();
    const auto committed = (*writer)->Commit(std::move(delta));
    ASSERT_TRUE(committed.ok()) << committed.status();
  }

  Outcome Dsg(Arguments arguments) const {
    arguments.insert(arguments.end(), {"--store", store_});
    return test::RunDsg(arguments);
  }

  test::TempFolder folder_;
  const std::string store_ = folder_.path() + "/store";
  const std::string sha256_ = ToHex(ComputeSha256(kContent));
};

TEST_F(ContentVerbs, FactorsAreListed) {
  const Outcome all = Dsg({"factors", "body"});
  ASSERT_EQ(all.code, 0) << all.errors;
  EXPECT_EQ(all.out,
            "from   to  type          of    x m    y m    z m  yaw deg  information\n"
            " +0s  +1s  odometry      r0  0.500  0.000  0.000      0.0  6x6\n"
            " +2s  +9s  loop_closure  r0  0.500  0.000  0.000      0.0  none\n"
            "2 factors of r0 (revision 1)\n");
  EXPECT_NE(Dsg({"factors", "r0", "--from", "+1s"}).out.find("1 factor of"), std::string::npos);
  EXPECT_NE(Dsg({"factors", "r0", "--to", "+2s"}).out.find("odometry"), std::string::npos);
  EXPECT_NE(Dsg({"factors", "r0", "--limit", "1"}).out.find("1 factor of"), std::string::npos);
}

TEST_F(ContentVerbs, FactorsAreGivenAsJson) {
  const Outcome outcome = Dsg({"factors", "body", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  const Json reply = Json::parse(outcome.out);
  EXPECT_EQ(reply["agent_id"], "r0");
  ASSERT_EQ(reply["factors"].size(), 2u);
  EXPECT_EQ(reply["factors"][0]["information"].size(), 21u);
  EXPECT_EQ(reply["factors"][1]["to_time_ns"], "9000000000");
}

TEST_F(ContentVerbs, FactorsOfNobodyAreNotFound) {
  const Outcome outcome = Dsg({"factors", "nobody"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.errors.find("AGENT_UNKNOWN"), std::string::npos) << outcome.errors;
  EXPECT_EQ(Dsg({"factors", "r0", "--from", "+3s", "--to", "+1s"}).code, 2);
  EXPECT_EQ(Dsg({"factors"}).code, 2);
}

TEST_F(ContentVerbs, AnAssetIsDescribed) {
  const Outcome outcome = Dsg({"asset", sha256_});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(outcome.out, sha256_ + ": model/ply, 21 bytes (revision 1)\n");
  const Json reply = Json::parse(Dsg({"asset", sha256_, "--json"}).out);
  EXPECT_EQ(reply["media_type"], "model/ply");
  EXPECT_EQ(reply["size_bytes"], "21");
}

TEST_F(ContentVerbs, AnAssetIsWrittenWhole) {
  const std::string path = folder_.path() + "/couch.ply";
  const Outcome outcome = Dsg({"asset", sha256_, "--out", path});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_NE(outcome.out.find(path), std::string::npos) << outcome.out;
  EXPECT_EQ(ReadFile(path), kContent);
  EXPECT_EQ(Dsg({"asset", sha256_, "--out", path}).code, 2);
  EXPECT_EQ(Dsg({"asset", sha256_, "--out", path, "--force"}).code, 0);
}

TEST_F(ContentVerbs, AnUnknownAssetIsNotFoundAndLeavesNoFile) {
  const std::string path = folder_.path() + "/none.ply";
  const Outcome outcome = Dsg({"asset", std::string(64, '0'), "--out", path});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.errors.find("ASSET_UNKNOWN"), std::string::npos) << outcome.errors;
  EXPECT_FALSE(std::ifstream(path).good());
  const Outcome malformed = Dsg({"asset", "couch"});
  EXPECT_EQ(malformed.code, 2);
  EXPECT_NE(malformed.errors.find("64 hexadecimal digits"), std::string::npos);
}

TEST_F(ContentVerbs, HelpShowsAnExample) {
  EXPECT_NE(Dsg({"factors", "--help"}).out.find("Example: dsg factors body"), std::string::npos);
}

}  // namespace
}  // namespace dsg::cli
