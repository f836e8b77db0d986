// SPDX-License-Identifier: Apache-2.0
#include "query/cli/triangle_file.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "schema/base/random.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

constexpr char kSquare[] =
    "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float "
    "y\n"
    "property float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\n"
    "end_header\n0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n4 0 1 2 3\n";

std::string BinaryTriangle() {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\n"
      "property double y\nproperty double z\nelement face 1\n"
      "property list uchar uint vertex_index\nend_header\n";
  for (const double value : {0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0}) {
    char raw[sizeof(value)];
    std::memcpy(raw, &value, sizeof(value));
    bytes.append(raw, sizeof(value));
  }
  bytes.push_back(3);
  for (const uint32_t index : {0u, 1u, 2u}) {
    char raw[sizeof(index)];
    std::memcpy(raw, &index, sizeof(index));
    bytes.append(raw, sizeof(index));
  }
  return bytes;
}

TEST(TriangleFile, CutsFacesOfFourIntoTwo) {
  const auto triangles = ParseTriangles(kSquare, "square.ply");
  ASSERT_TRUE(triangles.ok()) << triangles.status();
  EXPECT_EQ(triangles->vertices.size(), 4u);
  ASSERT_EQ(triangles->faces.size(), 2u);
  EXPECT_EQ(triangles->faces[1], (std::array<uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(triangles->vertices[2], Eigen::Vector3f(1.0f, 1.0f, 0.0f));
}

TEST(TriangleFile, ReadsBinary) {
  const auto triangles = ParseTriangles(BinaryTriangle(), "t.ply");
  ASSERT_TRUE(triangles.ok()) << triangles.status();
  EXPECT_EQ(triangles->vertices[2], Eigen::Vector3f(0.0f, 3.0f, 0.0f));
  EXPECT_EQ(triangles->faces.size(), 1u);
}

TEST(TriangleFile, RefusesWhatIsCutOffAnywhere) {
  for (const std::string& whole : {std::string(kSquare), BinaryTriangle()}) {
    for (size_t size = 0; size + 2 < whole.size(); ++size) {
      const auto triangles = ParseTriangles(whole.substr(0, size), "cut.ply");
      ASSERT_FALSE(triangles.ok()) << size;
      EXPECT_EQ(ReasonOf(triangles.status()), Reason::kFileMalformed);
    }
  }
}

TEST(TriangleFile, SurvivesDamage) {
  Random random(7, 1);
  for (int round = 0; round < 2000; ++round) {
    std::string bytes = round % 2 == 0 ? std::string(kSquare) : BinaryTriangle();
    for (int i = 0; i < 3; ++i) {
      bytes[static_cast<size_t>(random.Index(static_cast<int>(bytes.size())))] =
          static_cast<char>(random.Index(256));
    }
    const auto triangles = ParseTriangles(bytes, "damaged.ply");
    if (!triangles.ok()) continue;
    for (const auto& face : triangles->faces) {
      for (const uint32_t corner : face) EXPECT_LT(corner, triangles->vertices.size());
    }
  }
}

TEST(TriangleFile, SaysWhichFileIsMissing) {
  const auto triangles = ReadTriangles("/no/such/body.ply");
  EXPECT_TRUE(absl::IsNotFound(triangles.status()));
  EXPECT_NE(triangles.status().message().find("/no/such/body.ply"), absl::string_view::npos);
}

}  // namespace
}  // namespace dsg::cli
