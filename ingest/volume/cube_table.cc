// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/cube_table.h"

#include <optional>

#include "schema/base/check.h"

namespace dsg::ingest {
namespace {

using Loop = std::vector<int>;
using TriangleList = std::vector<std::array<uint8_t, 3>>;

std::array<CubeEdge, 12> MakeEdges() {
  std::array<CubeEdge, 12> edges;
  int count = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int corner = 0; corner < 8; ++corner) {
      if ((corner >> axis & 1) == 0) edges[count++] = {corner, corner | 1 << axis, axis};
    }
  }
  return edges;
}

int EdgeBetween(const std::array<CubeEdge, 12>& edges, int a, int b) {
  for (int e = 0; e < 12; ++e) {
    if ((edges[e].low == a && edges[e].high == b) || (edges[e].low == b && edges[e].high == a)) {
      return e;
    }
  }
  DSG_CHECK(false);
  return -1;
}

// The corners of a face, counter-clockwise seen from outside the cube.
std::array<int, 4> FaceCorners(int axis, int side) {
  const int u = 1 << (axis + 1) % 3;
  const int v = 1 << (axis + 2) % 3;
  const int base = side << axis;
  if (side == 1) return {base, base | u, base | u | v, base | v};
  return {base, base | v, base | u | v, base | u};
}

bool IsOnFace(const CubeEdge& edge, int axis, int side) {
  return (edge.low >> axis & 1) == side && (edge.high >> axis & 1) == side;
}

bool ShareFace(const CubeEdge& a, const CubeEdge& b) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      if (IsOnFace(a, axis, side) && IsOnFace(b, axis, side)) return true;
    }
  }
  return false;
}

// Draws on each face the line around each run of outside corners: from the edge where the run ends
// to the edge where it begins, which turns the triangles' fronts outwards.
std::array<int, 12> NextEdges(const std::array<CubeEdge, 12>& edges, int inside) {
  std::array<int, 12> next;
  next.fill(-1);
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> corners = FaceCorners(face / 2, face % 2);
    const auto is_inside = [&](int i) { return (inside >> corners[i % 4] & 1) != 0; };
    for (int i = 0; i < 4; ++i) {
      if (!is_inside(i) || is_inside(i + 1)) continue;
      int last = i + 1;
      while (!is_inside(last + 1)) ++last;
      const int begin = EdgeBetween(edges, corners[i], corners[(i + 1) % 4]);
      const int end = EdgeBetween(edges, corners[last % 4], corners[(last + 1) % 4]);
      DSG_CHECK(next[end] == -1);
      next[end] = begin;
    }
  }
  return next;
}

std::vector<Loop> MakeLoops(const std::array<int, 12>& next) {
  std::vector<Loop> loops;
  std::array<bool, 12> is_used{};
  for (int first = 0; first < 12; ++first) {
    if (next[first] < 0 || is_used[first]) continue;
    Loop loop;
    for (int e = first; !is_used[e]; e = next[e]) {
      is_used[e] = true;
      loop.push_back(e);
    }
    loops.push_back(loop);
  }
  return loops;
}

// Cuts corner after corner off; a diagonal on a face of the cube could meet one of the neighbour
// there, and four triangles would share it.
std::optional<TriangleList> CutLoop(const std::array<CubeEdge, 12>& edges, const Loop& loop) {
  const size_t count = loop.size();
  for (size_t i = 0; i < count; ++i) {
    const int before = loop[(i + count - 1) % count];
    const int after = loop[(i + 1) % count];
    TriangleList triangles{
        {static_cast<uint8_t>(before), static_cast<uint8_t>(loop[i]), static_cast<uint8_t>(after)}};
    if (count == 3) return triangles;
    if (ShareFace(edges[before], edges[after])) continue;
    Loop rest = loop;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
    const std::optional<TriangleList> others = CutLoop(edges, rest);
    if (!others.has_value()) continue;
    triangles.insert(triangles.end(), others->begin(), others->end());
    return triangles;
  }
  return std::nullopt;
}

}  // namespace

const CubeTable& CubeTable::Get() {
  static const CubeTable* const table = new CubeTable();
  return *table;
}

CubeTable::CubeTable() : edges_(MakeEdges()) {
  for (int inside = 0; inside < 256; ++inside) {
    for (int e = 0; e < 12; ++e) {
      if ((inside >> edges_[e].low & 1) != (inside >> edges_[e].high & 1)) {
        crossed_[inside] = static_cast<uint16_t>(crossed_[inside] | 1 << e);
      }
    }
    for (const Loop& loop : MakeLoops(NextEdges(edges_, inside))) {
      const std::optional<TriangleList> cut = CutLoop(edges_, loop);
      DSG_CHECK(cut.has_value());
      triangles_[inside].insert(triangles_[inside].end(), cut->begin(), cut->end());
    }
  }
}

}  // namespace dsg::ingest
