// SPDX-License-Identifier: Apache-2.0
// Cubes cut by the table fit together whatever their corners are, and show their fronts outwards.
#include "ingest/volume/cube_table.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <map>
#include <tuple>

#include "schema/base/random.h"

namespace dsg::ingest {
namespace {

Eigen::Vector3d MiddleOf(const CubeEdge& edge) {
  Eigen::Vector3d at(edge.low & 1, edge.low >> 1 & 1, edge.low >> 2);
  at[edge.axis] += 0.5;
  return at;
}

TEST(CubeTable, CutsEveryCrossedEdgeAndNoOther) {
  const CubeTable& table = CubeTable::Get();
  for (int inside = 0; inside < 256; ++inside) {
    int used = 0;
    for (const auto& triangle : table.Triangles(inside)) {
      for (const uint8_t edge : triangle) used |= 1 << edge;
    }
    EXPECT_EQ(used, table.CrossedEdges(inside)) << "case " << inside;
    EXPECT_LE(table.Triangles(inside).size(), 5u) << "case " << inside;
  }
}

TEST(CubeTable, TurnsTheFrontToTheFreeCorner) {
  const CubeTable& table = CubeTable::Get();
  for (int corner = 0; corner < 8; ++corner) {
    const auto& triangles = table.Triangles(255 & ~(1 << corner));
    ASSERT_EQ(triangles.size(), 1u);
    const Eigen::Vector3d a = MiddleOf(table.edges()[triangles[0][0]]);
    const Eigen::Vector3d b = MiddleOf(table.edges()[triangles[0][1]]);
    const Eigen::Vector3d c = MiddleOf(table.edges()[triangles[0][2]]);
    const Eigen::Vector3d free(corner & 1, corner >> 1 & 1, corner >> 2);
    EXPECT_GT((b - a).cross(c - a).dot(free - a), 0.0) << "corner " << corner;
  }
}

// Random corners make every ambiguous pair of neighbours; free ones all around close the surface.
TEST(CubeTable, MakesClosedSurfacesOfRandomCorners) {
  constexpr int kSide = 14;
  const CubeTable& table = CubeTable::Get();
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed, 0);
    const double share = random.Uniform(0.2, 0.8);
    std::vector<bool> solid(kSide * kSide * kSide, false);
    const auto at = [](int x, int y, int z) { return (z * kSide + y) * kSide + x; };
    int solid_count = 0;
    for (int z = 1; z < kSide - 1; ++z) {
      for (int y = 1; y < kSide - 1; ++y) {
        for (int x = 1; x < kSide - 1; ++x) {
          solid[at(x, y, z)] = random.Chance(share);
          solid_count += solid[at(x, y, z)] ? 1 : 0;
        }
      }
    }
    std::map<std::pair<int, int>, int> uses;
    double volume = 0.0;
    for (int z = 0; z < kSide - 1; ++z) {
      for (int y = 0; y < kSide - 1; ++y) {
        for (int x = 0; x < kSide - 1; ++x) {
          int inside = 0;
          for (int i = 0; i < 8; ++i) {
            inside |= (solid[at(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2))] ? 1 : 0) << i;
          }
          for (const auto& triangle : table.Triangles(inside)) {
            int key[3];
            Eigen::Vector3d p[3];
            for (int i = 0; i < 3; ++i) {
              const CubeEdge& edge = table.edges()[triangle[i]];
              key[i] = 3 * at(x + (edge.low & 1), y + (edge.low >> 1 & 1), z + (edge.low >> 2)) +
                       edge.axis;
              p[i] = MiddleOf(edge) + Eigen::Vector3d(x, y, z);
            }
            for (int i = 0; i < 3; ++i) ++uses[{key[i], key[(i + 1) % 3]}];
            volume += p[0].dot(p[1].cross(p[2])) / 6.0;
          }
        }
      }
    }
    for (const auto& [edge, count] : uses) {
      ASSERT_EQ(count, 1) << "an edge is used twice in one direction";
      ASSERT_TRUE(uses.count({edge.second, edge.first})) << "a border";
    }
    EXPECT_GT(volume, 0.1 * solid_count);
  }
}

}  // namespace
}  // namespace dsg::ingest
