// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/collision_world.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "query/engine/collision/observation.h"
#include "query/engine/collision/obstacles.h"
#include "query/engine/collision/sweep.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Most bodies have something this near, and little is within it.
constexpr double kFirstReachM = 0.5;
// Longer or wider pieces of way would gather obstacles that they never come near.
constexpr double kLegM = 2.0;
constexpr double kLegRadians = 0.5;

}  // namespace

const char* ToString(ObstacleKind kind) {
  switch (kind) {
    case ObstacleKind::kNone:
      return "";
    case ObstacleKind::kObject:
      return "object";
    case ObstacleKind::kStructure:
      return "structure";
    case ObstacleKind::kMesh:
      return "mesh";
    case ObstacleKind::kAgent:
      return "agent";
    case ObstacleKind::kPredictedAgent:
      return "predicted_agent";
  }
  return "";
}

struct CollisionWorld::Impl {
  ObstacleFinder finder;
  Obstacles obstacles;

  absl::StatusOr<Contact> CheckOneLeg(const Body& body, const Pose3d& from, const Pose3d& to,
                                      const CollisionScope& scope, double best_m,
                                      const StopCheck& stop);
  absl::StatusOr<Contact> CheckWay(const Body& body, const CollisionScope& scope,
                                   const StopCheck& stop);
};

// Looks near first: further away there is more to look at.
absl::StatusOr<Contact> CollisionWorld::Impl::CheckOneLeg(const Body& body, const Pose3d& from,
                                                          const Pose3d& to,
                                                          const CollisionScope& scope,
                                                          double best_m, const StopCheck& stop) {
  const double wanted_m = std::min(scope.clearance_m_max, best_m);
  const Box3d bounds = BoundsOn(body, from, to);
  Leg leg{&body, from, to, &obstacles, &scope, &finder};
  leg.reach_m = std::min(wanted_m, scope.margin_m + kFirstReachM);
  while (true) {
    const Box3d region(bounds.min().array() - leg.reach_m, bounds.max().array() + leg.reach_m);
    DSG_RETURN_IF_ERROR(finder.Find(region, scope, stop, &obstacles));
    DSG_ASSIGN_OR_RETURN(const Contact contact, CheckLeg(leg, best_m, stop));
    if (contact.kind != ObstacleKind::kNone || leg.reach_m >= wanted_m) return contact;
    leg.reach_m = wanted_m;
  }
}

// The fraction of the answer counts in poses.
absl::StatusOr<Contact> CollisionWorld::Impl::CheckWay(const Body& body,
                                                       const CollisionScope& scope,
                                                       const StopCheck& stop) {
  Contact best;
  const size_t leg_count = std::max<size_t>(1, body.poses.size() - 1);
  for (size_t i = 0; i < leg_count; ++i) {
    const Pose3d& begin = body.poses[i];
    const Pose3d& end = body.poses[std::min(i + 1, body.poses.size() - 1)];
    const double parts =
        std::max({1.0, std::ceil((end.position - begin.position).norm() / kLegM),
                  std::ceil(AngleBetween(begin.orientation, end.orientation) / kLegRadians)});
    for (double part = 0.0; part < parts; part += 1.0) {
      const Pose3d from = part == 0.0 ? begin : Interpolate(begin, end, part / parts);
      const Pose3d to = part + 1.0 == parts ? end : Interpolate(begin, end, (part + 1.0) / parts);
      DSG_ASSIGN_OR_RETURN(Contact contact,
                           CheckOneLeg(body, from, to, scope, best.distance_m, stop));
      contact.fraction = static_cast<double>(i) + (part + contact.fraction) / parts;
      if (contact.hit) return contact;
      // Equal ones later on the way are not better.
      if (contact.distance_m < best.distance_m) best = contact;
    }
  }
  return best;
}

CollisionWorld CollisionWorld::Create(std::shared_ptr<const GraphView> view,
                                      std::shared_ptr<const Snapshot> snapshot,
                                      std::optional<TimeNs> at_ns, CollisionCache* cache) {
  DSG_CHECK(view->revision() == snapshot->revision());
  return CollisionWorld(std::unique_ptr<Impl>(
      new Impl{ObstacleFinder(std::move(view), std::move(snapshot), at_ns, cache), {}}));
}

CollisionWorld::CollisionWorld(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CollisionWorld::CollisionWorld(CollisionWorld&&) noexcept = default;
CollisionWorld& CollisionWorld::operator=(CollisionWorld&&) noexcept = default;
CollisionWorld::~CollisionWorld() = default;

absl::Status CollisionWorld::Ignore(NodeId node, const StopCheck& stop,
                                    CollisionScope* scope) const {
  constexpr int64_t kStopPeriod = 256;
  StopCounter counter(stop, kStopPeriod);
  absl::Status status;
  scope->ignored.insert(node);
  impl_->finder.view().ForEachDescendant(node, [&](const ViewNode& below) {
    scope->ignored.insert(below.id);
    status = counter.Check();
    return status.ok();
  });
  return status;
}

absl::StatusOr<CollisionHit> CollisionWorld::Check(const Body& body, const CollisionScope& scope,
                                                   const StopCheck& stop) {
  DSG_CHECK(!body.poses.empty() && scope.clearance_m_max > scope.margin_m);
  DSG_ASSIGN_OR_RETURN(const Contact contact, impl_->CheckWay(body, scope, stop));
  CollisionHit hit;
  hit.hit = contact.hit;
  hit.clearance_m = std::min(contact.distance_m, scope.clearance_m_max);
  hit.kind = contact.kind;
  hit.node = contact.node;
  hit.point_map = contact.point_map;
  if (contact.kind != ObstacleKind::kNone) hit.at_pose = contact.fraction;
  const bool is_of_map = contact.kind == ObstacleKind::kObject ||
                         contact.kind == ObstacleKind::kStructure ||
                         contact.kind == ObstacleKind::kMesh;
  const double until_pose = hit.hit ? hit.at_pose : static_cast<double>(body.poses.size());
  DSG_ASSIGN_OR_RETURN(
      hit.observed, Observation(&impl_->finder)
                        .IsObserved(body, until_pose, is_of_map ? &hit.point_map : nullptr, stop));
  return hit;
}

}  // namespace dsg::query
