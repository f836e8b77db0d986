// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace dsg::simulator {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kTurn = 2.0f * std::numbers::pi_v<float>;

Vector3f At(const Point& point, double z_m) {
  return Eigen::Vector3d(point.x(), point.y(), z_m).cast<float>();
}

// Corner of a box of half size `half`, pulled in by `cut` on all axes but `axis`.
Vector3f CutCorner(const Vector3f& half, float cut, int axis, const Vector3f& signs) {
  Vector3f corner = half - Vector3f::Constant(cut);
  corner[axis] = half[axis];
  return corner.cwiseProduct(signs);
}

void AddFacing(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d,
               const Vector3f& center, TriangleMesh* mesh) {
  const Vector3f normal = (b - a).cross(c - a);
  const bool is_outward = normal.dot(0.25f * (a + b + c + d)) > 0.0f;
  if (is_outward) {
    AddQuad(center + a, center + b, center + c, center + d, mesh);
  } else {
    AddQuad(center + d, center + c, center + b, center + a, mesh);
  }
}

void AddCutEdges(const Vector3f& center, const Vector3f& half, float cut, TriangleMesh* mesh) {
  for (int axis = 0; axis < 3; ++axis) {
    const int other = (axis + 1) % 3;
    const int along = (axis + 2) % 3;
    for (const float s : {-1.0f, 1.0f}) {
      for (const float t : {-1.0f, 1.0f}) {
        Vector3f low = Vector3f::Zero();
        low[axis] = s;
        low[other] = t;
        Vector3f high = low;
        low[along] = -1.0f;
        high[along] = 1.0f;
        AddFacing(CutCorner(half, cut, axis, low), CutCorner(half, cut, axis, high),
                  CutCorner(half, cut, other, high), CutCorner(half, cut, other, low), center,
                  mesh);
      }
    }
  }
}

void AddCutCorners(const Vector3f& center, const Vector3f& half, float cut, TriangleMesh* mesh) {
  for (int i = 0; i < 8; ++i) {
    const Vector3f signs((i & 1) != 0 ? 1.0f : -1.0f, (i & 2) != 0 ? 1.0f : -1.0f,
                         (i & 4) != 0 ? 1.0f : -1.0f);
    std::array<Vector3f, 3> corners;
    for (int axis = 0; axis < 3; ++axis) {
      corners[axis] = center + CutCorner(half, cut, axis, signs);
    }
    if (signs.prod() < 0.0f) std::swap(corners[1], corners[2]);
    AddTriangle(corners[0], corners[1], corners[2], mesh);
  }
}

}  // namespace

void AddTriangle(const Vector3f& a, const Vector3f& b, const Vector3f& c, TriangleMesh* mesh) {
  const uint32_t first = static_cast<uint32_t>(mesh->vertices.size());
  mesh->vertices.insert(mesh->vertices.end(), {a, b, c});
  mesh->faces.push_back({first, first + 1, first + 2});
}

void AddQuad(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d,
             TriangleMesh* mesh) {
  const uint32_t first = static_cast<uint32_t>(mesh->vertices.size());
  mesh->vertices.insert(mesh->vertices.end(), {a, b, c, d});
  mesh->faces.push_back({first, first + 1, first + 2});
  mesh->faces.push_back({first, first + 2, first + 3});
}

void AddBox(const Vector3f& min, const Vector3f& max, TriangleMesh* mesh) {
  AddCutBox(min, max, 0.0f, mesh);
}

void AddCutBox(const Vector3f& min, const Vector3f& max, float cut, TriangleMesh* mesh) {
  const Vector3f center = 0.5f * (min + max);
  const Vector3f half = 0.5f * (max - min);
  cut = std::min(cut, 0.45f * half.minCoeff());
  for (int axis = 0; axis < 3; ++axis) {
    for (const float s : {-1.0f, 1.0f}) {
      std::array<Vector3f, 4> corners;
      for (int i = 0; i < 4; ++i) {
        Vector3f signs;
        signs[axis] = s;
        signs[(axis + 1) % 3] = i == 0 || i == 3 ? -1.0f : 1.0f;
        signs[(axis + 2) % 3] = i < 2 ? -1.0f : 1.0f;
        corners[i] = CutCorner(half, cut, axis, signs);
      }
      AddFacing(corners[0], corners[1], corners[2], corners[3], center, mesh);
    }
  }
  if (cut <= 0.0f) return;
  AddCutEdges(center, half, cut, mesh);
  AddCutCorners(center, half, cut, mesh);
}

void AddBlock(const Rect& rect, double low_m, double high_m, TriangleMesh* mesh) {
  AddBox(At(rect.min(), low_m), At(rect.max(), high_m), mesh);
}

void AddUpright(const Point& from, const Point& to, double low_m, double high_m,
                const Point& normal, TriangleMesh* mesh) {
  const Point way = to - from;
  const bool keeps = way.y() * normal.x() - way.x() * normal.y() > 0.0;
  const Point& a = keeps ? from : to;
  const Point& b = keeps ? to : from;
  AddQuad(At(a, low_m), At(b, low_m), At(b, high_m), At(a, high_m), mesh);
}

void AddLevel(const Rect& rect, double z_m, bool faces_up, TriangleMesh* mesh) {
  const Vector3f a = At(rect.min(), z_m);
  const Vector3f b = At({rect.max().x(), rect.min().y()}, z_m);
  const Vector3f c = At(rect.max(), z_m);
  const Vector3f d = At({rect.min().x(), rect.max().y()}, z_m);
  if (faces_up) {
    AddQuad(a, b, c, d, mesh);
  } else {
    AddQuad(d, c, b, a, mesh);
  }
}

void AddTurned(const std::vector<Vector2f>& profile, const Vector3f& base, const Vector2f& stretch,
               int side_count, TriangleMesh* mesh) {
  const auto at = [&](const Vector2f& point, int side) {
    const float angle =
        kTurn * static_cast<float>(side % side_count) / static_cast<float>(side_count);
    return Vector3f(base + Vector3f(point.x() * std::cos(angle) * stretch.x(),
                                    point.x() * std::sin(angle) * stretch.y(), point.y()));
  };
  for (size_t i = 0; i + 1 < profile.size(); ++i) {
    const Vector2f& low = profile[i];
    const Vector2f& high = profile[i + 1];
    for (int side = 0; side < side_count; ++side) {
      if (low.x() <= 0.0f) {
        AddTriangle(at(low, side), at(high, side + 1), at(high, side), mesh);
      } else if (high.x() <= 0.0f) {
        AddTriangle(at(low, side), at(low, side + 1), at(high, side), mesh);
      } else {
        AddQuad(at(low, side), at(low, side + 1), at(high, side + 1), at(high, side), mesh);
      }
    }
  }
}

void AddCylinder(const Vector3f& base, float radius, float height, int side_count,
                 TriangleMesh* mesh) {
  AddTurned({{0.0f, 0.0f}, {radius, 0.0f}, {radius, height}, {0.0f, height}}, base,
            Vector2f::Ones(), side_count, mesh);
}

void AddLeaf(const Vector3f& from, float yaw, float reach, float rise, float width,
             TriangleMesh* mesh) {
  const Vector3f out(std::cos(yaw), std::sin(yaw), 0.0f);
  const Vector3f side(-std::sin(yaw), std::cos(yaw), 0.0f);
  const Vector3f up = Vector3f::UnitZ();
  const Vector3f middle = from + 0.5f * reach * out + rise * up;
  const Vector3f tip = from + reach * out + 0.7f * rise * up;
  const Vector3f left = middle + 0.5f * width * side - 0.1f * width * up;
  const Vector3f right = middle - 0.5f * width * side - 0.1f * width * up;
  AddTriangle(from, right, middle, mesh);
  AddTriangle(from, middle, left, mesh);
  AddTriangle(middle, right, tip, mesh);
  AddTriangle(middle, tip, left, mesh);
}

void Transform(const Eigen::Affine3f& transform, TriangleMesh* mesh) {
  for (Vector3f& vertex : mesh->vertices) vertex = transform * vertex;
}

void Subdivide(float length_max, TriangleMesh* mesh) {
  const float square_max = length_max * length_max;
  for (size_t face = 0; face < mesh->faces.size();) {
    std::array<uint32_t, 3> corners = mesh->faces[face];
    float longest = 0.0f;
    int at = 0;
    for (int i = 0; i < 3; ++i) {
      const float square =
          (mesh->vertices[corners[(i + 1) % 3]] - mesh->vertices[corners[i]]).squaredNorm();
      if (square > longest) {
        longest = square;
        at = i;
      }
    }
    if (longest <= square_max) {
      ++face;
      continue;
    }
    std::rotate(corners.begin(), corners.begin() + at, corners.end());
    const uint32_t middle = static_cast<uint32_t>(mesh->vertices.size());
    const Vector3f point = 0.5f * (mesh->vertices[corners[0]] + mesh->vertices[corners[1]]);
    mesh->vertices.push_back(point);
    mesh->faces[face] = {corners[0], middle, corners[2]};
    mesh->faces.push_back({middle, corners[1], corners[2]});
  }
}

Eigen::AlignedBox3f BoundsOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3f bounds;
  for (const Vector3f& vertex : mesh.vertices) bounds.extend(vertex);
  return bounds;
}

}  // namespace dsg::simulator
