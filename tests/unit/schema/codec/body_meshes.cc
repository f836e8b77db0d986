// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/schema/codec/body_meshes.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>
#include <string>

namespace dsg::test {
namespace {

constexpr size_t kBodyVertexCount = 13'380;
constexpr size_t kSampleCount = 6890;

// Turns y and z of a point about an axis along x through (y, z) = (0, height).
void Swing(float angle, float height, float* point) {
  const float y = point[1];
  const float z = point[2] - height;
  point[1] = std::cos(angle) * y - std::sin(angle) * z;
  point[2] = std::sin(angle) * y + std::cos(angle) * z + height;
}

float Between(float low, float high, std::mt19937_64* random) {
  return low + (high - low) * static_cast<float>((*random)() % 1'000'001) * 1e-6f;
}

}  // namespace

std::vector<float> RealBody() {
  const char* folder = std::getenv("DSG_DATA");
  const std::string root = folder != nullptr ? folder : DSG_SOURCE_DIR "/../shared/data";
  std::ifstream stream(root + "/human-body/makehuman_base.obj");
  std::vector<float> all;
  for (std::string line; all.size() < 3 * kBodyVertexCount && std::getline(stream, line);) {
    std::istringstream words(line);
    std::string kind;
    float x = 0, y = 0, z = 0;
    // The file has decimetres and y up.
    if (words >> kind >> x >> y >> z && kind == "v") {
      for (const float metres : {0.1f * x, -0.1f * z, 0.1f * y - 0.07f}) all.push_back(metres);
    }
  }
  std::vector<float> body;
  for (size_t i = 0; i < kSampleCount && all.size() == 3 * kBodyVertexCount; ++i) {
    const size_t from = i * kBodyVertexCount / kSampleCount;
    for (size_t axis = 0; axis < 3; ++axis) body.push_back(all[3 * from + axis]);
  }
  return body;
}

std::vector<float> MadeBody(size_t vertex_count) {
  constexpr size_t kRing = 65;
  std::vector<float> body;
  for (size_t i = 0; i < vertex_count; ++i) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(i % kRing) / kRing;
    const double height =
        1.8 * static_cast<double>(i / kRing) * kRing / static_cast<double>(vertex_count);
    const double radius = 0.2 + 0.05 * std::sin(9.0 * height);
    body.push_back(static_cast<float>(radius * std::cos(angle)));
    body.push_back(static_cast<float>(0.7 * radius * std::sin(angle)));
    body.push_back(static_cast<float>(height - 0.9));
  }
  return body;
}

std::vector<float> Shuffled(const std::vector<float>& numbers, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<float> shuffled = numbers;
  for (size_t i = shuffled.size() / 3; i > 1; --i) {
    const size_t other = random() % i;
    for (size_t axis = 0; axis < 3; ++axis) {
      std::swap(shuffled[3 * (i - 1) + axis], shuffled[3 * other + axis]);
    }
  }
  return shuffled;
}

std::vector<float> Walking(const std::vector<float>& rest, int step) {
  const float phase = 1.4f * static_cast<float>(step);
  std::vector<float> body = rest;
  for (size_t i = 0; i < body.size(); i += 3) {
    float* point = &body[i];
    const float side = point[0] > 0 ? 1.0f : -1.0f;
    if (std::abs(point[0]) > 0.22f) Swing(0.5f * side * std::sin(phase), 0.5f, point);
    if (point[2] < -0.05f) Swing(-0.45f * side * std::sin(phase), -0.05f, point);
    const float turn = 0.05f * std::sin(phase);
    const float x = point[0];
    point[0] = x - turn * point[1];
    point[1] += turn * x;
    point[2] += 0.02f * std::abs(std::sin(phase));
  }
  return body;
}

BodyShape AnyCoefficients(TimeNs time_ns, uint64_t seed) {
  std::mt19937_64 random(seed);
  BodyShape shape;
  shape.time_ns = time_ns;
  for (int i = 0; i < 72; ++i) shape.pose_coefficients.push_back(Between(-3.2f, 3.2f, &random));
  for (int i = 0; i < 10; ++i) shape.shape_coefficients.push_back(Between(-5.0f, 5.0f, &random));
  for (int i = 0; i < 72; ++i) shape.joints.push_back(Between(-1.0f, 1.0f, &random));
  return shape;
}

}  // namespace dsg::test
