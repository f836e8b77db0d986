// SPDX-License-Identifier: Apache-2.0
#include "query/engine/planning/place_locator.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "query/view/stoppable_sort.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr double kCellM = 2.0;
// Places between two questions to the stop check.
constexpr int64_t kStopPeriod = 1024;
constexpr int64_t kCellMax = (int64_t{1} << 20) - 1;

// What lies beyond 2000 km from the origin shares the outermost cells.
int64_t CellOf(double metres) {
  const double cell = std::floor(metres / kCellM);
  return static_cast<int64_t>(
      std::clamp(cell, -static_cast<double>(kCellMax), static_cast<double>(kCellMax)));
}

uint64_t Pack(int64_t x, int64_t y, int64_t z) {
  const auto bits = [](int64_t cell) { return static_cast<uint64_t>(cell + kCellMax); };
  return bits(x) << 42 | bits(y) << 21 | bits(z);
}

}  // namespace

absl::StatusOr<PlaceLocator> PlaceLocator::Build(const PlaceGraph& graph, const StopCheck& stop) {
  PlaceLocator made;
  made.entries_.reserve(static_cast<size_t>(graph.size()));
  StopCounter counter(stop, kStopPeriod);
  for (PlaceIndex place = 0; place < graph.size(); ++place) {
    DSG_RETURN_IF_ERROR(counter.Check());
    const Eigen::Vector3d& at = graph.position_map(place);
    made.entries_.push_back({Pack(CellOf(at.x()), CellOf(at.y()), CellOf(at.z())), place});
    made.clearance_m_max_ = std::max(made.clearance_m_max_, graph.clearance_m(place));
    for (const auto* link = graph.links_begin(place); link != graph.links_end(place); ++link) {
      made.link_length_m_max_ = std::max(made.link_length_m_max_, link->length_m);
    }
  }
  const auto less = [](const Entry& a, const Entry& b) {
    return std::tie(a.cell, a.place) < std::tie(b.cell, b.place);
  };
  DSG_RETURN_IF_ERROR(SortStoppably(less, stop, &made.entries_));
  return made;
}

void PlaceLocator::ForEachNear(const Box3d& box_map, double reach_m,
                               const std::function<void(PlaceIndex)>& visit) const {
  const Eigen::Vector3d low = box_map.min().array() - reach_m;
  const Eigen::Vector3d high = box_map.max().array() + reach_m;
  const int64_t x_end = CellOf(high.x());
  const int64_t y_end = CellOf(high.y());
  const double column_count = static_cast<double>(x_end - CellOf(low.x()) + 1) *
                              static_cast<double>(y_end - CellOf(low.y()) + 1);
  if (column_count > static_cast<double>(entries_.size())) {
    for (const Entry& entry : entries_) visit(entry.place);
    return;
  }
  for (int64_t x = CellOf(low.x()); x <= x_end; ++x) {
    for (int64_t y = CellOf(low.y()); y <= y_end; ++y) {
      const uint64_t first = Pack(x, y, CellOf(low.z()));
      const uint64_t last = Pack(x, y, CellOf(high.z()));
      auto entry = std::lower_bound(entries_.begin(), entries_.end(), first,
                                    [](const Entry& at, uint64_t cell) { return at.cell < cell; });
      for (; entry != entries_.end() && entry->cell <= last; ++entry) visit(entry->place);
    }
  }
}

}  // namespace dsg::query
