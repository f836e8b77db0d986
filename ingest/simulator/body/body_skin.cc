// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/body_skin.h"

#include <cmath>
#include <initializer_list>
#include <numbers>

namespace dsg::simulator {
namespace {

/// Where a limb goes from its first ring to its last one, body at rest.
enum class Direction { kUp, kDown, kForward };

enum class GirthKind { kTrunk, kLimb, kHead, kExtremity };

/// A cross-section: an ellipse about a point between two joints; no radius = the end of a limb.
struct Ring {
  int from = 0;
  int to = 0;
  double along = 0.0;
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();
  /// Half axis along y.
  double width_m = 0.0;
  /// The other half axis: x, of feet z.
  double depth_m = 0.0;
  SkinBinding binding;
};

struct Limb {
  Direction direction = Direction::kUp;
  GirthKind girth = GirthKind::kLimb;
  int segment_count = 12;
  std::vector<Ring> rings;

  bool IsEnd(size_t i) const { return i == 0 || i + 1 == rings.size(); }
};

SkinBinding Bind(int joint, int second = 0, double weight = 0.0) {
  return {static_cast<uint8_t>(joint), static_cast<uint8_t>(second), weight};
}

// A ring between two joints; round unless it has a depth of its own.
Ring Between(int from, int to, double along, double width_m, double depth_m,
             const SkinBinding& binding) {
  return {from, to, along, Eigen::Vector3d::Zero(), width_m, depth_m, binding};
}

Ring Round(int from, int to, double along, double radius_m, const SkinBinding& binding) {
  return Between(from, to, along, radius_m, radius_m, binding);
}

Limb Trunk() {
  Limb limb = {Direction::kUp, GirthKind::kTrunk, 28, {}};
  constexpr double kPelvisToNeckM = 0.51;
  const auto add = [&limb](double z, double width, double depth, const SkinBinding& binding) {
    limb.rings.push_back(Between(0, 12, z / kPelvisToNeckM, width, depth, binding));
  };
  add(-0.15, 0.0, 0.0, Bind(0));
  add(-0.13, 0.085, 0.075, Bind(0));
  add(-0.07, 0.155, 0.112, Bind(0));
  add(0.0, 0.168, 0.115, Bind(0));
  add(0.07, 0.158, 0.106, Bind(0, 3, 0.4));
  add(0.15, 0.142, 0.100, Bind(3, 6, 0.2));
  add(0.23, 0.148, 0.106, Bind(3, 6, 0.6));
  add(0.31, 0.160, 0.114, Bind(9, 6, 0.3));
  add(0.39, 0.168, 0.114, Bind(9));
  add(0.43, 0.176, 0.100, Bind(9));
  add(0.465, 0.160, 0.082, Bind(9));
  add(0.50, 0.090, 0.066, Bind(9, 12, 0.3));
  add(0.525, 0.0, 0.0, Bind(9, 12, 0.5));
  return limb;
}

Limb Neck() {
  Limb limb = {Direction::kUp, GirthKind::kHead, 12, {}};
  limb.rings = {Round(12, 15, -0.55, 0.0, Bind(9)), Round(12, 15, -0.5, 0.060, Bind(9, 12, 0.3)),
                Round(12, 15, 0.2, 0.054, Bind(12)), Round(12, 15, 1.0, 0.054, Bind(12, 15, 0.5)),
                Round(12, 15, 1.1, 0.0, Bind(15))};
  return limb;
}

Limb Head() {
  Limb limb = {Direction::kUp, GirthKind::kHead, 18, {}};
  constexpr int kRingCount = 11;
  constexpr double kHalfHeightM = 0.12;
  for (int i = 0; i <= kRingCount; ++i) {
    const double angle = std::numbers::pi * i / kRingCount;
    const double round = i == 0 || i == kRingCount ? 0.0 : std::sin(angle);
    // The chin is narrower than the skull.
    const double width = round * (0.072 - 0.010 * std::cos(angle));
    const Eigen::Vector3d shift(0.02, 0.0, 0.05 - kHalfHeightM * std::cos(angle));
    limb.rings.push_back({15, 15, 0.0, shift, width, 0.095 * round, Bind(15)});
  }
  return limb;
}

Limb ArmOf(int side) {
  const int collar = 13 + side;
  const int shoulder = 16 + side;
  const int elbow = 18 + side;
  const int wrist = 20 + side;
  Limb limb = {Direction::kDown, GirthKind::kLimb, 14, {}};
  const auto upper = [&](double along, double radius, int second, double weight) {
    limb.rings.push_back(Round(shoulder, elbow, along, radius, Bind(shoulder, second, weight)));
  };
  const auto lower = [&](double along, double radius, int second, double weight) {
    limb.rings.push_back(Round(elbow, wrist, along, radius, Bind(elbow, second, weight)));
  };
  upper(-0.16, 0.0, collar, 0.6);
  upper(-0.13, 0.034, collar, 0.6);
  upper(-0.02, 0.058, collar, 0.4);
  upper(0.18, 0.056, collar, 0.15);
  upper(0.45, 0.048, elbow, 0.0);
  upper(0.75, 0.043, elbow, 0.0);
  upper(0.92, 0.040, elbow, 0.25);
  upper(1.0, 0.040, elbow, 0.5);
  lower(0.09, 0.041, shoulder, 0.25);
  lower(0.3, 0.042, wrist, 0.0);
  lower(0.6, 0.035, wrist, 0.0);
  lower(0.95, 0.027, wrist, 0.2);
  lower(1.02, 0.0, wrist, 0.5);
  return limb;
}

Limb HandOf(int side) {
  const int wrist = 20 + side;
  const int hand = 22 + side;
  Limb limb = {Direction::kDown, GirthKind::kExtremity, 12, {}};
  limb.rings = {Between(wrist, hand, -0.2, 0.0, 0.0, Bind(wrist)),
                Between(wrist, hand, -0.1, 0.020, 0.026, Bind(wrist)),
                Between(wrist, hand, 0.4, 0.021, 0.038, Bind(wrist)),
                Between(wrist, hand, 0.9, 0.020, 0.044, Bind(hand, wrist, 0.4)),
                Between(wrist, hand, 1.4, 0.016, 0.040, Bind(hand)),
                Between(wrist, hand, 1.9, 0.012, 0.030, Bind(hand)),
                Between(wrist, hand, 2.05, 0.0, 0.0, Bind(hand))};
  return limb;
}

Limb LegOf(int side) {
  const int hip = 1 + side;
  const int knee = 4 + side;
  const int ankle = 7 + side;
  Limb limb = {Direction::kDown, GirthKind::kLimb, 18, {}};
  const auto upper = [&](double along, double radius, int second, double weight) {
    limb.rings.push_back(Round(hip, knee, along, radius, Bind(hip, second, weight)));
  };
  const auto lower = [&](double along, double radius, int second, double weight) {
    limb.rings.push_back(Round(knee, ankle, along, radius, Bind(knee, second, weight)));
  };
  upper(-0.20, 0.0, 0, 0.6);
  upper(-0.14, 0.062, 0, 0.6);
  upper(0.0, 0.084, 0, 0.4);
  upper(0.18, 0.086, 0, 0.15);
  upper(0.42, 0.078, knee, 0.0);
  upper(0.72, 0.066, knee, 0.0);
  upper(0.92, 0.056, knee, 0.25);
  upper(1.0, 0.054, knee, 0.5);
  lower(0.08, 0.052, hip, 0.25);
  lower(0.25, 0.056, ankle, 0.0);
  lower(0.42, 0.053, ankle, 0.0);
  lower(0.7, 0.041, ankle, 0.0);
  lower(0.93, 0.034, ankle, 0.0);
  lower(1.03, 0.035, ankle, 0.5);
  lower(1.1, 0.0, ankle, 0.5);
  return limb;
}

Limb FootOf(int side) {
  const int ankle = 7 + side;
  const int toes = 10 + side;
  Limb limb = {Direction::kForward, GirthKind::kExtremity, 14, {}};
  const auto add = [&](double x, double half_height, double width, const SkinBinding& binding) {
    // The sole is flat on the floor; the ends are half way up.
    const double above = half_height > 0.0 ? half_height : 0.018;
    limb.rings.push_back({ankle, ankle, 0.0, Eigen::Vector3d(x, 0.0, above - kAnkleHeightM), width,
                          half_height, binding});
  };
  add(-0.07, 0.0, 0.0, Bind(ankle));
  add(-0.055, 0.030, 0.026, Bind(ankle));
  add(-0.02, 0.042, 0.035, Bind(ankle));
  add(0.03, 0.044, 0.036, Bind(ankle));
  add(0.08, 0.033, 0.042, Bind(ankle));
  add(0.13, 0.023, 0.046, Bind(ankle, toes, 0.5));
  add(0.175, 0.017, 0.036, Bind(toes));
  add(0.20, 0.0, 0.0, Bind(toes));
  return limb;
}

const std::vector<Limb>& Limbs() {
  static const std::vector<Limb> limbs = {Trunk(),  Neck(),    Head(),    ArmOf(0),
                                          ArmOf(1), HandOf(0), HandOf(1), LegOf(0),
                                          LegOf(1), FootOf(0), FootOf(1)};
  return limbs;
}

void AddFaces(const Limb& limb, uint32_t first, std::vector<std::array<uint32_t, 3>>* faces) {
  const uint32_t n = static_cast<uint32_t>(limb.segment_count);
  const uint32_t ring_count = static_cast<uint32_t>(limb.rings.size()) - 2;
  const uint32_t last = first + 1 + ring_count * n;
  const auto vertex = [&](uint32_t ring, uint32_t k) { return first + 1 + ring * n + k % n; };
  for (uint32_t k = 0; k < n; ++k) {
    faces->push_back({first, vertex(0, k + 1), vertex(0, k)});
    for (uint32_t ring = 0; ring + 1 < ring_count; ++ring) {
      faces->push_back({vertex(ring, k), vertex(ring, k + 1), vertex(ring + 1, k + 1)});
      faces->push_back({vertex(ring, k), vertex(ring + 1, k + 1), vertex(ring + 1, k)});
    }
    faces->push_back({vertex(ring_count - 1, k), vertex(ring_count - 1, k + 1), last});
  }
}

SkinTopology MakeTopology() {
  SkinTopology topology;
  for (const Limb& limb : Limbs()) {
    AddFaces(limb, static_cast<uint32_t>(topology.bindings.size()), &topology.faces);
    for (size_t i = 0; i < limb.rings.size(); ++i) {
      const int count = limb.IsEnd(i) ? 1 : limb.segment_count;
      topology.bindings.insert(topology.bindings.end(), count, limb.rings[i].binding);
    }
  }
  return topology;
}

/// Factors of the half axes along y and along the other axis.
Eigen::Vector2d GirthOf(GirthKind kind, const Girths& girths) {
  switch (kind) {
    case GirthKind::kTrunk:
      return {girths.trunk_width, girths.trunk_depth};
    case GirthKind::kLimb:
      return {girths.limb, girths.limb};
    case GirthKind::kHead:
      return {girths.head, girths.head};
    case GirthKind::kExtremity:
      break;
  }
  // Feet keep their height, so that soles stay on the floor.
  return {girths.extremity, 1.0};
}

// Axes of a ring whose cross product points along the limb, so that faces wind outwards.
std::array<Eigen::Vector3d, 2> RingAxes(Direction direction, double width, double depth) {
  const Eigen::Vector3d across = width * Eigen::Vector3d::UnitY();
  if (direction == Direction::kUp) return {depth * Eigen::Vector3d::UnitX(), across};
  if (direction == Direction::kDown) return {across, depth * Eigen::Vector3d::UnitX()};
  return {across, depth * Eigen::Vector3d::UnitZ()};
}

}  // namespace

const SkinTopology& SkinTopologyOfAll() {
  static const SkinTopology topology = MakeTopology();
  return topology;
}

std::vector<Eigen::Vector3d> RestVertices(
    const std::array<Eigen::Vector3d, ingest::kJointCount>& rest_joints, const Girths& girths,
    double scale) {
  std::vector<Eigen::Vector3d> vertices;
  for (const Limb& limb : Limbs()) {
    const Eigen::Vector2d girth = scale * GirthOf(limb.girth, girths);
    // A bigger head is also higher, and wider hands and feet keep their length.
    const double length = limb.girth == GirthKind::kHead ? girth.x() : scale;
    for (size_t i = 0; i < limb.rings.size(); ++i) {
      const Ring& ring = limb.rings[i];
      const Eigen::Vector3d middle = (1.0 - ring.along) * rest_joints[ring.from] +
                                     ring.along * rest_joints[ring.to] + length * ring.shift_m;
      if (limb.IsEnd(i)) {
        vertices.push_back(middle);
        continue;
      }
      const auto [a, b] =
          RingAxes(limb.direction, girth.x() * ring.width_m, girth.y() * ring.depth_m);
      for (int k = 0; k < limb.segment_count; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / limb.segment_count;
        vertices.push_back(middle + std::cos(angle) * a + std::sin(angle) * b);
      }
    }
  }
  return vertices;
}

}  // namespace dsg::simulator
