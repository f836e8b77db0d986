// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/relations.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "ingest/objects/near_pairs.h"
#include "ingest/objects/object_matching.h"
#include "schema/model/edge.h"

namespace dsg::ingest {
namespace {

// Flat things get some volume.
constexpr double kEdgeMinM = 0.01;

/// A box with some extent on each axis.
Box3d SolidBox(const ObjectCluster& cluster) {
  Box3d box = AxisAlignedBox(cluster);
  const Eigen::Vector3d missing =
      (Eigen::Vector3d::Constant(kEdgeMinM) - box.sizes()).cwiseMax(0.0);
  box.min() -= 0.5 * missing;
  box.max() += 0.5 * missing;
  return box;
}

double VolumeOf(const ObjectCluster& cluster) {
  return cluster.size.cwiseMax(Eigen::Vector3d::Constant(kEdgeMinM)).prod();
}

double SharedFootprint(const Box3d& a, const Box3d& b) {
  const double x = std::min(a.max().x(), b.max().x()) - std::max(a.min().x(), b.min().x());
  const double y = std::min(a.max().y(), b.max().y()) - std::max(a.min().y(), b.min().y());
  return std::max(0.0, x) * std::max(0.0, y);
}

/// What the points of a container say of where its content lies.
struct Surroundings {
  bool is_covered = false;
  bool is_enclosed = false;
};

Surroundings Surround(const std::vector<Eigen::Vector3f>& container, const Box3d& content) {
  Surroundings result;
  bool sides[4] = {false, false, false, false};
  const Eigen::Vector3d middle = content.center();
  for (const Eigen::Vector3f& raw : container) {
    const Eigen::Vector3d point = raw.cast<double>();
    const bool is_x_between = point.x() >= content.min().x() && point.x() <= content.max().x();
    const bool is_y_between = point.y() >= content.min().y() && point.y() <= content.max().y();
    result.is_covered |= is_x_between && is_y_between && point.z() > content.max().z();
    if (point.z() < middle.z() || point.z() > content.max().z()) continue;
    sides[0] |= is_y_between && point.x() < middle.x();
    sides[1] |= is_y_between && point.x() > middle.x();
    sides[2] |= is_x_between && point.y() < middle.y();
    sides[3] |= is_x_between && point.y() > middle.y();
  }
  result.is_enclosed = sides[0] && sides[1] && sides[2] && sides[3];
  return result;
}

/// ON, IN or nothing of `a` to `b`, and how much of `a` it concerns.
struct Support {
  std::string relation;
  double share = 0.0;
};

std::optional<Support> SupportOf(const TrackedObject& a, const Box3d& a_box, const TrackedObject& b,
                                 const Box3d& b_box, const RelationOptions& options) {
  const double carried = SharedFootprint(a_box, b_box) / (a_box.sizes().x() * a_box.sizes().y());
  if (carried >= options.carried_share &&
      std::abs(a_box.min().z() - b_box.max().z()) <= options.contact_m &&
      a_box.max().z() > b_box.max().z()) {
    return Support{relations::kOn, carried};
  }
  const Eigen::Vector3d slack = Eigen::Vector3d::Constant(options.inside_slack_m);
  const Box3d shared = Box3d(b_box.min() - slack, b_box.max() + slack).intersection(a_box);
  const double inside = shared.isEmpty() ? 0.0 : shared.volume() / a_box.volume();
  if (inside < options.inside_share ||
      VolumeOf(b.cluster) < options.container_min * VolumeOf(a.cluster)) {
    return std::nullopt;
  }
  if (b.cluster.points_map.empty()) return Support{relations::kIn, inside};
  const Surroundings around = Surround(b.cluster.points_map, a_box);
  // A bin under a desk stands on the same floor.
  const bool is_on_same_floor = std::abs(a_box.min().z() - b_box.min().z()) <= options.contact_m;
  if (around.is_enclosed) return Support{relations::kIn, inside};
  if (is_on_same_floor) return std::nullopt;
  return Support{around.is_covered ? relations::kIn : relations::kOn, inside};
}

// ON, for what nothing carries by SupportOf and what is well above the floor: the side of the other
// reaches up to its underside. Of cupboards and counters often the front alone is seen.
std::optional<Support> EdgeSupportOf(const Box3d& a_box, const Box3d& b_box, double gap_m_max,
                                     const RelationOptions& options) {
  if (std::abs(a_box.min().z() - b_box.max().z()) > options.contact_m) return std::nullopt;
  if (a_box.max().z() <= b_box.max().z()) return std::nullopt;
  // A chair beside a carpet stands on the floor.
  if (b_box.sizes().z() < options.edge_height_m) return std::nullopt;
  const auto floor_of = [](const Box3d& box) {
    return Eigen::AlignedBox2d(Eigen::Vector2d(box.min().head<2>()),
                               Eigen::Vector2d(box.max().head<2>()));
  };
  const double gap_m = floor_of(a_box).exteriorDistance(floor_of(b_box));
  if (gap_m > gap_m_max) return std::nullopt;
  // Where several touch, the one with most of it, and then the nearest.
  return Support{relations::kOn, SharedFootprint(a_box, b_box) - gap_m};
}

void KeepBest(const std::optional<Support>& support, int64_t second,
              std::optional<std::pair<Support, int64_t>>* best) {
  if (!support.has_value()) return;
  if (best->has_value() && (*best)->first.share >= support->share) return;
  *best = std::pair(*support, second);
}

void AddComparison(const TrackedObject& a, const TrackedObject& b, double larger_min,
                   std::vector<ObjectRelation>* relations) {
  const double ratio = VolumeOf(a.cluster) / VolumeOf(b.cluster);
  if (ratio > larger_min) {
    relations->push_back({a.id, relations::kLargerThan, b.id, ratio});
  } else if (1.0 / ratio > larger_min) {
    relations->push_back({b.id, relations::kLargerThan, a.id, 1.0 / ratio});
  }
}

}  // namespace

std::vector<ObjectRelation> FindRelations(const std::vector<TrackedObject>& objects,
                                          const RelationOptions& options) {
  std::vector<Box3d> boxes;
  for (const TrackedObject& object : objects) boxes.push_back(SolidBox(object.cluster));
  std::vector<ObjectRelation> relations;
  std::vector<std::optional<std::pair<Support, int64_t>>> support(objects.size());
  std::vector<std::optional<std::pair<Support, int64_t>>> edge_support(objects.size());
  for (const auto& [low, high] : NearPairs(boxes, options.near_m)) {
    const auto i = static_cast<size_t>(low);
    const auto j = static_cast<size_t>(high);
    const double distance_m = DistanceBetween(boxes[i], boxes[j]);
    if (distance_m < options.near_m) {
      relations.push_back({std::min(objects[i].id, objects[j].id), relations::kNear,
                           std::max(objects[i].id, objects[j].id), distance_m});
      AddComparison(objects[i], objects[j], options.larger_min, &relations);
    }
    KeepBest(SupportOf(objects[i], boxes[i], objects[j], boxes[j], options), objects[j].id,
             &support[i]);
    KeepBest(SupportOf(objects[j], boxes[j], objects[i], boxes[i], options), objects[i].id,
             &support[j]);
    const double touch_m = options.inside_slack_m;
    KeepBest(EdgeSupportOf(boxes[i], boxes[j], touch_m, options), objects[j].id, &edge_support[i]);
    KeepBest(EdgeSupportOf(boxes[j], boxes[i], touch_m, options), objects[i].id, &edge_support[j]);
  }
  for (size_t i = 0; i < objects.size(); ++i) {
    if (!support[i].has_value()) support[i] = edge_support[i];
    if (!support[i].has_value()) continue;
    relations.push_back({objects[i].id, support[i]->first.relation, support[i]->second, 1.0});
  }
  std::sort(
      relations.begin(), relations.end(), [](const ObjectRelation& a, const ObjectRelation& b) {
        return std::tie(a.first, a.relation, a.second) < std::tie(b.first, b.relation, b.second);
      });
  return relations;
}

std::optional<int64_t> CarrierBeside(const TrackedObject& object,
                                     const std::vector<TrackedObject>& objects,
                                     const RelationOptions& options) {
  const Box3d box = SolidBox(object.cluster);
  std::optional<std::pair<Support, int64_t>> best;
  for (const TrackedObject& other : objects) {
    if (other.id == object.id) continue;
    KeepBest(EdgeSupportOf(box, SolidBox(other.cluster), options.edge_gap_m, options), other.id,
             &best);
  }
  if (!best.has_value()) return std::nullopt;
  return best->second;
}

}  // namespace dsg::ingest
