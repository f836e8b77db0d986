// SPDX-License-Identifier: Apache-2.0
// Faces of bodies: sound ones come through, odd ones are refused with the face that is wrong.
#include "ingest/log/body_topology.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "tests/unit/ingest/log/detection_lines.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

absl::StatusOr<std::shared_ptr<const Topology>> Parse(const std::string& text) {
  return ParseBodyTopology("topology.json", text);
}

std::string Json(const std::string& count, const std::string& faces) {
  return absl::StrCat("{\"vertex_count\":", count, ",\"faces\":", faces, "}");
}

void ExpectNoTopology(const std::string& text, const std::string& why) {
  ExpectMalformedFile(Parse(text).status(), {"topology.json", why});
}

TEST(BodyTopology, ReadsCountAndFaces) {
  const auto topology = Parse(Json("4", "[[0,2,1],[0,1,3]]"));
  ASSERT_TRUE(topology.ok()) << topology.status();
  EXPECT_EQ((*topology)->vertex_count, 4U);
  const std::vector<std::array<uint32_t, 3>> faces = {{0, 2, 1}, {0, 1, 3}};
  EXPECT_EQ((*topology)->faces, faces);
  EXPECT_TRUE(FitsTopology(topology->get(), std::vector<float>(12, 0.5F)));
  EXPECT_FALSE(FitsTopology(topology->get(), std::vector<float>(15, 0.5F)));
  EXPECT_FALSE(FitsTopology(topology->get(), {}));
  EXPECT_FALSE(FitsTopology(nullptr, std::vector<float>(12, 0.5F)));
}

TEST(BodyTopology, RefusesWhatIsNoMeshAndNamesTheFace) {
  ExpectNoTopology("", "JSON");
  ExpectNoTopology("[1]", "JSON");
  ExpectNoTopology("{\"vertex_count\":4", "JSON");
  ExpectNoTopology("{}", "vertex_count");
  for (const char* count : {"0", "-4", "4.5", "20001", "null", "\"4\"", "1e99"}) {
    ExpectNoTopology(Json(count, "[[0,1,2]]"), "vertex_count");
  }
  for (const char* faces : {"[]", "7", "null", "{}"}) ExpectNoTopology(Json("4", faces), "faces");
  ExpectNoTopology(Json("4", "[[0,1,2],[0,1,4]]"), "face 1 is [0,1,4]; vertices are counted");
  ExpectNoTopology(Json("4", "[[0,1,-1]]"), "face 0 is [0,1,-1]");
  ExpectNoTopology(Json("4", "[[0,1,1.5]]"), "face 0");
  ExpectNoTopology(Json("4", "[[0,1,null]]"), "face 0");
  ExpectNoTopology(Json("4", "[[0,1]]"), "three vertices");
  ExpectNoTopology(Json("4", "[[0,1,2,3]]"), "three vertices");
  ExpectNoTopology(Json("4", "[[0,1,[2]]]"), "face 0");
  ExpectNoTopology(Json("4", "[0,1,2]"), "three vertices");
  ExpectNoTopology(Json("4", "[[0,1,1]]"), "three different");
  ExpectNoTopology(Json("3", Repeated("[0,1,2]", 80'001)), "faces");
  ExpectNoTopology(std::string((size_t{4} << 20) + 1, ' '), "bytes");
  ExpectNoTopology(absl::StrCat("{\"faces\":", std::string(100'000, '[')), "topology.json");
}

TEST(BodyTopology, RefusesBodiesThatDoNotFitInStrictLogsOnly) {
  const auto topology = *Parse(Json("4", "[[0,1,2]]"));
  const std::string file = "data.jsonl";
  const LinePosition at{file, 7};
  HumanDetection detection;
  EXPECT_TRUE(CheckBody(at, topology.get(), /*is_strict=*/true, detection).ok());
  detection.vertices_root.assign(12, 0.5F);
  EXPECT_TRUE(CheckBody(at, topology.get(), /*is_strict=*/true, detection).ok());
  detection.vertices_root.assign(15, 0.5F);
  EXPECT_TRUE(CheckBody(at, topology.get(), /*is_strict=*/false, detection).ok());
  EXPECT_TRUE(CheckBody(at, nullptr, /*is_strict=*/true, detection).ok());
  ExpectMalformedFile(CheckBody(at, topology.get(), /*is_strict=*/true, detection),
                      {"data.jsonl:7", "5 vertices", "of 4"});
}

}  // namespace
}  // namespace dsg::ingest
