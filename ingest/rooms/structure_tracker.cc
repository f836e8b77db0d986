// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <tuple>

#include "ingest/rooms/structure.h"

namespace dsg::ingest {
namespace {

/// A piece goes on as one of the same class whose plane is near and whose box touches it.
bool MayContinue(const StructurePiece& old, const StructurePiece& now,
                 const StructureOptions& options) {
  if (old.type != now.type || old.class_id != now.class_id) return false;
  if (old.box_map.isEmpty() || now.box_map.isEmpty()) return false;
  if (old.box_map.exteriorDistance(now.box_map) > options.same_apart_m) return false;
  if (now.type == "pillar") return true;
  if (old.normal_map.dot(now.normal_map) < options.same_cosine) return false;
  return std::abs(old.normal_map.dot(now.box_map.center()) + old.offset_m) <= options.same_plane_m;
}

// How much of the smaller of two boxes is in both, edges that are too thin made thicker.
double Overlap(const Box3d& a, const Box3d& b, double thick_m) {
  const auto thick = [thick_m](Box3d box) {
    box.min().array() -= 0.5 * thick_m;
    box.max().array() += 0.5 * thick_m;
    return box;
  };
  const Box3d shared = thick(a).intersection(thick(b));
  return shared.isEmpty() ? 0.0 : shared.volume();
}

}  // namespace

void StructureTracker::Track(std::vector<StructurePiece>* pieces) {
  std::vector<std::tuple<double, size_t, size_t>> pairs;
  for (size_t i = 0; i < last_.size(); ++i) {
    for (size_t j = 0; j < pieces->size(); ++j) {
      if (!MayContinue(last_[i], (*pieces)[j], options_)) continue;
      pairs.emplace_back(-Overlap(last_[i].box_map, (*pieces)[j].box_map, options_.same_apart_m), i,
                         j);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  for (StructurePiece& piece : *pieces) piece.id = -1;
  std::vector<bool> is_taken(last_.size(), false);
  for (const auto& [negative_overlap, old, now] : pairs) {
    if (is_taken[old] || (*pieces)[now].id >= 0) continue;
    is_taken[old] = true;
    (*pieces)[now].id = last_[old].id;
  }
  for (StructurePiece& piece : *pieces) {
    if (piece.id < 0) piece.id = next_id_++;
  }
  last_ = *pieces;
  // The older piece wins ties, whatever the order of the pieces.
  std::sort(last_.begin(), last_.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
}

void StructureTracker::Move(const PointMove& move) {
  for (StructurePiece& piece : last_) {
    const Pose3d new_T_old = move(piece.box_map.center());
    piece.box_map = TransformBox(new_T_old, piece.box_map);
    piece.normal_map = new_T_old.orientation * piece.normal_map;
    piece.offset_m -= piece.normal_map.dot(new_T_old.position);
  }
}

}  // namespace dsg::ingest
