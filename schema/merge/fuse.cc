// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/fuse.h"

#include <algorithm>
#include <cmath>

#include "schema/merge/footprint.h"
#include "schema/merge/map_content.h"
#include "schema/model/place_memory.h"

namespace dsg::merge {
namespace {

// Smaller differences of boxes are noise; uniting such boxes would grow them again and again.
constexpr double kBoxNoiseM = 0.1;
constexpr double kSameM = 1e-6;

bool IsObserved(const Node& node) { return node.last_observed_ns.has_value(); }

void WidenObserved(const Node& seen, Node* known) {
  if (seen.first_observed_ns.has_value()) {
    known->first_observed_ns =
        std::min(known->first_observed_ns.value_or(kTimeMax), *seen.first_observed_ns);
  }
  if (IsObserved(seen)) {
    known->last_observed_ns =
        std::max(known->last_observed_ns.value_or(kTimeMin), *seen.last_observed_ns);
  }
}

// A node that had ended and is seen again later continues.
void WidenValidity(const Node& seen, Node* known) {
  known->valid.from_ns = std::min(known->valid.from_ns, seen.valid.from_ns);
  if (known->valid.to_ns == kTimeMax || seen.valid.to_ns <= known->valid.to_ns) return;
  if (IsObserved(seen) && *seen.last_observed_ns < known->valid.to_ns) return;
  known->valid.to_ns = seen.valid.to_ns;
}

bool ReachesOut(const Box3d& inner, const Box3d& outer) {
  return ((outer.min() - inner.min()).array() > kBoxNoiseM).any() ||
         ((inner.max() - outer.max()).array() > kBoxNoiseM).any();
}

// Extends the box of `node` to that of `more`, if it reaches out by more than noise.
void GrowOver(const Node& more, Node* node) {
  if (more.box_node.isEmpty()) return;
  if (node->box_node.isEmpty()) {
    node->box_node = Box3d(Eigen::Vector3d::Zero().eval());
  }
  const Box3d box = TransformBox(node->map_T_node.Inverse() * more.map_T_node, more.box_node);
  if (ReachesOut(box, node->box_node)) node->box_node.extend(box);
}

// A model gives the whole shape, so its box wins over any number of observations.
bool IsBetterSeen(const Node& seen, int64_t seen_count, const Node& known) {
  const bool seen_model = seen.object.has_value() && seen.object->model.has_value();
  const bool known_model = known.object.has_value() && known.object->model.has_value();
  if (seen_model != known_model) return seen_model;
  return seen_count > known.observation_count;
}

void TakeGeometry(const Node& seen, Node* known) {
  Node before = *known;
  known->map_T_node = seen.map_T_node;
  known->box_node = seen.box_node;
  if (known->object.has_value() && seen.object.has_value()) {
    known->object->size = seen.object->size;
    if (seen.object->model.has_value()) {
      known->object->model = seen.object->model;
      known->object->map_T_model = seen.object->map_T_model;
      known->object->registration_residual_m = seen.object->registration_residual_m;
    }
  }
  // A model covers the whole thing; without one, earlier observations may have seen another side.
  if (!known->object.has_value() || !known->object->model.has_value()) GrowOver(before, known);
}

void FuseObject(const Node& seen, bool is_better, Node* known) {
  if (seen.object.has_value()) {
    if (!known->object.has_value()) known->object.emplace();
    if (!known->object->color.has_value()) known->object->color = seen.object->color;
    if (known->object->mesh_instance_id == 0) {
      known->object->mesh_instance_id = seen.object->mesh_instance_id;
    }
  }
  if (is_better && !seen.box_node.isEmpty()) {
    TakeGeometry(seen, known);
  } else if (!known->object.has_value() || !known->object->model.has_value()) {
    GrowOver(seen, known);
  }
}

void FuseRegion(const Node& seen, Node* known) {
  GrowOver(seen, known);
  if (!seen.region.has_value()) return;
  if (!known->region.has_value()) {
    known->region = seen.region;
    return;
  }
  const double area = std::abs(SignedArea(known->region->footprint_map));
  const Polygon2d both = UnionOf(known->region->footprint_map, seen.region->footprint_map);
  // Slivers along a wall are noise and would accumulate.
  if (std::abs(SignedArea(both)) > 1.01 * area) {
    known->region->footprint_map = both;
    const auto noted = known->attributes.find("area_m2");
    if (noted != known->attributes.end()) noted->second = std::abs(SignedArea(both));
  }
  const HeightSpan low = HeightsOf(*known);
  const HeightSpan high = HeightsOf(seen);
  if (high.z_min_m < low.z_min_m - kBoxNoiseM) known->region->z_min_m = high.z_min_m;
  if (high.z_max_m > low.z_max_m + kBoxNoiseM) known->region->z_max_m = high.z_max_m;
  if (known->region->class_probabilities.empty()) {
    known->region->class_probabilities = seen.region->class_probabilities;
  }
}

void FuseClass(const Node& seen, Node* known) {
  if (!ClassKey(*known).empty() || ClassKey(seen).empty()) return;
  known->class_id = seen.class_id;
  known->class_name = seen.class_name;
}

// Counts the own observations of each map once, over whichever maps they came. Of two counts of one
// origin the larger is the later.
void CountObservations(const std::string& into, Origin origin, bool is_known, const Node& seen,
                       Node* known) {
  int64_t own_count = OwnCount(*known);
  std::vector<Origin> taken = OriginsOf(seen);
  origin.observation_count = OwnCount(seen);
  taken.push_back(origin);
  for (Origin& each : taken) {
    if (each.map == into) {
      if (each.id == known->id) own_count = std::max(own_count, each.observation_count);
      continue;
    }
    const bool is_seen = each.map == origin.map && each.id == origin.id;
    each.is_copy = false;
    for (const Origin& before : OriginsOf(*known)) {
      if (before.map != each.map || before.id != each.id) continue;
      if (is_seen && !is_known) {
        // Another map had this name before; its observations still count.
        own_count = AddCounts(own_count, before.observation_count);
        continue;
      }
      if (!is_seen && before.observation_count >= each.observation_count) {
        each = before;
        continue;
      }
      each.is_copy = before.is_copy;
      each.written_mark = before.written_mark;
      each.observation_count = std::max(each.observation_count, before.observation_count);
    }
    SetOrigin(each, known);
  }
  known->observation_count = own_count;
  for (const Origin& each : OriginsOf(*known)) {
    known->observation_count = AddCounts(known->observation_count, each.observation_count);
  }
}

bool AreClose(const Pose3d& a, const Pose3d& b) {
  return (a.position - b.position).cwiseAbs().maxCoeff() < kSameM &&
         AngleBetween(a.orientation, b.orientation) < kSameM;
}

bool AreClose(const Polygon2d& a, const Polygon2d& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& p, const auto& q) {
    return (p - q).cwiseAbs().maxCoeff() < kSameM;
  });
}

// Keeps the bits of numbers that are equal within tolerance.
void KeepNumbers(const Node& known, Node* fresh) {
  if (!IsSameGeometry(known, *fresh)) return;
  fresh->map_T_node = known.map_T_node;
  if (known.object.has_value() && fresh->object.has_value()) {
    fresh->object->map_T_model = known.object->map_T_model;
  }
  if (known.structure.has_value() && fresh->structure.has_value()) {
    fresh->structure->plane_normal_map = known.structure->plane_normal_map;
    fresh->structure->plane_offset_m = known.structure->plane_offset_m;
  }
  if (known.region.has_value() && fresh->region.has_value()) {
    fresh->region->footprint_map = known.region->footprint_map;
    fresh->region->z_min_m = known.region->z_min_m;
    fresh->region->z_max_m = known.region->z_max_m;
  }
}

}  // namespace

bool IsSameGeometry(const Node& a, const Node& b) {
  if (!AreClose(a.map_T_node, b.map_T_node)) return false;
  if (a.object.has_value() && b.object.has_value()) {
    if (a.object->model != b.object->model) return false;
    if (a.object->model.has_value() && !AreClose(a.object->map_T_model, b.object->map_T_model)) {
      return false;
    }
  }
  if (a.structure.has_value() && b.structure.has_value() &&
      ((a.structure->plane_normal_map - b.structure->plane_normal_map).norm() > kSameM ||
       std::abs(a.structure->plane_offset_m - b.structure->plane_offset_m) > kSameM)) {
    return false;
  }
  if (!a.region.has_value() || !b.region.has_value()) return true;
  return AreClose(a.region->footprint_map, b.region->footprint_map) &&
         std::abs(a.region->z_min_m - b.region->z_min_m) < kSameM &&
         std::abs(a.region->z_max_m - b.region->z_max_m) < kSameM;
}

void FuseNode(const std::string& into, Origin origin, bool is_known, const Node& seen,
              Node* known) {
  const bool is_better = IsBetterSeen(seen, seen.observation_count, *known);
  CountObservations(into, std::move(origin), is_known, seen, known);
  const bool is_later = seen.last_observed_ns > known->last_observed_ns;
  WidenObserved(seen, known);
  WidenValidity(seen, known);
  if (seen.confidence.has_value()) {
    known->confidence = std::max(known->confidence.value_or(0.0), *seen.confidence);
  }
  FuseClass(seen, known);
  if (IsAgentKind(known->kind)) {
    // The position of an agent is the end of its track.
    if (is_later) known->map_T_node = seen.map_T_node;
    AddPlaceMemory(seen, known);
    return;
  }
  if (known->kind == kinds::kPlace) {
    if (!known->place.has_value()) known->place = seen.place;
  } else if (known->region.has_value() || seen.region.has_value()) {
    FuseRegion(seen, known);
  } else if (known->kind == kinds::kStructure) {
    GrowOver(seen, known);
  } else {
    FuseObject(seen, is_better, known);
  }
}

void RefreshCopy(Origin origin, const Node& seen, Node* known) {
  Node fresh = seen;
  fresh.id = known->id;
  fresh.name = known->name;
  fresh.attributes[kMergedFrom] = known->attributes[kMergedFrom];
  fresh.attributes[kMergedCounts] = known->attributes[kMergedCounts];
  origin.observation_count = OwnCount(seen);
  SetOrigin(std::move(origin), &fresh);
  if (known->valid.to_ns < fresh.valid.to_ns &&
      !(IsObserved(seen) && *seen.last_observed_ns >= known->valid.to_ns)) {
    fresh.valid.to_ns = known->valid.to_ns;
  }
  KeepNumbers(*known, &fresh);
  // Its box may cover children that only this map has.
  if (!fresh.box_node.isEmpty() && AreClose(known->map_T_node, fresh.map_T_node) &&
      !known->box_node.isEmpty()) {
    fresh.box_node.extend(known->box_node);
  }
  *known = std::move(fresh);
}

}  // namespace dsg::merge
