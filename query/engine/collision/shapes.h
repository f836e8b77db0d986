// SPDX-License-Identifier: Apache-2.0
// Shapes of collision questions: points, segments, triangles and boxes with their distances in
// closed form; triangles under a tree of boxes; and bodies at a pose or on their way.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "schema/model/geometry.h"

namespace dsg::query {

/// A convex set of 1 (point), 2 (segment), 3 (triangle) or 8 corners (box). Triangles and segments
/// may be degenerate.
struct Convex {
  int corner_count = 1;
  std::array<Eigen::Vector3d, 8> corners;
  /// Of boxes only: columns of `axes` are unit vectors along its edges.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  /// Bounds of the corners.
  Box3d bounds;
};

Convex MakePoint(const Eigen::Vector3d& point);
Convex MakeSegment(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
Convex MakeTriangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);
/// Requires: the box is not empty.
Convex MakeBox(const Pose3d& map_T_box, const Box3d& box);

struct ClosestPair {
  double distance_m = 0.0;
  /// Where they are nearest; a common point if they touch.
  Eigen::Vector3d on_first = Eigen::Vector3d::Zero();
  Eigen::Vector3d on_second = Eigen::Vector3d::Zero();
};

/// 0 if they touch or one holds the other.
ClosestPair Distance(const Convex& first, const Convex& second);

/// The nearest point of `set`; the point itself if inside.
Eigen::Vector3d NearestPoint(const Convex& set, const Eigen::Vector3d& point);

/// 0 if they touch.
double DistanceBetween(const Box3d& first, const Box3d& second);

/// The smallest fraction of the way from `from` to `to` at which a point is within `reach_m` of
/// `set`. Requires: it is so somewhere on the way.
double FirstWithin(const Convex& set, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                   double reach_m);

/// A reach below zero ends a walk over a tree.
inline constexpr double kEndWalk = -1.0;

/// Triangles under a tree of boxes. It does not know whose they are or which of them count.
///
/// Threads: immutable.
class TriangleTree {
 public:
  TriangleTree() = default;
  /// Requires: faces name vertices; vertices are finite. Cost: n log n.
  TriangleTree(std::vector<Eigen::Vector3f> vertices, std::vector<std::array<uint32_t, 3>> faces);

  bool empty() const { return faces_.empty(); }
  int face_count() const { return static_cast<int>(faces_.size()); }
  const std::vector<Eigen::Vector3f>& vertices() const { return vertices_; }
  /// In an order of its own; `source_face` says which one of those given it was.
  const std::array<uint32_t, 3>& face(int index) const {
    return faces_[static_cast<size_t>(index)];
  }
  uint32_t source_face(int index) const { return source_[static_cast<size_t>(index)]; }
  Convex Triangle(int index) const;
  Convex Triangle(int index, const Pose3d& map_T_mesh) const;
  /// Empty if there are no triangles.
  const Box3d& bounds() const { return bounds_; }
  size_t memory_bytes() const;

  /// A box of the tree over faces [first, first + count) if count > 0, else over two other boxes.
  struct TreeNode {
    Eigen::AlignedBox3f box;
    /// Of its faces, or of the second of its boxes; the first one follows it.
    int32_t first = 0;
    int32_t count = 0;
  };
  const std::vector<TreeNode>& nodes() const { return nodes_; }

  /// Calls `visit(index)` for each triangle whose box is at most `*reach_m`, which may shrink
  /// meanwhile, away from `box`. In a fixed order.
  template <typename Visit>
  void ForEachNear(const Box3d& box, const double* reach_m, Visit&& visit) const;
  /// The same where the tree's frame stands at `map_T_mesh` and `box_map` in the map.
  template <typename Visit>
  void ForEachNear(const Pose3d& map_T_mesh, const Box3d& box_map, const double* reach_m,
                   Visit&& visit) const;

 private:
  template <typename LowerBound, typename Visit>
  void Walk(const LowerBound& lower_bound_m, const double* reach_m, Visit&& visit) const;

  std::vector<Eigen::Vector3f> vertices_;
  std::vector<std::array<uint32_t, 3>> faces_;
  std::vector<uint32_t> source_;
  std::vector<TreeNode> nodes_;
  Box3d bounds_;
};

/// Calls `visit(index, other_index)` for each pair of triangles whose boxes are at most `*reach_m`
/// apart, where `moving` stands at `map_T_moving` and `fixed` in the map. Asks `go_on()` for each
/// pair of boxes, of which there are many more than of visits where nothing is near; false ends it.
template <typename GoOn, typename Visit>
void ForEachNearPair(const TriangleTree& moving, const Pose3d& map_T_moving,
                     const TriangleTree& fixed, const double* reach_m, GoOn&& go_on, Visit&& visit);

template <typename LowerBound, typename Visit>
void TriangleTree::Walk(const LowerBound& lower_bound_m, const double* reach_m,
                        Visit&& visit) const {
  if (nodes_.empty()) return;
  // Deep enough for 2^32 triangles in halves.
  std::array<std::pair<int32_t, double>, 64> stack;
  size_t size = 0;
  stack[size++] = {0, lower_bound_m(nodes_[0].box)};
  while (size > 0) {
    const auto [index, bound_m] = stack[--size];
    if (bound_m > *reach_m) continue;
    const TreeNode& node = nodes_[static_cast<size_t>(index)];
    if (node.count > 0) {
      for (int32_t i = 0; i < node.count; ++i) visit(node.first + i);
      continue;
    }
    std::pair<int32_t, double> near{index + 1,
                                    lower_bound_m(nodes_[static_cast<size_t>(index) + 1].box)};
    std::pair<int32_t, double> far{node.first,
                                   lower_bound_m(nodes_[static_cast<size_t>(node.first)].box)};
    if (far.second < near.second) std::swap(near, far);
    stack[size++] = far;
    stack[size++] = near;
  }
}

template <typename Visit>
void TriangleTree::ForEachNear(const Box3d& box, const double* reach_m, Visit&& visit) const {
  Walk([&](const Eigen::AlignedBox3f& other) { return DistanceBetween(box, other.cast<double>()); },
       reach_m, visit);
}

template <typename Visit>
void TriangleTree::ForEachNear(const Pose3d& map_T_mesh, const Box3d& box_map,
                               const double* reach_m, Visit&& visit) const {
  Walk(
      [&](const Eigen::AlignedBox3f& other) {
        return DistanceBetween(box_map, TransformBox(map_T_mesh, other.cast<double>()));
      },
      reach_m, visit);
}

template <typename GoOn, typename Visit>
void ForEachNearPair(const TriangleTree& moving, const Pose3d& map_T_moving,
                     const TriangleTree& fixed, const double* reach_m, GoOn&& go_on,
                     Visit&& visit) {
  if (moving.empty() || fixed.empty()) return;
  struct Pair {
    int32_t moving;
    int32_t fixed;
    double bound_m;
  };
  const auto bound_m = [&](int32_t m, int32_t f) {
    const Box3d box = moving.nodes()[static_cast<size_t>(m)].box.template cast<double>();
    return DistanceBetween(TransformBox(map_T_moving, box),
                           fixed.nodes()[static_cast<size_t>(f)].box.template cast<double>());
  };
  std::vector<Pair> stack = {{0, 0, bound_m(0, 0)}};
  while (!stack.empty()) {
    const Pair pair = stack.back();
    stack.pop_back();
    if (!go_on()) return;
    if (pair.bound_m > *reach_m) continue;
    const TriangleTree::TreeNode& m = moving.nodes()[static_cast<size_t>(pair.moving)];
    const TriangleTree::TreeNode& f = fixed.nodes()[static_cast<size_t>(pair.fixed)];
    if (m.count > 0 && f.count > 0) {
      for (int32_t i = 0; i < m.count; ++i) {
        for (int32_t k = 0; k < f.count; ++k) visit(m.first + i, f.first + k);
      }
      continue;
    }
    // The larger one is opened, so that both shrink alike.
    const bool open_moving =
        f.count > 0 || (m.count == 0 && m.box.sizes().squaredNorm() > f.box.sizes().squaredNorm());
    Pair near = open_moving ? Pair{pair.moving + 1, pair.fixed, 0.0}
                            : Pair{pair.moving, pair.fixed + 1, 0.0};
    Pair far = open_moving ? Pair{m.first, pair.fixed, 0.0} : Pair{pair.moving, f.first, 0.0};
    near.bound_m = bound_m(near.moving, near.fixed);
    far.bound_m = bound_m(far.moving, far.fixed);
    if (far.bound_m < near.bound_m) std::swap(near, far);
    stack.push_back(far);
    stack.push_back(near);
  }
}

/// A shape in its own frame. All numbers finite; sizes and radii positive, lengths not negative.
struct Body {
  enum class Kind { kSphere, kCuboid, kCapsule, kMesh };
  Kind kind = Kind::kSphere;
  /// Of spheres and capsules.
  double radius_m = 0.0;
  /// Edges of cuboids, centred.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  /// Of the axis of capsules, along z, centred.
  double length_m = 0.0;
  /// Of meshes: a surface without inside.
  std::shared_ptr<const TriangleTree> mesh;
  /// map_T_body, at least one. Several: along straight lines, orientations interpolated.
  std::vector<Pose3d> poses;
};

/// A sphere that moves from point to point. Requires: at least one point, a positive radius.
Body SweptSphere(double radius_m, const std::vector<Eigen::Vector3d>& points_map);

}  // namespace dsg::query
