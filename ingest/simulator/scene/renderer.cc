// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/scene/renderer.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/scene/body_scene_internal.h"
#include "ingest/simulator/scene/frame_internal.h"
#include "ingest/simulator/scene/static_scene_internal.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

absl::Status CheckView(const Pose3d& map_T_camera, const ingest::CameraCalibration& camera) {
  DSG_RETURN_IF_ERROR(camera.Validate());
  if (camera.distortion != ingest::Distortion::kNone) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("camera ", camera.name,
                                  " has lens distortion; only cameras without can be rendered"),
                     {{"field", absl::StrCat(camera.name, ".distortion")}});
  }
  if (IsValidPose(map_T_camera)) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("the pose of camera ", camera.name,
                                " is not finite or its rotation not of unit length"),
                   {{"field", "map_T_camera"}});
}

}  // namespace

class Renderer::Impl {
 public:
  explicit Impl(StaticScene scene) : world(std::move(scene)) {}
  const StaticScene world;
};

Renderer::Renderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Renderer::~Renderer() = default;

absl::StatusOr<std::unique_ptr<Renderer>> Renderer::Create(const Scene& scene) {
  DSG_ASSIGN_OR_RETURN(StaticScene world, MakeStaticScene(scene));
  return std::unique_ptr<Renderer>(new Renderer(std::make_unique<Impl>(std::move(world))));
}

absl::StatusOr<RenderedView> Renderer::Render(const Pose3d& map_T_camera,
                                              const ingest::CameraCalibration& camera,
                                              std::span<const MovingBody> bodies,
                                              const ViewWants& wants) const {
  DSG_RETURN_IF_ERROR(CheckView(map_T_camera, camera));
  DSG_RETURN_IF_ERROR(CheckBodies(bodies));
  const RayCamera rays = {camera, map_T_camera.position.cast<float>(),
                          map_T_camera.orientation.toRotationMatrix().cast<float>()};
  RenderedView view;
  view.width = camera.width;
  view.height = camera.height;
  if (wants.coverage) view.bodies.resize(bodies.size());
  DSG_ASSIGN_OR_RETURN(
      const BodyScene seen,
      BodyScene::Make(impl_->world, rays, bodies, wants.coverage ? &view.bodies : nullptr));
  DrawFrame(impl_->world, seen, rays, wants, &view);
  return view;
}

}  // namespace dsg::simulator
