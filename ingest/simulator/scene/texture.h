// SPDX-License-Identifier: Apache-2.0
// What colour a material has at a point of its surface, in metres: noise in octaves and patterns,
// each faded out before it gets finer than two pixels. Refuses to know cameras and light.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "ingest/simulator/scene/scene.h"

namespace dsg::simulator {

struct Surface {
  Material material = Material::kPlaster;
  /// 0 to 1.
  Eigen::Vector3f color = Eigen::Vector3f::Constant(0.5f);
  uint32_t seed = 0;
};

Surface MakeSurface(Material material, const Color& color, uint32_t seed);

/// Axis along which a face is seen when its texture is laid onto it: that of its normal's largest
/// part, 0 to 2.
int ProjectionAxis(const Eigen::Vector3f& normal);

/// Share of the light that comes back, red, green and blue. `axis` is ProjectionAxis of the face,
/// `footprint_m` the length that a pixel covers on the surface.
/// Cost: about 50 ns.
Eigen::Vector3f Albedo(const Surface& surface, const Eigen::Vector3f& point, int axis,
                       float footprint_m);

/// A number that looks random, of two numbers.
constexpr uint32_t Hash(uint32_t a, uint32_t b) {
  uint32_t h = a * 0x9e3779b1u ^ (b + 0x7f4a7c15u) * 0x85ebca6bu;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  h *= 0x297a2d39u;
  return h ^ (h >> 15);
}

}  // namespace dsg::simulator
