// SPDX-License-Identifier: Apache-2.0
// What an ideal camera sees of a scene and of the bodies that move in it: light, depth, labels.
// Refuses noise and quantisation; image_effects.h adds those.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/sensor/calibration.h"
#include "ingest/simulator/scene/scene.h"
#include "schema/model/geometry.h"

namespace dsg::simulator {

/// A person or a carried object at one instant. Pointees must outlive the call.
struct MovingBody {
  /// Map frame.
  const TriangleMesh* mesh = nullptr;
  /// Where each vertex is in a frame that moves with the body (its rest pose), so that the texture
  /// sticks to it; null = the map.
  const std::vector<Eigen::Vector3f>* texture_points = nullptr;
  /// Of each vertex, in place of `color`; null = `color` everywhere.
  const std::vector<Color>* vertex_colors = nullptr;
  int class_id = 0;
  int instance = 0;
  Material material = Material::kFabric;
  Color color = {128, 128, 128, 255};
  uint32_t texture_seed = 0;
};

/// How much of a moving body an image shows.
struct BodyCoverage {
  /// Pixels whose centre ray hits the body.
  int visible_pixel_count = 0;
  /// Pixels that it would cover if nothing stood before it and the image went on for half of its
  /// width and height beyond each border. Visible / alone = the share of it that is seen.
  int alone_pixel_count = 0;
  /// Box of the visible pixels, both ends included; meaningful if there are any.
  int column_min = 0;
  int row_min = 0;
  int column_max = -1;
  int row_max = -1;

  double VisibleFraction() const {
    if (alone_pixel_count == 0) return 0.0;
    const double ratio = static_cast<double>(visible_pixel_count) / alone_pixel_count;
    return ratio < 1.0 ? ratio : 1.0;
  }
};

/// What Render is to fill; the rest stays empty.
struct ViewWants {
  bool gray = true;
  bool rgb = false;
  bool depth = false;
  bool label = false;
  /// `face` of the static scene.
  bool face = false;
  bool coverage = false;
};

/// Row by row from the top.
struct RenderedView {
  int width = 0;
  int height = 0;
  /// Light that arrives, 0 to 1, linear: a camera of gain 1 writes 255 times it. Smoothed at
  /// edges by four rays a pixel.
  std::vector<float> gray;
  /// Red, green, blue of each pixel.
  std::vector<float> rgb;
  /// Along the optical axis through the pixel's centre, metres; 0 = nothing is there.
  std::vector<float> depth_m;
  /// Cosine between the ray and the surface's normal, 0 to 1; comes with depth.
  std::vector<float> incidence_cos;
  /// LabelValue at the pixel's centre; 0 = nothing.
  std::vector<uint16_t> label;
  /// Index of the static scene's face, counted through Scene::parts; -1 = a moving body, nothing.
  std::vector<int32_t> face;
  /// Of each moving body given.
  std::vector<BodyCoverage> bodies;
};

/// Casts rays into one scene.
///
/// Threads: Render may be called from several at once.
class Renderer {
 public:
  /// Copies what it needs of the scene. Cost: a second for a million triangles.
  /// Errors: INTERNAL when Embree fails, with what it says; FIELD_INVALID for a scene that is
  /// empty or whose faces name vertices that are not there.
  static absl::StatusOr<std::unique_ptr<Renderer>> Create(const Scene& scene);
  ~Renderer();

  /// Same arguments, same bytes. Glass tints what is behind it and is not itself seen in depth,
  /// labels and faces, as with the depth cameras of the market.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for a camera with distortion or of invalid numbers, a
  /// pose that is none, a body without a mesh or with lists that do not fit its vertices.
  absl::StatusOr<RenderedView> Render(const Pose3d& map_T_camera,
                                      const ingest::CameraCalibration& camera,
                                      std::span<const MovingBody> bodies,
                                      const ViewWants& wants) const;

 private:
  class Impl;
  explicit Renderer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dsg::simulator
