// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/scene/body_scene_internal.h"
#include "ingest/simulator/scene/light.h"
#include "ingest/simulator/scene/shapes.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

using Eigen::Vector3f;

std::vector<Vector3f> VertexNormals(const TriangleMesh& mesh) {
  std::vector<Vector3f> normals(mesh.vertices.size(), Vector3f::Zero());
  for (const std::array<uint32_t, 3>& face : mesh.faces) {
    const Vector3f& a = mesh.vertices[face[0]];
    const Vector3f normal = (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a);
    for (const uint32_t corner : face) normals[corner] += normal;
  }
  for (Vector3f& normal : normals) {
    const float length = normal.norm();
    normal = length > 0.0f ? Vector3f(normal / length) : Vector3f::UnitZ().eval();
  }
  return normals;
}

std::vector<float> VertexLight(const TriangleMesh& mesh, const std::vector<RoomLight>& lights) {
  const RoomLight* light = FindLight(lights, BoundsOf(mesh).center());
  const std::vector<Vector3f> normals = VertexNormals(mesh);
  std::vector<float> result;
  result.reserve(normals.size());
  for (size_t i = 0; i < normals.size(); ++i) {
    result.push_back(light != nullptr ? LightAt(*light, mesh.vertices[i], normals[i])
                                      : EvenLight(normals[i]));
  }
  return result;
}

absl::Status CheckBody(const MovingBody& body, size_t index) {
  const auto bad = [index](const std::string& what) {
    return MakeError(Reason::kFieldInvalid, absl::StrCat("moving body ", index, " ", what),
                     {{"field", absl::StrCat("bodies[", index, "]")}});
  };
  if (body.mesh == nullptr) return bad("has no mesh");
  const size_t count = body.mesh->vertices.size();
  for (const std::array<uint32_t, 3>& face : body.mesh->faces) {
    if (std::max({face[0], face[1], face[2]}) >= count) {
      return bad(absl::StrCat("has a face of a vertex beyond its ", count));
    }
  }
  for (const Vector3f& vertex : body.mesh->vertices) {
    if (!vertex.allFinite()) return bad("has a vertex that is not finite");
  }
  if (body.texture_points != nullptr && body.texture_points->size() != count) {
    return bad(absl::StrCat("has ", body.texture_points->size(), " texture points for ", count,
                            " vertices"));
  }
  if (body.vertex_colors != nullptr && body.vertex_colors->size() != count) {
    return bad(
        absl::StrCat("has ", body.vertex_colors->size(), " colours for ", count, " vertices"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckBodies(std::span<const MovingBody> bodies) {
  for (size_t i = 0; i < bodies.size(); ++i) DSG_RETURN_IF_ERROR(CheckBody(bodies[i], i));
  return absl::OkStatus();
}

absl::StatusOr<BodyScene> BodyScene::Make(const StaticScene& world, const RayCamera& camera,
                                          std::span<const MovingBody> bodies,
                                          std::vector<BodyCoverage>* coverage) {
  BodyScene made;
  std::unique_ptr<Silhouette> silhouette;
  const PixelBox image = ImageBox(camera.calibration);
  std::vector<const TriangleMesh*> meshes;
  std::vector<Vector3f> points_camera;
  for (size_t i = 0; i < bodies.size(); ++i) {
    const TriangleMesh& mesh = *bodies[i].mesh;
    points_camera.clear();
    for (const Vector3f& vertex : mesh.vertices) {
      points_camera.push_back(camera.map_R_camera.transpose() * (vertex - camera.origin_map));
    }
    const PixelBox box = ProjectedBox(points_camera, camera.calibration);
    if (box.IsEmpty() || mesh.faces.empty()) continue;
    if (coverage != nullptr) {
      if (silhouette == nullptr) silhouette = std::make_unique<Silhouette>(camera.calibration);
      (*coverage)[i].alone_pixel_count = silhouette->CountPixels(points_camera, mesh.faces, box);
    }
    if (!box.Intersects(image)) continue;
    meshes.push_back(&mesh);
    made.seen_.push_back({&bodies[i], static_cast<int>(i), box,
                          MakeSurface(bodies[i].material, bodies[i].color, bodies[i].texture_seed),
                          VertexLight(mesh, world.lights)});
  }
  if (meshes.empty()) return made;
  DSG_ASSIGN_OR_RETURN(made.scene_,
                       MakeRayScene(world.device.get(), meshes, RTC_BUILD_QUALITY_LOW));
  return made;
}

bool BodyScene::MayCover(const PixelBox& pixels) const {
  return std::any_of(seen_.begin(), seen_.end(),
                     [&](const SeenBody& seen) { return seen.box.Intersects(pixels); });
}

uint16_t BodyScene::LabelOf(uint32_t geometry) const {
  const MovingBody& body = *seen_[geometry].body;
  return LabelValue(body.class_id, body.instance);
}

Vector3f BodyScene::ColorAt(uint32_t geometry, const FacePoint& at, float footprint_m) const {
  const SeenBody& seen = seen_[geometry];
  const MovingBody& body = *seen.body;
  const std::array<uint32_t, 3>& face = body.mesh->faces[at.face];
  const std::array<float, 3> weights = {1.0f - at.u - at.v, at.u, at.v};
  const std::vector<Vector3f>& points =
      body.texture_points != nullptr ? *body.texture_points : body.mesh->vertices;
  Vector3f point = Vector3f::Zero();
  Vector3f color = Vector3f::Zero();
  float light = 0.0f;
  for (int i = 0; i < 3; ++i) {
    point += weights[i] * points[face[i]];
    light += weights[i] * seen.light[face[i]];
    if (body.vertex_colors != nullptr) {
      const Color& paint = (*body.vertex_colors)[face[i]];
      color += (weights[i] / 255.0f) * Vector3f(paint[0], paint[1], paint[2]);
    }
  }
  const Vector3f normal =
      (points[face[1]] - points[face[0]]).cross(points[face[2]] - points[face[0]]);
  Surface surface = seen.surface;
  if (body.vertex_colors != nullptr) surface.color = color;
  return light * Albedo(surface, point, ProjectionAxis(normal), footprint_m);
}

}  // namespace dsg::simulator
