// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/body.h"

namespace dsg::cli {

MeshBlock MeshOf(const Body& body, uint32_t rgb) {
  MeshBlock mesh;
  mesh.positions_map = body.points_map;
  mesh.colors.assign(body.points_map.size(), rgb);
  if (body.faces != nullptr) mesh.faces = *body.faces;
  return mesh;
}

std::vector<LitFace> LitFaces(const Body& body, uint32_t rgb, const Eigen::Vector3d& to_eye_map) {
  constexpr double kAmbient = 0.45;
  std::vector<LitFace> lit;
  if (body.faces == nullptr) return lit;
  for (const auto& face : *body.faces) {
    LitFace out;
    for (size_t i = 0; i < face.size(); ++i) {
      out.corners_map[i] = body.points_map[face[i]].cast<double>();
      out.middle_map += out.corners_map[i] / 3.0;
    }
    const Eigen::Vector3d normal = (out.corners_map[1] - out.corners_map[0])
                                       .cross(out.corners_map[2] - out.corners_map[0])
                                       .normalized();
    const double facing = normal.dot(to_eye_map);
    // Not a number, as of a face without area, is not seen either.
    if (!(facing > 0.0)) continue;
    out.paint = picture::MakePaint(rgb);
    const auto light = static_cast<float>(kAmbient + (1.0 - kAmbient) * facing);
    for (float* channel : {&out.paint.red, &out.paint.green, &out.paint.blue}) *channel *= light;
    lit.push_back(out);
  }
  return lit;
}

}  // namespace dsg::cli
