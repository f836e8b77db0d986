// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/near_pairs.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>

namespace dsg::ingest {
namespace {

constexpr double kCellM = 2.0;
// A box of more cells than this is compared with all others.
constexpr double kCellCountMax = 1024.0;
// Beyond, cells have no exact numbers.
constexpr double kCoordinateMaxM = 1e9;

struct Entry {
  int64_t x = 0;
  int64_t y = 0;
  int box = 0;
};

int64_t GridCell(double value) { return static_cast<int64_t>(std::floor(value / kCellM)); }

bool IsTooLarge(const Box3d& box) {
  const Eigen::Vector3d sizes = box.sizes() / kCellM;
  return !((sizes.x() + 2.0) * (sizes.y() + 2.0) <= kCellCountMax) ||
         !(box.min().cwiseAbs().maxCoeff() < kCoordinateMaxM &&
           box.max().cwiseAbs().maxCoeff() < kCoordinateMaxM);
}

void AddEntries(const Box3d& box, double margin_m, int index, std::vector<Entry>* entries) {
  for (int64_t x = GridCell(box.min().x() - margin_m); x <= GridCell(box.max().x() + margin_m);
       ++x) {
    for (int64_t y = GridCell(box.min().y() - margin_m); y <= GridCell(box.max().y() + margin_m);
         ++y) {
      entries->push_back({x, y, index});
    }
  }
}

}  // namespace

double DistanceBetween(const Box3d& a, const Box3d& b) {
  const Eigen::Vector3d gap = (a.min() - b.max()).cwiseMax(b.min() - a.max());
  return gap.cwiseMax(0.0).norm();
}

std::vector<std::pair<int, int>> NearPairs(const std::vector<Box3d>& boxes, double distance_m) {
  std::vector<Entry> entries;
  std::vector<std::pair<int, int>> pairs;
  const auto add = [&](int i, int j) {
    if (DistanceBetween(boxes[static_cast<size_t>(i)], boxes[static_cast<size_t>(j)]) <=
        distance_m) {
      pairs.emplace_back(std::min(i, j), std::max(i, j));
    }
  };
  const int count = static_cast<int>(boxes.size());
  for (int i = 0; i < count; ++i) {
    if (!IsTooLarge(boxes[static_cast<size_t>(i)])) {
      // Half the distance on either side makes near boxes share a cell.
      AddEntries(boxes[static_cast<size_t>(i)], 0.5 * distance_m, i, &entries);
      continue;
    }
    for (int j = 0; j < count; ++j) {
      if (j != i) add(i, j);
    }
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.x, a.y, a.box) < std::tie(b.x, b.y, b.box);
  });
  for (size_t i = 0; i < entries.size(); ++i) {
    for (size_t j = i + 1;
         j < entries.size() && entries[j].x == entries[i].x && entries[j].y == entries[i].y; ++j) {
      add(entries[i].box, entries[j].box);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

}  // namespace dsg::ingest
