// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/instance_parts.h"

#include <algorithm>
#include <map>
#include <utility>

#include "ingest/objects/euclidean_clusters.h"
#include "ingest/objects/point_index.h"
#include "schema/base/disjoint_sets.h"
#include "schema/model/geometry.h"

namespace dsg::ingest {
namespace {

using InstanceCells = std::map<uint32_t, CellGroup>;

/// Class and dominant instance.
using InstanceKey = std::pair<int32_t, uint32_t>;

InstanceKey KeyOf(const std::vector<SurfaceCell>& cells, const CellGroup& group,
                  const PieceOptions& options) {
  return {cells[static_cast<size_t>(group.front())].class_id,
          DominantInstance(cells, group, options)};
}

std::vector<Eigen::Vector3f> PointsOf(const std::vector<SurfaceCell>& cells,
                                      const CellGroup& group) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(group.size());
  for (const int index : group) points.push_back(cells[static_cast<size_t>(index)].point_map);
  return points;
}

Box3d TrimmedBox(const std::vector<SurfaceCell>& cells, const CellGroup& group, double trim_share) {
  const size_t cut = static_cast<size_t>(trim_share * static_cast<double>(group.size()));
  Box3d box;
  std::vector<double> values(group.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < group.size(); ++i) {
      values[i] = static_cast<double>(cells[static_cast<size_t>(group[i])].point_map[axis]);
    }
    std::sort(values.begin(), values.end());
    box.min()[axis] = values[cut];
    box.max()[axis] = values[values.size() - 1 - cut];
  }
  return box;
}

// Whether one thing has the two numbers in turns.
bool AreInterwoven(const Box3d& a, const Box3d& b, double thickness_min_m, double share) {
  double shared = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = std::max(a.min()[axis], b.min()[axis]);
    const double high = std::min(a.max()[axis], b.max()[axis]);
    const double smaller = std::min(a.sizes()[axis], b.sizes()[axis]);
    if (smaller < thickness_min_m) {
      // Flat on this axis: in the same plane or not.
      if (high - low < -thickness_min_m) return false;
      continue;
    }
    shared *= std::max(0.0, high - low) / smaller;
  }
  return shared > share;
}

InstanceCells CellsByInstance(const std::vector<SurfaceCell>& cells, const CellGroup& group) {
  InstanceCells result;
  for (const int index : group) {
    const uint32_t instance = cells[static_cast<size_t>(index)].instance_id;
    if (instance != 0) result[instance].push_back(index);
  }
  return result;
}

/// The largest connected piece of the cells of one instance.
CellGroup MainPiece(const std::vector<SurfaceCell>& cells, const CellGroup& members,
                    double tolerance_m) {
  const auto pieces = EuclideanClusters(PointsOf(cells, members), tolerance_m);
  const auto& largest =
      *std::max_element(pieces.begin(), pieces.end(),
                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
  CellGroup result;
  result.reserve(largest.size());
  for (const int index : largest) result.push_back(members[static_cast<size_t>(index)]);
  return result;
}

/// The pieces of the instances that are things of their own, the most frequent one first.
std::vector<CellGroup> SeedsOf(const std::vector<SurfaceCell>& cells, const CellGroup& group,
                               double tolerance_m, const PieceOptions& options) {
  // Over that of the most frequent one.
  const double support_min = options.split_share / (1.0 - options.split_share);
  InstanceCells by_instance = CellsByInstance(cells, group);
  std::vector<CellGroup> members;
  for (auto& [instance, indices] : by_instance) members.push_back(std::move(indices));
  std::stable_sort(members.begin(), members.end(),
                   [](const CellGroup& a, const CellGroup& b) { return a.size() > b.size(); });
  std::vector<CellGroup> seeds;
  std::vector<Box3d> boxes;
  for (const CellGroup& one : members) {
    const double support =
        static_cast<double>(one.size()) / static_cast<double>(members.front().size());
    if (support <= support_min) break;
    CellGroup piece = MainPiece(cells, one, tolerance_m);
    const Box3d box = TrimmedBox(cells, piece, options.trim_share);
    const bool is_interwoven = std::any_of(boxes.begin(), boxes.end(), [&](const Box3d& other) {
      return AreInterwoven(box, other, 0.5 * tolerance_m, options.interwoven_share);
    });
    if (is_interwoven) continue;
    boxes.push_back(box);
    seeds.push_back(std::move(piece));
  }
  return seeds;
}

bool AreWithin(const std::vector<Eigen::Vector3f>& a, const std::vector<Eigen::Vector3f>& b,
               double gap_m) {
  const auto& fewer = a.size() < b.size() ? a : b;
  const PointIndex index(a.size() < b.size() ? b : a);
  return std::any_of(fewer.begin(), fewer.end(), [&](const Eigen::Vector3f& point) {
    return static_cast<double>(index.Nearest(point).distance_m) < gap_m;
  });
}

/// Which groups of one instance are one; `members` are indices of groups, the largest first.
void JoinNear(const std::vector<SurfaceCell>& cells, const std::vector<CellGroup>& groups,
              const std::vector<int>& members, const PieceOptions& options, DisjointSets* sets) {
  const size_t largest = groups[static_cast<size_t>(members.front())].size();
  const auto speck =
      std::max(static_cast<size_t>(options.speck_cell_count),
               static_cast<size_t>(options.speck_share * static_cast<double>(largest)));
  for (size_t i = 0; i < members.size(); ++i) {
    const CellGroup& a = groups[static_cast<size_t>(members[i])];
    if (a.size() < speck) break;
    const std::vector<Eigen::Vector3f> points = PointsOf(cells, a);
    for (size_t j = i + 1; j < members.size(); ++j) {
      const CellGroup& b = groups[static_cast<size_t>(members[j])];
      if (b.size() < speck) break;
      if (sets->Find(members[i]) == sets->Find(members[j])) continue;
      if (!AreWithin(points, PointsOf(cells, b), options.join_gap_m)) continue;
      sets->Merge(members[i], members[j]);
    }
  }
}

}  // namespace

uint32_t DominantInstance(const std::vector<SurfaceCell>& cells, const CellGroup& group,
                          const PieceOptions& options) {
  std::map<uint32_t, size_t> counts;
  for (const int index : group) ++counts[cells[static_cast<size_t>(index)].instance_id];
  counts.erase(0);
  size_t most = 0;
  for (const auto& [instance, count] : counts) most = std::max(most, count);
  if (static_cast<double>(most) < options.dominant_share * static_cast<double>(group.size()))
    return 0;
  for (const auto& [instance, count] : counts) {
    if (static_cast<double>(count) >= options.nearly_share * static_cast<double>(most)) {
      return instance;
    }
  }
  return 0;
}

std::vector<CellGroup> SplitByInstance(const std::vector<SurfaceCell>& cells,
                                       const CellGroup& group, double tolerance_m,
                                       const PieceOptions& options) {
  std::vector<CellGroup> parts = SeedsOf(cells, group, tolerance_m, options);
  if (parts.size() < 2) return {group};
  std::vector<Eigen::Vector3f> seed_points;
  std::vector<size_t> part_of_seed;
  std::vector<int> seeded;
  for (size_t k = 0; k < parts.size(); ++k) {
    for (const int index : parts[k]) {
      seed_points.push_back(cells[static_cast<size_t>(index)].point_map);
      part_of_seed.push_back(k);
      seeded.push_back(index);
    }
  }
  std::sort(seeded.begin(), seeded.end());
  const PointIndex seeds(std::move(seed_points));
  for (const int index : group) {
    if (std::binary_search(seeded.begin(), seeded.end(), index)) continue;
    const auto hit = seeds.Nearest(cells[static_cast<size_t>(index)].point_map);
    parts[part_of_seed[static_cast<size_t>(hit.index)]].push_back(index);
  }
  for (CellGroup& part : parts) std::sort(part.begin(), part.end());
  return parts;
}

std::vector<CellGroup> DropEchoes(const std::vector<SurfaceCell>& cells,
                                  std::vector<CellGroup> groups, const PieceOptions& options) {
  std::map<InstanceKey, size_t> largest;
  for (const CellGroup& group : groups) {
    size_t& size = largest[KeyOf(cells, group, options)];
    size = std::max(size, group.size());
  }
  std::erase_if(groups, [&](const CellGroup& group) {
    const InstanceKey key = KeyOf(cells, group, options);
    const double largest_size = static_cast<double>(largest[key]);
    return key.second != 0 && static_cast<double>(group.size()) < options.echo_share * largest_size;
  });
  return groups;
}

std::vector<CellGroup> MergeByInstance(const std::vector<SurfaceCell>& cells,
                                       std::vector<CellGroup> groups, const PieceOptions& options) {
  std::map<InstanceKey, std::vector<int>> by_instance;
  for (size_t i = 0; i < groups.size(); ++i) {
    const InstanceKey key = KeyOf(cells, groups[i], options);
    if (key.second != 0) by_instance[key].push_back(static_cast<int>(i));
  }
  DisjointSets sets(groups.size());
  for (auto& [key, members] : by_instance) {
    std::stable_sort(members.begin(), members.end(), [&](int a, int b) {
      return groups[static_cast<size_t>(a)].size() > groups[static_cast<size_t>(b)].size();
    });
    if (members.size() > 1) JoinNear(cells, groups, members, options, &sets);
  }
  std::map<int, CellGroup> joined;
  for (size_t i = 0; i < groups.size(); ++i) {
    CellGroup& whole = joined[sets.Find(static_cast<int>(i))];
    whole.insert(whole.end(), groups[i].begin(), groups[i].end());
  }
  std::vector<CellGroup> result;
  for (auto& [root, whole] : joined) {
    std::sort(whole.begin(), whole.end());
    result.push_back(std::move(whole));
  }
  std::sort(result.begin(), result.end());
  return result;
}

}  // namespace dsg::ingest
