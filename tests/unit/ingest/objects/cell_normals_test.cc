// SPDX-License-Identifier: Apache-2.0
// Normals of surfaces that came without any: which side they look to.
#include "ingest/objects/cell_normals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "ingest/objects/surface_cells.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3f;

constexpr double kCellM = 0.05;
constexpr float kSpacingM = 0.02f;

void AddFace(const Vector3f& corner, const Vector3f& u, const Vector3f& v, MeshBlock* mesh) {
  const int columns = static_cast<int>(std::ceil(u.norm() / kSpacingM));
  const int rows = static_cast<int>(std::ceil(v.norm() / kSpacingM));
  for (int i = 0; i <= columns; ++i) {
    for (int j = 0; j <= rows; ++j) {
      mesh->positions_map.push_back(corner +
                                    u * static_cast<float>(i) / static_cast<float>(columns) +
                                    v * static_cast<float>(j) / static_cast<float>(rows));
    }
  }
}

/// The top and the sides of a box.
void AddBox(const Vector3f& low, const Vector3f& size, MeshBlock* mesh) {
  const Vector3f x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z());
  AddFace(low + z, x, y, mesh);
  AddFace(low, x, z, mesh);
  AddFace(low + y, x, z, mesh);
  AddFace(low, y, z, mesh);
  AddFace(low + x, y, z, mesh);
}

CellGraph GraphOf(const MeshBlock& mesh) {
  return MakeCellGraph(GatherAllSurface({&mesh}, 1, kCellM), kCellM, 0.8);
}

// Cells in the middle of the faces of a box look away from it.
void ExpectOutwards(const CellGraph& graph, const Vector3f& low, const Vector3f& size) {
  const Vector3f middle = low + 0.5f * size;
  int count = 0;
  for (size_t i = 0; i < graph.size(); ++i) {
    const Vector3f away = graph.points_map[i] - middle;
    const Vector3f share = away.cwiseQuotient(0.5f * size);
    int axis = 0;
    const float most = share.cwiseAbs().maxCoeff(&axis);
    int others = 0;
    for (int other = 0; other < 3; ++other) {
      others += other != axis && std::abs(share[other]) < 0.6f ? 1 : 0;
    }
    if (std::abs(most - 1.0f) > 0.05f || others < 2) continue;
    ++count;
    EXPECT_GT(graph.normals_map[i][axis] * share[axis], 0.8f) << graph.points_map[i].transpose();
  }
  EXPECT_GE(count, 50);
}

TEST(CellNormals, AFloorSaysWhereThingsOnItLook) {
  MeshBlock mesh;
  // Nobody sees the floor below the box.
  AddFace({0, 0, 0}, {0.6f, 0, 0}, {0, 2, 0}, &mesh);
  AddFace({1.2f, 0, 0}, {0.8f, 0, 0}, {0, 2, 0}, &mesh);
  AddFace({0.6f, 0, 0}, {0.6f, 0, 0}, {0, 0.6f, 0}, &mesh);
  AddFace({0.6f, 1.3f, 0}, {0.6f, 0, 0}, {0, 0.7f, 0}, &mesh);
  AddBox({0.6f, 0.6f, 0}, {0.6f, 0.7f, 0.5f}, &mesh);
  CellGraph graph = GraphOf(mesh);
  ASSERT_FALSE(graph.is_oriented);
  std::vector<Vector3f> sides(graph.size(), Vector3f::Zero());
  for (size_t i = 0; i < graph.size(); ++i) {
    if (graph.points_map[i].x() < 0.3f) sides[i] = Vector3f::UnitZ();
  }
  OrientNormals(sides, &graph);
  EXPECT_TRUE(graph.is_oriented);
  ExpectOutwards(graph, {0.6f, 0.6f, 0}, {0.6f, 0.7f, 0.5f});
}

TEST(CellNormals, PiecesThatTouchNothingLookOutwards) {
  MeshBlock mesh;
  AddBox({0, 0, 0}, {0.6f, 0.7f, 0.5f}, &mesh);
  CellGraph graph = GraphOf(mesh);
  OrientNormals(std::vector<Vector3f>(graph.size(), Vector3f::Zero()), &graph);
  ExpectOutwards(graph, {0, 0, 0}, {0.6f, 0.7f, 0.5f});
}

TEST(CellNormals, AnEmptyGraphWillDo) {
  CellGraph graph;
  OrientNormals({}, &graph);
  EXPECT_TRUE(graph.is_oriented);
}

}  // namespace
}  // namespace dsg::ingest
