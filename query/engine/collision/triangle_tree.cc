// SPDX-License-Identifier: Apache-2.0
#include "query/engine/collision/triangle_tree.h"

#include <algorithm>
#include <numeric>

namespace dsg::query {
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

}  // namespace dsg::query
