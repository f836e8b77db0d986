// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/shapes/mesh_file.h"

#include <gtest/gtest.h>

#include <cstring>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/base/random.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr char kAsciiPly[] =
    "ply\r\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\n"
    "property float y\nproperty float z\nproperty uchar red\nelement camera 1\n"
    "property list uchar float view\nelement face 2\nproperty uchar flags\n"
    "property list uchar int vertex_indices\nend_header\n"
    "0 0 0 255\n1 0 0 255\n1 1e0 0 255\n0 +1 0.5 255\n"
    "2 0.5 0.25\n"
    "7 3 0 1 2\n7 4 0 1 2 3\n";

TriangleSoup Square() {
  TriangleSoup mesh;
  mesh.vertices = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {1.0, 1.0, 0.25}, {0.0, 1.0, 0.5}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

void ExpectError(const absl::StatusOr<TriangleSoup>& mesh, const std::string& part) {
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(ReasonOf(mesh.status()), Reason::kFileMalformed);
  EXPECT_TRUE(absl::StrContains(std::string(mesh.status().message()), part)) << mesh.status();
  EXPECT_TRUE(absl::StartsWith(std::string(mesh.status().message()), "a.cad:")) << mesh.status();
}

TEST(MeshFile, ReadsPlyTextWithPolygonsAndForeignProperties) {
  const auto mesh = ReadPly(kAsciiPly, "a.cad");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->vertices.size(), 4u);
  EXPECT_EQ(mesh->vertices[3], Eigen::Vector3d(0.0, 1.0, 0.5));
  const std::vector<std::array<uint32_t, 3>> faces = {{0, 1, 2}, {0, 1, 2}, {0, 2, 3}};
  EXPECT_EQ(mesh->faces, faces);
}

TEST(MeshFile, ReadsTheBinaryPlyItWrites) {
  const TriangleSoup square = Square();
  const std::string bytes = WritePly(square);
  EXPECT_EQ(bytes, WritePly(square));
  const auto mesh = ReadPly(bytes, "a.cad");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices, square.vertices);
  EXPECT_EQ(mesh->faces, square.faces);
}

TEST(MeshFile, ReadsBinaryPlyOfDoublesAndForeignTypes) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double z\n"
      "property int16 id\nproperty double y\nproperty double x\nelement face 1\n"
      "property list uint16 uint32 vertex_index\nend_header\n";
  const auto append = [&bytes](auto value) {
    char raw[sizeof(value)];
    std::memcpy(raw, &value, sizeof(value));
    bytes.append(raw, sizeof(value));
  };
  for (int i = 0; i < 3; ++i) {
    append(3.0 * i);
    append(int16_t{-5});
    append(2.0 * i);
    append(1.0 * i);
  }
  append(uint16_t{3});
  for (const uint32_t corner : {2u, 1u, 0u}) append(corner);
  const auto mesh = ReadPly(bytes, "a.cad");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices[2], Eigen::Vector3d(2.0, 4.0, 6.0));
  EXPECT_EQ(mesh->faces[0], (std::array<uint32_t, 3>{2, 1, 0}));
}

TEST(MeshFile, ReadsObjCornersOfEveryForm) {
  const auto mesh = ReadObj(
      "# a comment\nmtllib x.mtl\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\r\nvn 0 0 1\nvt 0 0\n"
      "\tv 1 1 0\nv 0 1 0\nusemtl red\nf 1/1/1 2//1 3/1\nf -4 -2 -1\nf 1 2 3 4",
      "a.cad");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices.size(), 4u);
  const std::vector<std::array<uint32_t, 3>> faces = {{0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {0, 2, 3}};
  EXPECT_EQ(mesh->faces, faces);
}

TEST(MeshFile, SaysInWhichLineAnObjIsWrong) {
  ExpectError(ReadObj("v 0 0\n", "a.cad"), "a.cad:1: coordinate 3 of vertex 1 is \"\"");
  ExpectError(ReadObj("v 0 0 0\nv 0 nan 0\n", "a.cad"), "a.cad:2: coordinate 2");
  ExpectError(ReadObj("v 0 0 1e999\n", "a.cad"), "a.cad:1:");
  ExpectError(ReadObj("v 0 0 0\n\nf 1 2 3\n", "a.cad"), "a.cad:3: corner 2 of a face, after 1");
  ExpectError(ReadObj("v 0 0 0\nf 0 1 1\n", "a.cad"), "corner 0");
  ExpectError(ReadObj("v 0 0 0\nf -2 1 1\n", "a.cad"), "corner -2");
  ExpectError(ReadObj("v 0 0 0\nf -9223372036854775808 1 1\n", "a.cad"), "corner -9223372036854");
  ExpectError(ReadObj("v 0 0 0\nf 99999999999999999999 1 1\n", "a.cad"), "is no vertex number");
  ExpectError(ReadObj("v 0 0 0\nf 1 1\n", "a.cad"), "2 corners");
}

std::string Ply(const std::string& header, const std::string& body) {
  return absl::StrCat("ply\nformat ascii 1.0\n", header, "end_header\n", body);
}

TEST(MeshFile, SaysWhereAPlyIsWrong) {
  const std::string vertex = "property float x\nproperty float y\nproperty float z\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string two = absl::StrCat("element vertex 2\n", vertex, face);
  ExpectError(ReadPly("", "a.cad"), "does not begin with \"ply\"");
  ExpectError(ReadPly("solid stl\n", "a.cad"), "does not begin with \"ply\"");
  ExpectError(ReadPly("ply\nelement vertex 3\n", "a.cad"), "the header does not end");
  ExpectError(ReadPly("ply\nformat binary_big_endian 1.0\n", "a.cad"), "a.cad:2: format");
  ExpectError(ReadPly("ply\nend_header\n", "a.cad"), "no format statement");
  ExpectError(ReadPly(Ply("element vertex -1\n", ""), "a.cad"), "a.cad:3: element \"vertex\"");
  ExpectError(ReadPly(Ply("element vertex 9999999999\n", ""), "a.cad"), "more than 6000000");
  ExpectError(ReadPly(Ply("element vertex 99999999999999999999\n", ""), "a.cad"), "has count");
  ExpectError(ReadPly(Ply("property float x\n", ""), "a.cad"), "before the first element");
  ExpectError(ReadPly(Ply("element vertex 1\nproperty real x\n", ""), "a.cad"), "\"real\"");
  ExpectError(ReadPly(Ply("element vertex 1\nproperty float x\n", "0\n"), "a.cad"),
              "no x, y and z");
  ExpectError(ReadPly(Ply(two, "0 0 0\n0 0\n"), "a.cad"), "a.cad:12: the file ends");
  ExpectError(ReadPly(Ply(two, "0 0 0\n0 nan 0\n3 0 1 1\n"), "a.cad"), "a.cad:11: \"nan\"");
  ExpectError(ReadPly(Ply(two, "0 0 0\n0 0 0\n3 0 1 2\n"), "a.cad"), "face 0 has vertex 2 of 2");
  ExpectError(ReadPly(Ply(two, "0 0 0\n0 0 0\n3 0 1 -1\n"), "a.cad"), "face 0 has vertex -1");
  ExpectError(ReadPly(Ply(two, "0 0 0\n0 0 0\n3 0 1 0.5\n"), "a.cad"), "is no integer");
  ExpectError(ReadPly(Ply(two, "0 0 0\n0 0 0\n2 0 1\n"), "a.cad"), "face 0 has 2 corners");
  ExpectError(ReadPly(Ply(two, "0 0 0\n0 0 0\n3 0 1 1\n7\n"), "a.cad"), "there is more");
  ExpectError(ReadPly(Ply(two, "0 0 0\n0 0 0\n4000000000 0 1 1\n"), "a.cad"), "a list of");
}

TEST(MeshFile, NamesTheByteWhereABinaryPlyWasCut) {
  const std::string bytes = WritePly(Square());
  ExpectError(ReadPly(bytes.substr(0, bytes.size() - 1), "a.cad"), "ends at byte");
  std::string with_nan = bytes;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(with_nan.data() + with_nan.find("end_header\n") + 11, &nan, sizeof(nan));
  ExpectError(ReadPly(with_nan, "a.cad"), "vertex 0");
}

TEST(MeshFile, RefusesABinaryPlyCutAtAnyByte) {
  const std::string bytes = WritePly(Square());
  for (size_t size = 0; size < bytes.size(); ++size) {
    ExpectError(ReadPly(bytes.substr(0, size), "a.cad"), "");
  }
}

TEST(MeshFile, SurvivesATextCutAtAnyByte) {
  const std::string ply = kAsciiPly;
  for (size_t size = 0; size < ply.size(); ++size) {
    const auto mesh = ReadPly(ply.substr(0, size), "a.cad");
    // Only the end of the last number and line can go unnoticed.
    EXPECT_EQ(mesh.ok(), size + 1 >= ply.size()) << size;
  }
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf -1 -2 -3\n";
  for (size_t size = 0; size < obj.size(); ++size) {
    (void)ReadObj(obj.substr(0, size), "a.cad");
  }
}

TEST(MeshFile, SurvivesChangedBytes) {
  Random random(1, 1);
  const std::string sources[] = {kAsciiPly, WritePly(Square()),
                                 "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf -1/2 -2//1 -3\n"};
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes = sources[i % 3];
    for (int k = random.Integer(1, 4); k > 0; --k) {
      bytes[static_cast<size_t>(random.Index(static_cast<int>(bytes.size())))] =
          static_cast<char>(random.Index(256));
    }
    for (const auto& mesh : {ReadPly(bytes, "a.cad"), ReadObj(bytes, "a.cad")}) {
      if (!mesh.ok()) continue;
      for (const auto& face : mesh->faces) {
        for (const uint32_t corner : face) ASSERT_LT(corner, mesh->vertices.size());
      }
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
