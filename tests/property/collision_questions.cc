// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "tests/property/question.h"

namespace dsg::test {
namespace {

using Eigen::Vector3d;

/// A box anywhere, or a body around it.
struct Solid {
  Vector3d center = Vector3d::Zero();
  /// Columns are its axes.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Vector3d half = Vector3d::Zero();
  /// Grown by this much.
  double radius_m = 0.0;
};

Solid BoxAt(const Pose3d& map_T_box, const Box3d& box) {
  if (box.isEmpty()) return {map_T_box.position};
  return {map_T_box * box.center(), map_T_box.orientation.toRotationMatrix(), 0.5 * box.sizes()};
}

Vector3d Corner(const Solid& box, int i) {
  const Vector3d sign((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
  return box.center + box.axes * sign.cwiseProduct(box.half);
}

double DistanceToSolid(const Vector3d& point, const Solid& box) {
  const Vector3d local = box.axes.transpose() * (point - box.center);
  return (local.cwiseAbs() - box.half).cwiseMax(0.0).norm();
}

// Boxes are apart if they are along a normal of either or a product of edges.
bool AreApart(const Solid& a, const Solid& b) {
  std::vector<Vector3d> directions;
  for (int i = 0; i < 3; ++i) {
    directions.insert(directions.end(), {a.axes.col(i), b.axes.col(i)});
    for (int j = 0; j < 3; ++j) directions.push_back(a.axes.col(i).cross(b.axes.col(j)));
  }
  const auto reach = [](const Solid& box, const Vector3d& direction) {
    return (box.axes.transpose() * direction).cwiseAbs().dot(box.half);
  };
  return std::any_of(directions.begin(), directions.end(), [&](const Vector3d& direction) {
    const double between = std::abs(direction.dot(a.center - b.center));
    return between > reach(a, direction) + reach(b, direction) + 1e-12;
  });
}

double DistanceToSegment(const Vector3d& point, const Vector3d& a, const Vector3d& b) {
  const Vector3d along = b - a;
  const double squared = along.squaredNorm();
  if (squared == 0.0) return (point - a).norm();
  return (point - a - std::clamp((point - a).dot(along) / squared, 0.0, 1.0) * along).norm();
}

double SegmentDistance(const Vector3d& p0, const Vector3d& p1, const Vector3d& q0,
                       const Vector3d& q1) {
  const Vector3d u = p1 - p0;
  const Vector3d v = q1 - q0;
  const Vector3d w = p0 - q0;
  double nearest_m = std::min({DistanceToSegment(p0, q0, q1), DistanceToSegment(p1, q0, q1),
                               DistanceToSegment(q0, p0, p1), DistanceToSegment(q1, p0, p1)});
  const double denominator = u.squaredNorm() * v.squaredNorm() - std::pow(u.dot(v), 2);
  if (denominator <= 1e-12) return nearest_m;
  const double s = (u.dot(v) * v.dot(w) - v.squaredNorm() * u.dot(w)) / denominator;
  const double t = (u.squaredNorm() * v.dot(w) - u.dot(v) * u.dot(w)) / denominator;
  if (s < 0 || s > 1 || t < 0 || t > 1) return nearest_m;
  return std::min(nearest_m, (w + s * u - t * v).norm());
}

double BoxDistance(const Solid& a, const Solid& b) {
  if (!AreApart(a, b)) return 0.0;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8; ++i) {
    nearest_m =
        std::min({nearest_m, DistanceToSolid(Corner(a, i), b), DistanceToSolid(Corner(b, i), a)});
  }
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) {
      for (int m = 1; m < 8; m *= 2) {
        for (int n = 1; n < 8; n *= 2) {
          if ((i & m) != 0 || (j & n) != 0) continue;
          nearest_m = std::min(nearest_m, SegmentDistance(Corner(a, i), Corner(a, i | m),
                                                          Corner(b, j), Corner(b, j | n)));
        }
      }
    }
  }
  return nearest_m;
}

struct CollisionQuestion {
  Solid body;
  bool is_sphere = true;
  bool objects = false;
  bool structures = false;
  bool agents = false;
  bool ignore_floor = false;
  NodeId ignored;
  double margin_m = 0.0;
  double clearance_m_max = 2.0;
  std::optional<TimeNs> at_ns;
};

// Nothing that is asked about is further from a solid than its grown core.
double Distance(const CollisionQuestion& question, const Solid& solid) {
  const double core_m = question.is_sphere ? DistanceToSolid(question.body.center, solid)
                                           : BoxDistance(question.body, solid);
  return std::max(0.0, core_m - solid.radius_m - question.body.radius_m);
}

std::optional<Solid> SolidOf(const NaiveMap& map, const CollisionQuestion& question,
                             const Node& node) {
  if (node.layer == layers::kAgents) {
    if (!question.agents) return std::nullopt;
    const auto at = LocateNaively(map, node.id, *question.at_ns);
    if (!at.has_value() || at->quality == v1::IN_GAP) return std::nullopt;
    // An upright capsule 1.7 m high.
    return Solid{at->map_T_agent.position, Eigen::Matrix3d::Identity(), {0, 0, 0.55}, 0.3};
  }
  const bool is_there =
      question.at_ns.has_value() ? Holds(node.valid, question.at_ns) : node.valid.to_ns == kTimeMax;
  if (!is_there) return std::nullopt;
  const bool is_asked = (node.layer == layers::kObjects && question.objects) ||
                        (node.layer == layers::kStructures && question.structures &&
                         !(question.ignore_floor && node.structure->structure_type == "floor"));
  if (!is_asked) return std::nullopt;
  return BoxAt(node.map_T_node, node.box_node);
}

ComparedAnswer ScanCollision(const NaiveMap& map, const CollisionQuestion& question) {
  std::set<NodeId> ignored = {question.ignored};
  if (!question.ignored.empty()) {
    const auto below = AllBelow(map, question.ignored);
    ignored.insert(below.begin(), below.end());
  }
  double best_m = std::numeric_limits<double>::infinity();
  NodeId nearest;
  for (const auto& [id, node] : map.nodes) {
    if (ignored.contains(id)) continue;
    const auto solid = SolidOf(map, question, node);
    if (!solid.has_value()) continue;
    const double distance_m = Distance(question, *solid);
    // Copies of one thing are equally far; ids ascend.
    if (distance_m >= best_m - 1e-10) continue;
    best_m = distance_m;
    nearest = id;
  }
  return {{best_m > question.clearance_m_max ? "nothing" : ToString(nearest),
           best_m <= question.margin_m ? "hit" : "free"},
          {std::min(best_m, question.clearance_m_max)}};
}

CollisionQuestion AnyCollision(const NaiveMap& map, Random* random) {
  CollisionQuestion question;
  question.is_sphere = random->Chance(0.6);
  question.body.center = AnyPoint(map, random);
  if (question.is_sphere) {
    question.body.radius_m = random->Uniform(0.02, 1.0);
  } else {
    // Off the grid: there, two things as far as each other differ by how the distance is rounded.
    question.body.center += Vector3d(random->Uniform(), random->Uniform(), random->Uniform()) / 8.0;
    question.body.half =
        Vector3d(random->Uniform(0.02, 1), random->Uniform(0.02, 1), random->Uniform(0.02, 1));
    if (random->Chance(0.7)) {
      question.body.axes = Eigen::Quaterniond(random->Uniform(0.1, 1), random->Uniform(-1, 1),
                                              random->Uniform(-1, 1), random->Uniform(-1, 1))
                               .normalized()
                               .toRotationMatrix();
    }
  }
  if (random->Chance(0.6)) question.at_ns = AnyTime(map, random);
  question.objects = random->Chance(0.7);
  question.structures = random->Chance(0.5) || !question.objects;
  question.agents = question.is_sphere && question.at_ns.has_value() && random->Chance(0.4);
  if (question.agents && random->Chance(0.7)) {
    const auto at = LocateNaively(map, RandomWorld::Person(random->Index(RandomWorld::kPeople)),
                                  *question.at_ns);
    if (at.has_value()) question.body.center = at->map_T_agent.position + Vector3d(0.5, 0, 1.5);
  }
  question.ignore_floor = random->Chance(0.3);
  if (random->Chance(0.2)) question.ignored = AnyNode(map, random);
  if (random->Chance(0.3)) question.margin_m = random->Uniform(0.01, 0.9);
  question.clearance_m_max = question.margin_m + random->Uniform(0.1, 20);
  return question;
}

v1::CheckCollisionRequest CollisionRequestOf(const CollisionQuestion& question) {
  v1::CheckCollisionRequest request;
  request.set_map(QuestionWorld::kMap);
  v1::CollisionBody* body = request.add_bodies();
  v1::Pose* pose = body->add_poses();
  SetPoint(question.body.center, pose->mutable_position());
  if (question.is_sphere) {
    body->mutable_sphere()->set_radius_m(question.body.radius_m);
  } else {
    SetPoint(2.0 * question.body.half, body->mutable_cuboid()->mutable_size());
    const Eigen::Quaterniond q(question.body.axes);
    pose->mutable_orientation()->set_x(q.x());
    pose->mutable_orientation()->set_y(q.y());
    pose->mutable_orientation()->set_z(q.z());
    pose->mutable_orientation()->set_w(q.w());
  }
  v1::CollisionScope* scope = request.mutable_scope();
  scope->set_objects(question.objects);
  scope->set_structures(question.structures);
  scope->set_agents(question.agents);
  scope->set_ignore_floor(question.ignore_floor);
  if (!question.ignored.empty()) scope->add_ignored(ToString(question.ignored));
  if (question.at_ns.has_value()) request.set_at_ns(*question.at_ns);
  request.set_margin_m(question.margin_m);
  request.set_clearance_m_max(question.clearance_m_max);
  return request;
}

Question MakeCollision(const QuestionWorld& world, Random* random) {
  const Revision revision = world.AnyRevision(random);
  const NaiveMap& map = world.At(revision);
  const CollisionQuestion question = AnyCollision(map, random);
  const v1::CheckCollisionRequest request = CollisionRequestOf(question);
  Question made;
  made.text = request.ShortDebugString();
  made.tolerance = question.agents && !world.is_lossless() ? 3e-4 : 1e-7;
  made.scan = [&map, question] { return ScanCollision(map, question); };
  made.ask = [request, revision](Asker* asker) {
    v1::CheckCollisionRequest asked = request;
    *asked.mutable_read_at() = asker->ReadAt(revision);
    v1::CheckCollisionResponse reply;
    const absl::Status status = asker->core()->CheckCollision(asker->call, asked, &reply);
    if (!status.ok()) return ErrorAnswer(status);
    const v1::CollisionResult& result = reply.results(0);
    return ComparedAnswer{
        {result.what().empty() ? "nothing" : result.node_id(), result.hit() ? "hit" : "free"},
        {result.clearance_m()}};
  };
  return made;
}

}  // namespace

std::vector<QuestionKind> CollisionQuestions() { return {{"collision", MakeCollision}}; }

}  // namespace dsg::test
