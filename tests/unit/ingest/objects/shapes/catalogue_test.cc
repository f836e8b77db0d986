// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "ingest/objects/shapes/cad_model.h"
#include "ingest/objects/shapes/mesh_file.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "tests/support/temp_folder.h"

namespace dsg::ingest {
namespace {

// A slanted triangle of 2 x 1 x 0.5 m whose floor face's middle is at the origin.
constexpr char kUprightObj[] = "v -1 -0.5 0\nv 1 0.5 0\nv 1 -0.5 0.5\nf 1 2 3\n";

class Catalogue : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& bytes) {
    std::ofstream(std::filesystem::path(folder_.path()) / name, std::ios::binary) << bytes;
  }
  absl::StatusOr<std::vector<CadModel>> Read() const { return ReadCatalogue(folder_.path()); }
  void ExpectError(const std::string& part) {
    const auto models = Read();
    ASSERT_FALSE(models.ok());
    EXPECT_EQ(models.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_TRUE(absl::StrContains(std::string(models.status().message()), part)) << models.status();
    EXPECT_TRUE(absl::StrContains(std::string(models.status().message()), folder_.path()));
  }
  test::TempFolder folder_;
};

TEST_F(Catalogue, NamesModelsAndClassesAfterTheFiles) {
  Write("coffee-table_2.obj", kUprightObj);
  Write("couch.PLY", WritePly({{{-1, -1, 0}, {1, 1, 0}, {1, -1, 1}}, {{0, 1, 2}}}));
  Write("readme.txt", "not a model");
  const auto models = Read();
  ASSERT_TRUE(models.ok()) << models.status();
  ASSERT_EQ(models->size(), 2u);
  EXPECT_EQ((*models)[0].name, "coffee-table_2");
  EXPECT_EQ((*models)[0].class_name, "coffee table");
  EXPECT_EQ((*models)[0].asset.media_type, "model/obj");
  EXPECT_EQ((*models)[1].name, "couch");
  EXPECT_EQ((*models)[1].class_name, "couch");
  EXPECT_EQ((*models)[1].asset.media_type, "model/ply");
}

TEST_F(Catalogue, KeepsTheBytesOfAFileThatIsInTheRightFrame) {
  Write("couch.obj", kUprightObj);
  const auto models = Read();
  ASSERT_TRUE(models.ok()) << models.status();
  const Asset& asset = models->front().asset;
  EXPECT_EQ(asset.content, kUprightObj);
  EXPECT_EQ(asset.sha256, ComputeSha256(kUprightObj));
}

TEST_F(Catalogue, TurnsScalesAndMovesAsTheJsonSays) {
  // In centimetres, y up, off the origin.
  Write("x.obj", "v 0 10 0\nv 200 10 -100\nv 200 60 0\nf 1 2 3\n");
  Write("catalogue.json",
        R"({"models": [{"file": "x.obj", "class": "couch", "up": "y", "scale": 0.01}]})");
  const auto models = Read();
  ASSERT_TRUE(models.ok()) << models.status();
  const CadModel& model = models->front();
  EXPECT_EQ(model.class_name, "couch");
  const Eigen::Vector3d wanted[] = {{-1.0, -0.5, 0.0}, {1.0, 0.5, 0.0}, {1.0, -0.5, 0.5}};
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_LT((model.vertices[i] - wanted[i]).norm(), 1e-6) << i;
  }
}

TEST_F(Catalogue, StoresWhatItMovedInTheFrameOfThePose) {
  Write("x.obj", "v 3 0 7\nv 5 1 7\nv 5 0 7.5\nf 1 2 3\n");
  const auto models = Read();
  ASSERT_TRUE(models.ok()) << models.status();
  const CadModel& model = models->front();
  EXPECT_EQ(model.asset.media_type, "model/ply");
  EXPECT_EQ(model.asset.sha256, ComputeSha256(model.asset.content));
  const auto stored = ReadPly(model.asset.content, "asset");
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->vertices, model.vertices);
  EXPECT_EQ(stored->faces, model.faces);
}

TEST_F(Catalogue, RefusesWhatIsNoModel) {
  ExpectError("holds no .ply or .obj");
  Write("couch.obj", "");
  ExpectError("couch.obj: is empty");
  Write("couch.obj", "Dear reader,\nvery truly yours\n");
  ExpectError("couch.obj: has no faces");
  Write("couch.obj", "v 0 0 0\nv 0 0 1\nv 0 0 2\nf 1 2 3\n");
  ExpectError("without area");
  Write("couch.obj", "v 0 0 0\nv 900 0 0\nv 0 900 0\nf 1 2 3\n");
  ExpectError("is 900 m long");
  Write("couch.obj", "v 0 0 0\nv 1e308 0 0\nv -1e308 9e307 0\nf 1 2 3\n");
  ExpectError("m long");
  Write("couch.obj", "v 0 0 0\nv 0.001 0 0\nv 0 0.001 0\nf 1 2 3\n");
  ExpectError("set \"scale\"");
}

TEST_F(Catalogue, RefusesAFileOfMoreThan64MiB) {
  Write("couch.ply", "ply");
  std::filesystem::resize_file(std::filesystem::path(folder_.path()) / "couch.ply",
                               (uintmax_t{64} << 20) + 1);
  ExpectError("more than 67108864");
}

TEST_F(Catalogue, RefusesAJsonThatDoesNotFitTheFolder) {
  Write("couch.obj", kUprightObj);
  Write("catalogue.json", "{\"models\": [");
  ExpectError("is no JSON");
  Write("catalogue.json", "[]");
  ExpectError("no list \"models\"");
  Write("catalogue.json", R"({"models": [5]})");
  ExpectError("models[0]: is no object");
  Write("catalogue.json", R"({"models": [{"class": "couch"}]})");
  ExpectError("has no \"file\"");
  Write("catalogue.json", R"({"models": [{"file": "sofa.obj"}]})");
  ExpectError("\"sofa.obj\", which the folder does not hold");
  Write("catalogue.json", R"({"models": [{"file": "couch.obj", "up": "w"}]})");
  ExpectError("\"up\" is");
  Write("catalogue.json", R"({"models": [{"file": "couch.obj", "scale": -1}]})");
  ExpectError("\"scale\" is");
  Write("catalogue.json", R"({"models": [{"file": "couch.obj", "sacle": 1}]})");
  ExpectError("\"sacle\" is");
  Write("catalogue.json", R"({"models": [{"file": "couch.obj"}, {"file": "couch.obj"}]})");
  ExpectError("listed twice");
}

TEST_F(Catalogue, SaysWhenThereIsNoFolder) {
  const auto models = ReadCatalogue(folder_.path() + "/nowhere");
  EXPECT_EQ(models.status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace dsg::ingest
