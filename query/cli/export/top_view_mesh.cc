// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/top_view_mesh.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "query/cli/export/mesh_look.h"

namespace dsg::cli {
namespace {

constexpr float kCutAboveFloorM = 1.4f;
// Of the way from the mesh's own colour to the paper's.
constexpr float kPaleness = 0.45f;
constexpr float kPaper = 0.98f;

struct Face {
  float height_m = 0.0f;
  std::array<Eigen::Vector2f, 3> corners_map;
  picture::Paint paint;
};

// The lowest heights of a mesh are often a few points seen through the floor.
float FloorHeight(const std::vector<MeshBlock>& mesh) {
  constexpr size_t kStride = 7;
  constexpr size_t kPart = 50;
  std::vector<float> heights;
  for (const MeshBlock& block : mesh) {
    for (size_t i = 0; i < block.faces.size(); i += kStride) {
      heights.push_back(block.positions_map[block.faces[i][0]].z());
    }
  }
  if (heights.empty()) return 0.0f;
  const auto low = heights.begin() + static_cast<ptrdiff_t>(heights.size() / kPart);
  std::nth_element(heights.begin(), low, heights.end());
  return *low;
}

picture::Paint PaintOf(const MeshBlock& block, const std::array<uint32_t, 3>& face,
                       MeshColor color) {
  picture::Paint paint;
  std::array<float*, 3> channels = {&paint.red, &paint.green, &paint.blue};
  for (const uint32_t vertex : face) {
    const picture::Paint corner = picture::MakePaint(VertexColor(block, vertex, color));
    const std::array<float, 3> parts = {corner.red, corner.green, corner.blue};
    for (size_t i = 0; i < 3; ++i) *channels[i] += parts[i] / 3.0f;
  }
  for (float* channel : channels) *channel += kPaleness * (kPaper - *channel);
  return paint;
}

}  // namespace

void DrawMesh(const std::vector<MeshBlock>& mesh, const FloorView& view, picture::Canvas* canvas) {
  const MeshColor color = SettleColor(mesh, MeshColor::kAuto);
  const float cut_m = FloorHeight(mesh) + kCutAboveFloorM;
  std::vector<Face> faces;
  for (const MeshBlock& block : mesh) {
    for (const auto& face : block.faces) {
      Face out;
      float sum_m = 0.0f;
      for (size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3f& corner = block.positions_map[face[i]];
        out.corners_map[i] = corner.head<2>();
        sum_m += corner.z();
      }
      out.height_m = sum_m / 3.0f;
      if (out.height_m > cut_m) continue;
      out.paint = PaintOf(block, face, color);
      faces.push_back(out);
    }
  }
  // From the floor up, as a painter works; stable, so that the same map gives the same bytes.
  std::stable_sort(faces.begin(), faces.end(),
                   [](const Face& a, const Face& b) { return a.height_m < b.height_m; });
  for (const Face& face : faces) {
    Polygon2d corners;
    for (const Eigen::Vector2f& corner : face.corners_map) {
      corners.push_back(view.ToPixel(Eigen::Vector2d(corner.cast<double>())));
    }
    canvas->FillPolygon(corners, face.paint);
  }
}

}  // namespace dsg::cli
