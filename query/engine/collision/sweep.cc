// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "absl/status/status.h"
#include "schema/base/status.h"
#include "schema/store/snapshot.h"

namespace dsg::query {
namespace {

class Patience {
 public:
  /// `stop` outlives it.
  explicit Patience(const StopCheck& stop) : stop_(stop) {}

  /// To be called at each pair of shapes, which takes a few microseconds at most. False for good
  /// once it must stop.
  bool GoOn() {
    if (++count_ % kAskEvery == 0 && stop_ && status_.ok()) status_ = stop_();
    return status_.ok();
  }
  /// What `stop` returned.
  const absl::Status& status() const { return status_; }

 private:
  static constexpr int64_t kAskEvery = 256;

  const StopCheck& stop_;
  int64_t count_ = 0;
  absl::Status status_;
};

using Eigen::Vector3d;

// No contact deeper than this is missed on the way of a body that is followed by steps.
constexpr double kStepM = 1e-4;
// How much too large the clearance of such a body may be.
constexpr double kClearanceErrorM = 5e-3;
constexpr double kClearanceErrorShare = 0.05;
// More than distances are wrong by.
constexpr double kRoundingM = 1e-9;

// A body at one pose: everything within `radius_m` of a convex core or of a mesh.
struct PosedBody {
  const TriangleTree* mesh = nullptr;
  Pose3d map_T_body;
  Convex core;
  double radius_m = 0.0;
  Box3d bounds;
};

Vector3d HalfAxis(const Body& body) { return {0.0, 0.0, 0.5 * body.length_m}; }

PosedBody At(const Body& body, const Pose3d& map_T_body) {
  PosedBody posed;
  posed.map_T_body = map_T_body;
  switch (body.kind) {
    case Body::Kind::kSphere:
      posed.core = MakePoint(map_T_body.position);
      posed.radius_m = body.radius_m;
      break;
    case Body::Kind::kCapsule:
      posed.core = MakeSegment(map_T_body * -HalfAxis(body), map_T_body * HalfAxis(body));
      posed.radius_m = body.radius_m;
      break;
    case Body::Kind::kCuboid:
      posed.core = MakeBox(map_T_body, Box3d(-0.5 * body.size, 0.5 * body.size));
      break;
    case Body::Kind::kMesh:
      posed.mesh = body.mesh.get();
      posed.bounds = TransformBox(map_T_body, body.mesh->bounds());
      return posed;
  }
  posed.bounds = posed.core.bounds;
  return posed;
}

// Points of the body's frame whose hull, grown by the radius, holds the body.
std::array<Vector3d, 8> Extremes(const Body& body) {
  Box3d box(Vector3d::Zero().eval());
  if (body.kind == Body::Kind::kCapsule) box = Box3d(-HalfAxis(body), HalfAxis(body));
  if (body.kind == Body::Kind::kCuboid) box = Box3d(-0.5 * body.size, 0.5 * body.size);
  if (body.kind == Body::Kind::kMesh) box = body.mesh->bounds();
  std::array<Vector3d, 8> extremes;
  for (int i = 0; i < 8; ++i) {
    extremes[static_cast<size_t>(i)] = box.corner(static_cast<Box3d::CornerType>(i));
  }
  return extremes;
}

// How far the rotation alone moves any point of the body.
double TurnM(const Body& body, const Pose3d& from, const Pose3d& to) {
  const double angle = AngleBetween(from.orientation, to.orientation);
  if (body.kind == Body::Kind::kSphere || angle == 0.0) return 0.0;
  const Vector3d axis = (from.orientation.conjugate() * to.orientation).vec().normalized();
  double arm_m = 0.0;
  for (const Vector3d& extreme : Extremes(body)) {
    arm_m = std::max(arm_m, axis.cross(extreme).norm());
  }
  return angle * arm_m;
}

// Keeps the nearest obstacle of a body that stands still.
class Nearest {
 public:
  Nearest(const Leg& leg, const PosedBody& body, double distance_m_max, const StopCheck& stop)
      : leg_(leg), body_(body), patience_(stop), reach_m_(distance_m_max + body.radius_m) {
    limit_m_ = distance_m_max;
  }

  absl::StatusOr<Contact> Find() {
    for (const Obstacle& solid : leg_.obstacles->solids) LookAt(solid);
    for (const auto& piece : leg_.obstacles->pieces) LookAt(*piece);
    DSG_RETURN_IF_ERROR(patience_.status());
    return best_;
  }

 private:
  void LookAt(const Obstacle& solid) {
    if (!patience_.GoOn()) return;
    const double lower_m = DistanceBetween(body_.bounds, solid.shape.bounds);
    if (lower_m > reach_m_ + solid.radius_m) return;
    const auto keep = [&](const ClosestPair& pair) {
      const double core_m = std::max(0.0, pair.distance_m - solid.radius_m);
      Vector3d point = pair.on_second;
      // On the surface of a rounded obstacle.
      if (solid.radius_m > 0.0 && pair.distance_m > solid.radius_m) {
        point += (pair.on_first - pair.on_second) * (solid.radius_m / pair.distance_m);
      }
      Keep(core_m, point, {solid.kind, solid.node});
    };
    if (body_.mesh == nullptr) {
      keep(Distance(body_.core, solid.shape));
      return;
    }
    double reach_m = reach_m_ + solid.radius_m;
    body_.mesh->ForEachNear(body_.map_T_body, solid.shape.bounds, &reach_m, [&](int face) {
      keep(Distance(body_.mesh->Triangle(face, body_.map_T_body), solid.shape));
      reach_m = patience_.GoOn() ? reach_m_ + solid.radius_m : kEndWalk;
    });
  }

  void LookAt(const MeshPiece& piece) {
    if (!patience_.GoOn()) reach_m_ = kEndWalk;
    const auto look_at = [&](const Convex& mine, int face) {
      const Convex triangle = piece.tree.Triangle(face);
      if (DistanceBetween(mine.bounds, triangle.bounds) > reach_m_) return;
      const ClosestPair pair = Distance(mine, triangle);
      if (pair.distance_m > reach_m_) return;
      const std::optional<FaceOwner> owner =
          leg_.finder->OwnerOf(*leg_.obstacles, *leg_.scope, piece, face, triangle);
      if (owner.has_value()) Keep(pair.distance_m, pair.on_second, *owner);
    };
    if (body_.mesh == nullptr) {
      piece.tree.ForEachNear(body_.bounds, &reach_m_, [&](int face) {
        look_at(body_.core, face);
        if (!patience_.GoOn()) reach_m_ = kEndWalk;
      });
      return;
    }
    ForEachNearPair(
        *body_.mesh, body_.map_T_body, piece.tree, &reach_m_, [&] { return patience_.GoOn(); },
        [&](int mine, int face) {
          // A leaf holds several; the walk itself ends at its next pair of boxes.
          if (patience_.GoOn()) look_at(body_.mesh->Triangle(mine, body_.map_T_body), face);
        });
  }

  void Keep(double core_m, const Vector3d& point_map, const FaceOwner& owner) {
    Contact contact;
    contact.distance_m = std::max(0.0, core_m - body_.radius_m);
    if (contact.distance_m > limit_m_) return;
    contact.kind = owner.kind;
    contact.node = owner.node;
    contact.point_map = point_map;
    if (!IsNearer(contact, best_)) return;
    best_ = contact;
    limit_m_ = contact.distance_m;
    // Rounded, the sum may be less than the core's distance: others as near would be passed over.
    reach_m_ = contact.distance_m + body_.radius_m + kRoundingM;
  }

  const Leg& leg_;
  const PosedBody& body_;
  Patience patience_;
  // Nothing further from the body, or from its core, matters any more.
  double limit_m_ = 0.0;
  double reach_m_;
  Contact best_;
};

absl::StatusOr<Contact> NearestAt(const Leg& leg, double fraction, double distance_m_max,
                                  const StopCheck& stop) {
  const PosedBody body = At(*leg.body, Interpolate(leg.from, leg.to, fraction));
  DSG_ASSIGN_OR_RETURN(Contact contact, Nearest(leg, body, distance_m_max, stop).Find());
  contact.fraction = fraction;
  contact.hit = contact.distance_m <= leg.scope->margin_m;
  return contact;
}

// The first obstacle that a sphere comes within the margin of; some one it does.
absl::StatusOr<Contact> FirstOfSphere(const Leg& leg, const StopCheck& stop) {
  const Vector3d& from = leg.from.position;
  const Vector3d& to = leg.to.position;
  const double near_m = leg.body->radius_m + leg.scope->margin_m;
  Contact first;
  first.fraction = std::numeric_limits<double>::infinity();
  const auto keep = [&](const Convex& shape, double radius_m, const FaceOwner& owner) {
    const ClosestPair pass = Distance(MakeSegment(from, to), shape);
    if (pass.distance_m > near_m + radius_m) return;
    const double fraction = FirstWithin(shape, from, to, near_m + radius_m);
    Contact contact;
    contact.fraction = fraction;
    contact.kind = owner.kind;
    contact.node = owner.node;
    const Vector3d center = from + fraction * (to - from);
    contact.point_map = NearestPoint(shape, center);
    const double distance_m = (contact.point_map - center).norm();
    if (radius_m > 0.0 && distance_m > radius_m) {
      contact.point_map += (center - contact.point_map) * (radius_m / distance_m);
    }
    contact.distance_m = std::max(0.0, distance_m - radius_m - leg.body->radius_m);
    contact.hit = true;
    // As near means as early here.
    Contact order_a = contact;
    Contact order_b = first;
    order_a.distance_m = contact.fraction;
    order_b.distance_m = first.fraction;
    if (IsNearer(order_a, order_b)) first = contact;
  };
  Patience patience(stop);
  for (const Obstacle& solid : leg.obstacles->solids) {
    if (!patience.GoOn()) break;
    keep(solid.shape, solid.radius_m, {solid.kind, solid.node});
  }
  Box3d way(from);
  way.extend(to);
  for (const auto& piece : leg.obstacles->pieces) {
    double walk_m = patience.GoOn() ? near_m : kEndWalk;
    piece->tree.ForEachNear(way, &walk_m, [&](int face) {
      const Convex triangle = piece->tree.Triangle(face);
      const auto owner = leg.finder->OwnerOf(*leg.obstacles, *leg.scope, *piece, face, triangle);
      if (owner.has_value()) keep(triangle, 0.0, *owner);
      if (!patience.GoOn()) walk_m = kEndWalk;
    });
  }
  DSG_RETURN_IF_ERROR(patience.status());
  return first;
}

absl::StatusOr<Contact> CheckSphere(const Leg& leg, double best_m, const StopCheck& stop) {
  const double limit_m = std::min(best_m, leg.reach_m);
  const Vector3d way = leg.to.position - leg.from.position;
  const double squared = way.squaredNorm();
  if (squared == 0.0) return NearestAt(leg, 0.0, limit_m, stop);
  PosedBody swept;
  swept.core = MakeSegment(leg.from.position, leg.to.position);
  swept.radius_m = leg.body->radius_m;
  swept.bounds = swept.core.bounds;
  DSG_ASSIGN_OR_RETURN(Contact pass, Nearest(leg, swept, limit_m, stop).Find());
  if (pass.distance_m <= leg.scope->margin_m) {
    DSG_ASSIGN_OR_RETURN(const Contact start, NearestAt(leg, 0.0, limit_m, stop));
    if (start.hit) return start;
    return FirstOfSphere(leg, stop);
  }
  if (pass.kind != ObstacleKind::kNone) {
    pass.fraction = std::clamp((pass.point_map - leg.from.position).dot(way) / squared, 0.0, 1.0);
  }
  return pass;
}

}  // namespace

bool IsNearer(const Contact& a, const Contact& b) {
  if (a.distance_m != b.distance_m) return a.distance_m < b.distance_m;
  return a.node.value - 1 < b.node.value - 1;
}

double TravelM(const Body& body, const Pose3d& from, const Pose3d& to) {
  return (to.position - from.position).norm() + TurnM(body, from, to);
}

Box3d BoundsOn(const Body& body, const Pose3d& from, const Pose3d& to) {
  const PosedBody begin = At(body, from);
  Box3d bounds = begin.bounds;
  bounds.extend(At(body, to).bounds);
  const double grow_m = begin.radius_m + TurnM(body, from, to);
  return Box3d(bounds.min().array() - grow_m, bounds.max().array() + grow_m);
}

absl::StatusOr<Contact> CheckLeg(const Leg& leg, double best_m, const StopCheck& stop) {
  if (stop) DSG_RETURN_IF_ERROR(stop());
  if (leg.body->kind == Body::Kind::kSphere) return CheckSphere(leg, best_m, stop);
  const double travel_m = TravelM(*leg.body, leg.from, leg.to);
  const double margin_m = leg.scope->margin_m;
  Contact best;
  double fraction = 0.0;
  while (true) {
    DSG_ASSIGN_OR_RETURN(const Contact here, NearestAt(leg, fraction, leg.reach_m, stop));
    if (here.hit) return here;
    if (here.distance_m < std::min(best.distance_m, best_m)) best = here;
    if (fraction == 1.0 || travel_m == 0.0) break;
    // Nothing comes nearer faster than the body moves.
    const double free_m = std::min(here.distance_m, leg.reach_m);
    const double known_m = std::min({best.distance_m, best_m, leg.reach_m});
    const double error_m = std::max(kClearanceErrorM, kClearanceErrorShare * known_m);
    const double step_m = std::min(free_m - margin_m, free_m - known_m + error_m);
    fraction = std::min(1.0, fraction + std::max(step_m, kStepM) / travel_m);
    if (stop) DSG_RETURN_IF_ERROR(stop());
  }
  return best;
}

}  // namespace dsg::query
