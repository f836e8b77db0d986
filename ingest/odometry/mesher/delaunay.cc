// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>

#include "ingest/odometry/mesher/delaunay_internal.h"

namespace dsg::ingest {
namespace {

// The point's vertex in the subdivision; 0, which is none, where it cannot be inserted.
int InsertPoint(cv::Subdiv2D* subdivision, const Eigen::Vector2d& point) {
  const cv::Point2f at(static_cast<float>(point.x()), static_cast<float>(point.y()));
  try {
    return subdivision->insert(at);
  } catch (const cv::Exception&) {
    // Points that are nearly one in single precision may not be located.
    return 0;
  }
}

// A face to the left of its edge, as vertices; zeros unless three edges close it.
std::array<int, 3> FaceAt(const cv::Subdiv2D& subdivision, int edge) {
  const int second = subdivision.getEdge(edge, cv::Subdiv2D::NEXT_AROUND_LEFT);
  const int third = subdivision.getEdge(second, cv::Subdiv2D::NEXT_AROUND_LEFT);
  if (subdivision.getEdge(third, cv::Subdiv2D::NEXT_AROUND_LEFT) != edge) return {};
  return {subdivision.edgeOrg(edge), subdivision.edgeOrg(second), subdivision.edgeOrg(third)};
}

}  // namespace

std::vector<std::array<size_t, 3>> DelaunayOf(int width, int height,
                                              std::span<const Eigen::Vector2d> points) {
  const Eigen::Array2d low(-1.0, -1.0);
  const Eigen::Array2d high(width, height);
  cv::Subdiv2D subdivision(cv::Rect(-1, -1, width + 2, height + 2));
  std::map<int, size_t> index_of_vertex;
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Array2d at = points[i].array();
    if (!at.allFinite() || (at < low).any() || (at > high).any()) continue;
    const int vertex = InsertPoint(&subdivision, points[i]);
    if (vertex > 0) index_of_vertex.emplace(vertex, i);
  }
  std::vector<int> edges;
  subdivision.getLeadingEdgeList(edges);
  std::vector<std::array<size_t, 3>> triangles;
  for (const int edge : edges) {
    std::array<size_t, 3> triangle{};
    bool is_inner = true;
    const std::array<int, 3> vertices = FaceAt(subdivision, edge);
    for (size_t corner = 0; corner < 3; ++corner) {
      // The subdivision has three vertices of its own, far outside.
      const auto found = index_of_vertex.find(vertices[corner]);
      is_inner = is_inner && found != index_of_vertex.end();
      if (is_inner) triangle[corner] = found->second;
    }
    if (!is_inner) continue;
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()),
                triangle.end());
    triangles.push_back(triangle);
  }
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

}  // namespace dsg::ingest
