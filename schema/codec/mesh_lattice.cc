// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/mesh_lattice.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <tuple>

#include "schema/model/mesh_grid.h"

namespace dsg {
namespace {

using Steps = std::array<int64_t, 3>;

// The distance of two points is what coordinates of one face differ by most often. In a block of
// few faces something else may be; such blocks are small in any form.
constexpr size_t kFacesForPitch = 256;
// Coordinates beyond are no steps of the grid: a float is coarser.
constexpr double kCoordinateMaxM = 1e5;

int64_t MostFrequent(const std::map<int64_t, int>& counts) {
  int64_t value = 0;
  int most = 0;
  for (const auto& [candidate, count] : counts) {
    if (count <= most) continue;
    most = count;
    value = candidate;
  }
  return value;
}

int64_t Modulo(int64_t value, int64_t divisor) {
  const int64_t rest = value % divisor;
  return rest < 0 ? rest + divisor : rest;
}

// Points and edges stay absolute here: relative ones need the lowest cell first.
struct AbsoluteVertex {
  Steps point{};
  int axis = 0;
  int64_t fraction = 0;
};

class LatticeFinder {
 public:
  explicit LatticeFinder(const MeshBlock& block) : block_(block) {}

  std::optional<MeshLattice> Find() {
    const auto vertex_count = static_cast<int64_t>(block_.positions_map.size());
    const auto face_count = static_cast<int64_t>(block_.faces.size());
    if (vertex_count == 0 || face_count == 0 || vertex_count > kLatticeVerticesMax ||
        face_count > kLatticeFacesMax) {
      return std::nullopt;
    }
    if (!ReadSteps() || !AreVerticesInOrder() || !FindPitch() || !PlaceVertices() ||
        !PlaceFaces() || !AreEdgesUnique()) {
      return std::nullopt;
    }
    return std::move(lattice_);
  }

 private:
  bool ReadSteps() {
    steps_.reserve(block_.positions_map.size());
    for (const Eigen::Vector3f& position : block_.positions_map) {
      Steps& steps = steps_.emplace_back();
      for (int axis = 0; axis < 3; ++axis) {
        const float coordinate = position[axis];
        if (!(std::abs(coordinate) < kCoordinateMaxM)) return false;
        steps[axis] = MeshStepsOf(static_cast<double>(coordinate));
        if (std::bit_cast<uint32_t>(MeshCoordinateOf(steps[axis])) !=
            std::bit_cast<uint32_t>(coordinate)) {
          return false;
        }
      }
    }
    return true;
  }

  // Numbered as faces use them for the first time, all of them used.
  bool AreVerticesInOrder() const {
    uint32_t next = 0;
    for (const auto& face : block_.faces) {
      for (const uint32_t vertex : face) {
        if (vertex > next) return false;
        if (vertex == next) ++next;
      }
    }
    return next == block_.positions_map.size();
  }

  bool FindPitch() {
    std::map<int64_t, int> distances;
    const size_t count = std::min(block_.faces.size(), kFacesForPitch);
    for (size_t i = 0; i < count; ++i) {
      const auto& face = block_.faces[i];
      for (size_t corner = 0; corner < 3; ++corner) {
        const Steps& a = steps_[face[corner]];
        const Steps& b = steps_[face[(corner + 1) % 3]];
        for (int axis = 0; axis < 3; ++axis) {
          const int64_t distance = std::abs(a[axis] - b[axis]);
          if (distance > 1) ++distances[distance];
        }
      }
    }
    lattice_.pitch = MostFrequent(distances);
    if (lattice_.pitch < 2 || lattice_.pitch > kPitchMax) return false;
    std::map<int64_t, int> rests;
    for (size_t i = 0; i < std::min(steps_.size(), 3 * count); ++i) {
      for (const int64_t steps : steps_[i]) ++rests[Modulo(steps, lattice_.pitch)];
    }
    lattice_.offset = MostFrequent(rests);
    return true;
  }

  bool PlaceVertices() {
    vertices_.reserve(steps_.size());
    for (const Steps& steps : steps_) {
      AbsoluteVertex& vertex = vertices_.emplace_back();
      int off_count = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const int64_t from_offset = steps[axis] - lattice_.offset;
        const int64_t fraction = Modulo(from_offset, lattice_.pitch);
        vertex.point[axis] = (from_offset - fraction) / lattice_.pitch;
        if (fraction == 0) continue;
        ++off_count;
        vertex.axis = axis;
        vertex.fraction = fraction;
      }
      if (off_count != 1) return false;
    }
    return true;
  }

  // The cells that hold all three edges of a face, as bounds on each axis.
  bool CellsOf(const std::array<uint32_t, 3>& face, Steps* least, Steps* most) const {
    least->fill(std::numeric_limits<int64_t>::min());
    most->fill(std::numeric_limits<int64_t>::max());
    for (const uint32_t index : face) {
      const AbsoluteVertex& vertex = vertices_[index];
      for (int axis = 0; axis < 3; ++axis) {
        const int64_t high = vertex.point[axis];
        (*least)[axis] = std::max((*least)[axis], axis == vertex.axis ? high : high - 1);
        (*most)[axis] = std::min((*most)[axis], high);
      }
    }
    return (*least)[0] <= (*most)[0] && (*least)[1] <= (*most)[1] && (*least)[2] <= (*most)[2];
  }

  static bool IsBefore(const Steps& a, const Steps& b) {
    return std::tie(a[2], a[1], a[0]) < std::tie(b[2], b[1], b[0]);
  }

  // A face within a side of a cell may be of two cells: the first that keeps the order.
  static std::optional<Steps> FirstFrom(const Steps& last, const Steps& least, const Steps& most) {
    std::optional<Steps> first;
    for (int64_t z = least[2]; z <= most[2]; ++z) {
      for (int64_t y = least[1]; y <= most[1]; ++y) {
        for (int64_t x = least[0]; x <= most[0]; ++x) {
          const Steps cell = {x, y, z};
          if (IsBefore(cell, last)) continue;
          if (!first.has_value() || IsBefore(cell, *first)) first = cell;
        }
      }
    }
    return first;
  }

  bool PlaceFaces() {
    std::vector<Steps> cells;
    Steps last = {std::numeric_limits<int64_t>::min(), std::numeric_limits<int64_t>::min(),
                  std::numeric_limits<int64_t>::min()};
    for (const auto& face : block_.faces) {
      Steps least;
      Steps most;
      if (!CellsOf(face, &least, &most)) return false;
      const std::optional<Steps> cell = FirstFrom(last, least, most);
      if (!cell.has_value()) return false;
      last = *cell;
      cells.push_back(last);
    }
    Steps high = cells.front();
    lattice_.low = cells.front();
    for (const Steps& cell : cells) {
      for (int axis = 0; axis < 3; ++axis) {
        lattice_.low[axis] = std::min(lattice_.low[axis], cell[axis]);
        high[axis] = std::max(high[axis], cell[axis]);
      }
    }
    int64_t point_count = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const int64_t size = high[axis] - lattice_.low[axis] + 1;
      if (size >= kLatticePointsMax) return false;
      point_count *= size + 1;
      if (point_count > kLatticePointsMax) return false;
      lattice_.size[axis] = static_cast<int32_t>(size);
    }
    return FillCells(cells);
  }

  LatticePoint Relative(const Steps& point) const {
    return {static_cast<int32_t>(point[0] - lattice_.low[0]),
            static_cast<int32_t>(point[1] - lattice_.low[1]),
            static_cast<int32_t>(point[2] - lattice_.low[2])};
  }

  bool FillCells(const std::vector<Steps>& cells) {
    for (const AbsoluteVertex& vertex : vertices_) {
      lattice_.vertices.push_back(
          {Relative(vertex.point), vertex.axis, static_cast<int32_t>(vertex.fraction)});
    }
    for (size_t i = 0; i < cells.size(); ++i) {
      const LatticePoint cell = Relative(cells[i]);
      if (lattice_.cells.empty() || lattice_.cells.back().cell != cell) {
        lattice_.cells.push_back({cell, ""});
      }
      std::string& edges = lattice_.cells.back().edges;
      if (edges.size() >= 3 * kFacesPerCellMax) return false;
      for (const uint32_t index : block_.faces[i]) {
        const LatticeVertex& vertex = lattice_.vertices[index];
        const int u = (vertex.axis + 1) % 3;
        const int v = (vertex.axis + 2) % 3;
        edges.push_back(static_cast<char>(vertex.axis * 4 + (vertex.point[u] - cell[u]) +
                                          2 * (vertex.point[v] - cell[v])));
      }
    }
    return true;
  }

  // A decoder takes what lies on an edge for the same vertex.
  bool AreEdgesUnique() const {
    std::vector<std::array<int32_t, 4>> edges;
    edges.reserve(lattice_.vertices.size());
    for (const LatticeVertex& vertex : lattice_.vertices) {
      edges.push_back({vertex.point[0], vertex.point[1], vertex.point[2], vertex.axis});
    }
    std::sort(edges.begin(), edges.end());
    return std::adjacent_find(edges.begin(), edges.end()) == edges.end();
  }

  const MeshBlock& block_;
  MeshLattice lattice_;
  std::vector<Steps> steps_;
  std::vector<AbsoluteVertex> vertices_;
};

}  // namespace

LatticePoint EdgePoint(const LatticePoint& cell, int edge) {
  const int axis = edge / 4;
  LatticePoint point = cell;
  point[(axis + 1) % 3] += edge & 1;
  point[(axis + 2) % 3] += edge >> 1 & 1;
  return point;
}

std::optional<MeshLattice> FindLattice(const MeshBlock& block) {
  return LatticeFinder(block).Find();
}

}  // namespace dsg
