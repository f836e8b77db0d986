// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/node_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

constexpr int kAxisBits = 19;
constexpr int64_t kAxisCells = int64_t{1} << kAxisBits;
constexpr int64_t kAxisMask = kAxisCells - 1;
constexpr int kLevelShift = 3 * kAxisBits;
// Coordinates that a map can hold fit into cells of this power of two.
constexpr int kLevelMax = 31;
// Beyond so many stretches reading all cells of a size is cheaper than seeking each.
constexpr int64_t kStretchesMax = 256;

int64_t Pack(int level, int64_t x, int64_t y, int64_t z) {
  return static_cast<int64_t>(level) << kLevelShift | (x & kAxisMask) << (2 * kAxisBits) |
         (y & kAxisMask) << kAxisBits | (z & kAxisMask);
}

int64_t IndexOf(double coordinate_m, int level) {
  return static_cast<int64_t>(std::floor(std::ldexp(coordinate_m, -level)));
}

// Cells along an axis, from `first` on; all of them if the count is that of the axis.
struct Range {
  int64_t first = 0;
  int64_t count = 0;

  bool Holds(int64_t index) const { return ((index - first) & kAxisMask) < count; }
  // As one stretch of wrapped numbers: the whole axis where it would be two.
  std::pair<int64_t, int64_t> Stretch() const {
    const int64_t low = first & kAxisMask;
    if (low + count > kAxisCells) return {0, kAxisMask};
    return {low, low + count - 1};
  }
};

// A node of this level reaches at most half an edge beyond the middle of its box, which is in its
// cell.
Range Touching(double min_m, double max_m, int level) {
  const double reach_m = std::ldexp(0.5, level) + 1e-3;
  const int64_t first = IndexOf(min_m - reach_m, level);
  const int64_t last = IndexOf(max_m + reach_m, level);
  return {first, std::min(last - first + 1, kAxisCells)};
}

struct Cells {
  int level;
  std::array<Range, 3> axes;

  bool Holds(int64_t cell) const {
    return axes[0].Holds(cell >> (2 * kAxisBits) & kAxisMask) &&
           axes[1].Holds(cell >> kAxisBits & kAxisMask) && axes[2].Holds(cell & kAxisMask);
  }
};

absl::Status TakeStretch(Query* query, int64_t low, int64_t high, const Cells& cells,
                         std::vector<NodeId>* ids) {
  query->Reset();
  query->Bind(low, high);
  while (query->Next()) {
    if (cells.Holds(query->Int(0))) ids->push_back(IdOf(query->Int(1)));
  }
  return query->status();
}

absl::Status TakeLevel(Database& db, const Cells& cells, std::vector<NodeId>* ids) {
  Query query(db, "SELECT cell, key FROM node_cell WHERE cell BETWEEN ?1 AND ?2");
  const int level = cells.level;
  const Range& x = cells.axes[0];
  if (x.count > kStretchesMax) {
    return TakeStretch(&query, Pack(level, 0, 0, 0), Pack(level, -1, -1, -1), cells, ids);
  }
  const auto [y_low, y_high] = cells.axes[1].Stretch();
  for (int64_t i = x.first; i < x.first + x.count; ++i) {
    DSG_RETURN_IF_ERROR(
        TakeStretch(&query, Pack(level, i, y_low, 0), Pack(level, i, y_high, -1), cells, ids));
  }
  return absl::OkStatus();
}

// The lowest level from `level` on that has nodes.
absl::StatusOr<std::optional<int>> NextLevel(Database& db, int level) {
  Query query(db, "SELECT cell FROM node_cell WHERE cell >= ?1 ORDER BY cell LIMIT 1");
  const bool found = query.Bind(Pack(level, 0, 0, 0)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (!found) return std::optional<int>();
  return std::optional<int>(static_cast<int>(query.Int(0) >> kLevelShift));
}

}  // namespace

int64_t CellOf(const Box3d& box_map) {
  const double edge_m = box_map.sizes().maxCoeff();
  const int level =
      edge_m <= 1.0 ? 0 : std::min(static_cast<int>(std::ceil(std::log2(edge_m))), kLevelMax);
  const Eigen::Vector3d middle = box_map.center();
  return Pack(level, IndexOf(middle.x(), level), IndexOf(middle.y(), level),
              IndexOf(middle.z(), level));
}

absl::Status AddCell(Database& db, const Node& node) {
  if (IsAgentKind(node.kind)) return absl::OkStatus();
  return Query(db, "INSERT INTO node_cell (cell, key) VALUES (?1, ?2)")
      .Bind(CellOf(node.BoxMap()), KeyOf(node.id))
      .Run();
}

absl::Status RemoveCell(Database& db, const Node& node) {
  if (IsAgentKind(node.kind)) return absl::OkStatus();
  return Query(db, "DELETE FROM node_cell WHERE cell = ?1 AND key = ?2")
      .Bind(CellOf(node.BoxMap()), KeyOf(node.id))
      .Run();
}

absl::StatusOr<bool> HasCell(Database& db, const Node& node) {
  Query query(db, "SELECT 1 FROM node_cell WHERE cell = ?1 AND key = ?2");
  const bool found = query.Bind(CellOf(node.BoxMap()), KeyOf(node.id)).Next();
  DSG_RETURN_IF_ERROR(query.status());
  return found;
}

absl::StatusOr<std::vector<NodeId>> FindNear(Database& db, const Box3d& box_map) {
  // Beyond all coordinates of a map, so that far corners of a question are numbers still.
  constexpr double kFarM = 1e7;
  const Eigen::Vector3d min = box_map.min().cwiseMax(-kFarM).cwiseMin(kFarM);
  const Eigen::Vector3d max = box_map.max().cwiseMax(-kFarM).cwiseMin(kFarM);
  std::vector<NodeId> ids;
  for (int next = 0; next <= kLevelMax; ++next) {
    DSG_ASSIGN_OR_RETURN(const auto level, NextLevel(db, next));
    if (!level.has_value()) break;
    next = *level;
    const Cells cells{next,
                      {Touching(min.x(), max.x(), next), Touching(min.y(), max.y(), next),
                       Touching(min.z(), max.z(), next)}};
    DSG_RETURN_IF_ERROR(TakeLevel(db, cells, &ids));
  }
  return ids;
}

}  // namespace dsg::sqlite
