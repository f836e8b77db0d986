// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/light.h"

#include <algorithm>
#include <cmath>

namespace dsg::simulator {
namespace {

using Eigen::Vector3f;

// Darker towards a wall at `distance`, unless the surface is that wall itself.
float Corner(float distance, float normal_part) {
  constexpr float kReachM = 0.4f;
  return 1.0f -
         0.32f * std::exp(-std::max(distance, 0.0f) / kReachM) * (1.0f - std::abs(normal_part));
}

// What faces down gets light back from the floor, more of it high up.
float Ambient(const Vector3f& point, const Vector3f& normal) {
  if (normal.z() >= 0.0f) return 0.9f;
  const float high = std::clamp((point.z() - 1.2f) / 1.0f, 0.0f, 1.0f);
  return 0.9f + normal.z() * (0.5f - 0.9f * high);
}

}  // namespace

float LightAt(const RoomLight& light, const Vector3f& point_map, const Vector3f& normal) {
  float sum = light.ambient * Ambient(point_map, normal);
  for (const Vector3f& lamp : light.lamps_map) {
    const Vector3f way = lamp - point_map;
    const float square = std::max(way.squaredNorm(), 0.25f);
    if (square > 64.0f) continue;
    const float facing = normal.dot(way);
    if (facing <= 0.0f || way.z() <= 0.0f) continue;
    sum += light.strength * facing * way.z() / (square * square);
  }
  const Eigen::Vector2f low = light.interior.min().cast<float>();
  const Eigen::Vector2f high = light.interior.max().cast<float>();
  sum *= Corner(std::min(point_map.x() - low.x(), high.x() - point_map.x()), normal.x());
  sum *= Corner(std::min(point_map.y() - low.y(), high.y() - point_map.y()), normal.y());
  sum *= Corner(std::min(point_map.z(), light.ceiling_m - point_map.z()), normal.z());
  return std::min(sum, 1.1f);
}

float EvenLight(const Vector3f& normal) { return 0.7f + 0.15f * normal.z() + 0.1f * normal.x(); }

const RoomLight* FindLight(const std::vector<RoomLight>& lights, const Vector3f& point_map) {
  const Point at = point_map.head<2>().cast<double>();
  for (const RoomLight& light : lights) {
    if (light.interior.exteriorDistance(at) <= kHalfWallM) return &light;
  }
  return nullptr;
}

}  // namespace dsg::simulator
