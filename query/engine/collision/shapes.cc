// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

namespace dsg::query {
namespace {

using Eigen::Vector3d;

struct CornerPair {
  int from;
  int to;
};

// Corner i of a box has bit k of i set on the high side of axis k.
constexpr CornerPair kBoxEdges[] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
                                    {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
constexpr CornerPair kTriangleEdges[] = {{0, 1}, {1, 2}, {2, 0}};

std::span<const CornerPair> EdgesOf(const Convex& set) {
  if (set.corner_count == 8) return kBoxEdges;
  if (set.corner_count == 3) return kTriangleEdges;
  return {kTriangleEdges, set.corner_count == 2 ? size_t{1} : size_t{0}};
}

void SetBounds(Convex* set) {
  for (int i = 0; i < set->corner_count; ++i) set->bounds.extend(set->corners[i]);
}

Vector3d NearestOnSegment(const Vector3d& a, const Vector3d& b, const Vector3d& point) {
  const Vector3d along = b - a;
  const double squared = along.squaredNorm();
  if (squared == 0.0) return a;
  return a + std::clamp(along.dot(point - a) / squared, 0.0, 1.0) * along;
}

// The nearest of the three edges.
Vector3d NearestOnOutline(const Convex& triangle, const Vector3d& point) {
  Vector3d nearest = triangle.corners[0];
  double nearest_squared = std::numeric_limits<double>::infinity();
  for (const CornerPair& edge : kTriangleEdges) {
    const Vector3d candidate =
        NearestOnSegment(triangle.corners[edge.from], triangle.corners[edge.to], point);
    const double squared = (candidate - point).squaredNorm();
    if (squared >= nearest_squared) continue;
    nearest_squared = squared;
    nearest = candidate;
  }
  return nearest;
}

// The point's projection if that lies inside, else the nearest of the edges.
Vector3d NearestOnTriangle(const Convex& triangle, const Vector3d& point) {
  const Vector3d& a = triangle.corners[0];
  const Vector3d ab = triangle.corners[1] - a;
  const Vector3d ac = triangle.corners[2] - a;
  const Vector3d ap = point - a;
  const Vector3d normal = ab.cross(ac);
  const double squared = normal.squaredNorm();
  if (squared > 0.0) {
    const double toward_c = ab.cross(ap).dot(normal);
    const double toward_b = ap.cross(ac).dot(normal);
    if (toward_c >= 0.0 && toward_b >= 0.0 && toward_c + toward_b <= squared) {
      return point - normal * (ap.dot(normal) / squared);
    }
  }
  return NearestOnOutline(triangle, point);
}

Vector3d NearestInBox(const Convex& box, const Vector3d& point) {
  const Vector3d local = box.axes.transpose() * (point - box.center);
  const Vector3d clamped = local.cwiseMax(-box.half).cwiseMin(box.half);
  return clamped == local ? point : Vector3d(box.center + box.axes * clamped);
}

void Keep(const Vector3d& on_first, const Vector3d& on_second, ClosestPair* best) {
  const double distance_m = (on_first - on_second).norm();
  if (distance_m < best->distance_m) *best = {distance_m, on_first, on_second};
}

// Source: Ericson, Real-Time Collision Detection (2005), section 5.1.9.
void KeepOfSegments(const Vector3d& p, const Vector3d& p_end, const Vector3d& q,
                    const Vector3d& q_end, ClosestPair* best) {
  const Vector3d d1 = p_end - p;
  const Vector3d d2 = q_end - q;
  const Vector3d r = p - q;
  const double a = d1.squaredNorm();
  const double e = d2.squaredNorm();
  if (a == 0.0 || e == 0.0) {
    Keep(NearestOnSegment(p, p_end, q), q, best);
    Keep(p, NearestOnSegment(q, q_end, p), best);
    return;
  }
  const double b = d1.dot(d2);
  const double c = d1.dot(r);
  const double f = d2.dot(r);
  const double denominator = a * e - b * b;
  double s = denominator > 0.0 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
  const double t = std::clamp((b * s + f) / e, 0.0, 1.0);
  s = std::clamp((b * t - c) / a, 0.0, 1.0);
  Keep(p + s * d1, q + t * d2, best);
}

// Where a segment enters a box; nullopt if it does not.
std::optional<Vector3d> EnterBox(const Convex& box, const Vector3d& from, const Vector3d& to) {
  const Vector3d local = box.axes.transpose() * (from - box.center);
  const Vector3d along = box.axes.transpose() * (to - from);
  double enter = 0.0;
  double leave = 1.0;
  for (int k = 0; k < 3; ++k) {
    if (along[k] == 0.0) {
      if (std::abs(local[k]) > box.half[k]) return std::nullopt;
      continue;
    }
    const double one = (-box.half[k] - local[k]) / along[k];
    const double two = (box.half[k] - local[k]) / along[k];
    enter = std::max(enter, std::min(one, two));
    leave = std::min(leave, std::max(one, two));
  }
  if (enter > leave) return std::nullopt;
  return Vector3d(from + enter * (to - from));
}

// Where a segment goes through a triangle; those in its plane touch its edges, which are looked at
// anyway.
std::optional<Vector3d> CrossTriangle(const Convex& triangle, const Vector3d& from,
                                      const Vector3d& to) {
  const Vector3d& a = triangle.corners[0];
  const Vector3d ab = triangle.corners[1] - a;
  const Vector3d ac = triangle.corners[2] - a;
  const Vector3d normal = ab.cross(ac);
  const double before = normal.dot(from - a);
  const double after = normal.dot(to - a);
  if (before == after || (before > 0.0) == (after > 0.0)) return std::nullopt;
  const Vector3d point = from + before / (before - after) * (to - from);
  const Vector3d ap = point - a;
  const double toward_c = ab.cross(ap).dot(normal);
  const double toward_b = ap.cross(ac).dot(normal);
  if (toward_c < 0.0 || toward_b < 0.0 || toward_c + toward_b > normal.squaredNorm()) {
    return std::nullopt;
  }
  return point;
}

// Two sets of which neither is a point touch if and only if an edge of one meets the other.
std::optional<Vector3d> CommonPoint(const Convex& first, const Convex& second) {
  if (second.corner_count < 3) return std::nullopt;
  for (const CornerPair& edge : EdgesOf(first)) {
    const Vector3d& from = first.corners[edge.from];
    const Vector3d& to = first.corners[edge.to];
    const std::optional<Vector3d> point =
        second.corner_count == 8 ? EnterBox(second, from, to) : CrossTriangle(second, from, to);
    if (point.has_value()) return point;
  }
  return std::nullopt;
}

}  // namespace

Convex MakePoint(const Vector3d& point) {
  Convex set;
  set.corner_count = 1;
  set.corners[0] = point;
  SetBounds(&set);
  return set;
}

Convex MakeSegment(const Vector3d& from, const Vector3d& to) {
  Convex set;
  set.corner_count = 2;
  set.corners[0] = from;
  set.corners[1] = to;
  SetBounds(&set);
  return set;
}

Convex MakeTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  Convex set;
  set.corner_count = 3;
  set.corners[0] = a;
  set.corners[1] = b;
  set.corners[2] = c;
  SetBounds(&set);
  return set;
}

Convex MakeBox(const Pose3d& map_T_box, const Box3d& box) {
  Convex set;
  set.corner_count = 8;
  set.center = map_T_box * box.center();
  set.axes = map_T_box.orientation.toRotationMatrix();
  set.half = 0.5 * box.sizes();
  for (int i = 0; i < 8; ++i) {
    const Vector3d side((i & 1) != 0 ? 1.0 : -1.0, (i & 2) != 0 ? 1.0 : -1.0,
                        (i & 4) != 0 ? 1.0 : -1.0);
    set.corners[i] = set.center + set.axes * side.cwiseProduct(set.half);
  }
  SetBounds(&set);
  return set;
}

Vector3d NearestPoint(const Convex& set, const Vector3d& point) {
  switch (set.corner_count) {
    case 1:
      return set.corners[0];
    case 2:
      return NearestOnSegment(set.corners[0], set.corners[1], point);
    case 3:
      return NearestOnTriangle(set, point);
    default:
      return NearestInBox(set, point);
  }
}

ClosestPair Distance(const Convex& first, const Convex& second) {
  ClosestPair best;
  best.distance_m = std::numeric_limits<double>::infinity();
  for (int i = 0; i < first.corner_count; ++i) {
    Keep(first.corners[i], NearestPoint(second, first.corners[i]), &best);
  }
  if (first.corner_count == 1) return best;
  for (int i = 0; i < second.corner_count; ++i) {
    Keep(NearestPoint(first, second.corners[i]), second.corners[i], &best);
  }
  if (second.corner_count == 1 || best.distance_m == 0.0) return best;
  std::optional<Vector3d> common = CommonPoint(first, second);
  if (!common.has_value()) common = CommonPoint(second, first);
  if (common.has_value()) return {0.0, *common, *common};
  for (const CornerPair& one : EdgesOf(first)) {
    for (const CornerPair& two : EdgesOf(second)) {
      KeepOfSegments(first.corners[one.from], first.corners[one.to], second.corners[two.from],
                     second.corners[two.to], &best);
    }
  }
  return best;
}

double DistanceBetween(const Box3d& first, const Box3d& second) {
  const Vector3d gap =
      (first.min() - second.max()).cwiseMax(second.min() - first.max()).cwiseMax(0.0);
  return gap.norm();
}

double FirstWithin(const Convex& set, const Vector3d& from, const Vector3d& to, double reach_m) {
  const auto distance_m = [&](double fraction) {
    const Vector3d point = from + fraction * (to - from);
    return (NearestPoint(set, point) - point).norm();
  };
  if (distance_m(0.0) <= reach_m) return 0.0;
  // The distance to a convex set is convex along a line: it falls up to the nearest pass.
  const ClosestPair pass = Distance(MakeSegment(from, to), set);
  const double squared = (to - from).squaredNorm();
  if (squared == 0.0) return 0.0;
  double low = 0.0;
  double high = std::clamp((pass.on_first - from).dot(to - from) / squared, 0.0, 1.0);
  for (int i = 0; i < 60 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    (distance_m(middle) <= reach_m ? high : low) = middle;
  }
  return high;
}

namespace {

using Faces = std::vector<std::array<uint32_t, 3>>;

// Few, since each costs as much to look at as several boxes.
constexpr size_t kFacesPerLeaf = 4;

// Splits faces at the median of the longest side, down to leaves.
class TreeBuilder {
 public:
  TreeBuilder(const std::vector<Eigen::Vector3f>& vertices, const Faces& faces)
      : order_(faces.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    boxes_.reserve(faces.size());
    for (const std::array<uint32_t, 3>& face : faces) {
      Eigen::AlignedBox3f box;
      for (const uint32_t vertex : face) box.extend(vertices[vertex]);
      boxes_.push_back(box);
    }
    if (!order_.empty()) Build(0, order_.size());
  }

  const std::vector<uint32_t>& order() const { return order_; }
  std::vector<TriangleTree::TreeNode>& nodes() { return nodes_; }

 private:
  void Build(size_t begin, size_t end) {
    const size_t index = nodes_.size();
    nodes_.emplace_back();
    Eigen::AlignedBox3f box;
    Eigen::AlignedBox3f centers;
    for (size_t i = begin; i < end; ++i) {
      box.extend(boxes_[order_[i]]);
      centers.extend(boxes_[order_[i]].center());
    }
    nodes_[index].box = box;
    if (end - begin <= kFacesPerLeaf) {
      nodes_[index].first = static_cast<int32_t>(begin);
      nodes_[index].count = static_cast<int32_t>(end - begin);
      return;
    }
    int axis = 0;
    centers.sizes().maxCoeff(&axis);
    const auto first = order_.begin() + static_cast<ptrdiff_t>(begin);
    const auto middle = first + static_cast<ptrdiff_t>((end - begin) / 2);
    const auto last = order_.begin() + static_cast<ptrdiff_t>(end);
    std::nth_element(first, middle, last, [&](uint32_t a, uint32_t b) {
      const float a_at = boxes_[a].center()[axis];
      const float b_at = boxes_[b].center()[axis];
      return a_at != b_at ? a_at < b_at : a < b;
    });
    const size_t split = static_cast<size_t>(middle - order_.begin());
    Build(begin, split);
    nodes_[index].first = static_cast<int32_t>(nodes_.size());
    Build(split, end);
  }

  std::vector<uint32_t> order_;
  std::vector<Eigen::AlignedBox3f> boxes_;
  std::vector<TriangleTree::TreeNode> nodes_;
};

}  // namespace

TriangleTree::TriangleTree(std::vector<Eigen::Vector3f> vertices, Faces faces)
    : vertices_(std::move(vertices)) {
  TreeBuilder builder(vertices_, faces);
  source_ = builder.order();
  faces_.reserve(faces.size());
  for (const uint32_t face : source_) faces_.push_back(faces[face]);
  nodes_ = std::move(builder.nodes());
  if (!nodes_.empty()) bounds_ = nodes_[0].box.cast<double>();
}

Convex TriangleTree::Triangle(int index) const {
  const std::array<uint32_t, 3>& corners = face(index);
  return MakeTriangle(vertices_[corners[0]].cast<double>(), vertices_[corners[1]].cast<double>(),
                      vertices_[corners[2]].cast<double>());
}

Convex TriangleTree::Triangle(int index, const Pose3d& map_T_mesh) const {
  const std::array<uint32_t, 3>& corners = face(index);
  return MakeTriangle(map_T_mesh * vertices_[corners[0]].cast<double>(),
                      map_T_mesh * vertices_[corners[1]].cast<double>(),
                      map_T_mesh * vertices_[corners[2]].cast<double>());
}

size_t TriangleTree::memory_bytes() const {
  return sizeof(*this) + vertices_.capacity() * sizeof(vertices_[0]) +
         faces_.capacity() * sizeof(faces_[0]) + source_.capacity() * sizeof(source_[0]) +
         nodes_.capacity() * sizeof(nodes_[0]);
}

Body SweptSphere(double radius_m, const std::vector<Eigen::Vector3d>& points_map) {
  Body body;
  body.kind = Body::Kind::kSphere;
  body.radius_m = radius_m;
  body.poses.reserve(points_map.size());
  for (const Eigen::Vector3d& point : points_map) {
    body.poses.push_back({point, Eigen::Quaterniond::Identity()});
  }
  return body;
}

}  // namespace dsg::query
