// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <string>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/scene/light.h"
#include "ingest/simulator/scene/static_scene_internal.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

using Eigen::Vector3f;

absl::Status CheckPart(const Part& part, size_t index, size_t room_count) {
  const auto bad = [index](const std::string& what) {
    return MakeError(Reason::kFieldInvalid, absl::StrCat("part ", index, " of the scene ", what),
                     {{"field", absl::StrCat("parts[", index, "]")}});
  };
  for (const std::array<uint32_t, 3>& face : part.mesh.faces) {
    for (const uint32_t corner : face) {
      if (corner >= part.mesh.vertices.size()) {
        return bad(absl::StrCat("has a face of vertex ", corner, " but only ",
                                part.mesh.vertices.size(), " vertices"));
      }
    }
  }
  for (const Vector3f& vertex : part.mesh.vertices) {
    if (!vertex.allFinite()) return bad("has a vertex that is not finite");
  }
  if (part.room < -1 || part.room >= static_cast<int>(room_count)) {
    return bad(absl::StrCat("is in room ", part.room, " of ", room_count));
  }
  return absl::OkStatus();
}

class Collector {
 public:
  explicit Collector(const Scene& scene) : scene_(scene) {}

  void Add(size_t index, TriangleMesh* mesh, std::vector<FaceLook>* looks) {
    const Part& part = scene_.parts[index];
    mesh->Append(part.mesh);
    const RoomLight* light = part.room >= 0 ? &scene_.lights[part.room] : nullptr;
    for (const std::array<uint32_t, 3>& face : part.mesh.faces) {
      std::array<Vector3f, 3> corners;
      for (int i = 0; i < 3; ++i) corners[i] = part.mesh.vertices[face[i]];
      FaceLook look;
      const Vector3f normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
      const float length = normal.norm();
      look.normal = length > 0.0f ? Vector3f(normal / length) : Vector3f::UnitZ().eval();
      for (int i = 0; i < 3; ++i) {
        look.light[i] =
            light != nullptr ? LightAt(*light, corners[i], look.normal) : EvenLight(look.normal);
      }
      look.part = static_cast<int32_t>(index);
      look.face = face_count_++;
      look.surface = SurfaceOf(look.part, look.normal);
      look.axis = ProjectionAxis(look.normal);
      looks->push_back(look);
    }
  }

 private:
  int32_t SurfaceOf(int32_t part, const Vector3f& normal) {
    const auto key = std::tuple(part, std::lround(8.0f * normal.x()),
                                std::lround(8.0f * normal.y()), std::lround(8.0f * normal.z()));
    return surfaces_.emplace(key, static_cast<int32_t>(surfaces_.size())).first->second;
  }

  const Scene& scene_;
  int32_t face_count_ = 0;
  std::map<std::tuple<int32_t, long, long, long>, int32_t> surfaces_;
};

}  // namespace

absl::StatusOr<StaticScene> MakeStaticScene(const Scene& scene) {
  if (scene.FaceCount() == 0) {
    return MakeError(Reason::kFieldInvalid, "the scene has no faces; nothing could be seen",
                     {{"field", "parts"}});
  }
  StaticScene made;
  TriangleMesh opaque;
  TriangleMesh glass;
  Collector collector(scene);
  for (size_t i = 0; i < scene.parts.size(); ++i) {
    const Part& part = scene.parts[i];
    DSG_RETURN_IF_ERROR(CheckPart(part, i, scene.lights.size()));
    if (part.material == Material::kGlass) {
      collector.Add(i, &glass, &made.glass_faces);
    } else {
      collector.Add(i, &opaque, &made.opaque_faces);
    }
    made.surfaces.push_back(MakeSurface(part.material, part.color, part.texture_seed));
    made.emissions.push_back(part.emission);
    made.labels.push_back(LabelValue(part.class_id, part.instance));
  }
  made.lights = scene.lights;
  DSG_ASSIGN_OR_RETURN(made.device, MakeDevice());
  const TriangleMesh* const opaque_meshes[] = {&opaque};
  DSG_ASSIGN_OR_RETURN(made.opaque,
                       MakeRayScene(made.device.get(), opaque_meshes, RTC_BUILD_QUALITY_MEDIUM));
  if (!glass.faces.empty()) {
    const TriangleMesh* const glass_meshes[] = {&glass};
    DSG_ASSIGN_OR_RETURN(made.glass,
                         MakeRayScene(made.device.get(), glass_meshes, RTC_BUILD_QUALITY_MEDIUM));
  }
  return made;
}

}  // namespace dsg::simulator
