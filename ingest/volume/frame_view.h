// SPDX-License-Identifier: Apache-2.0
// A depth frame made ready for fusion: which pixels end on a surface, and which only see through.
// Refuses frames that do not fit together.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/status/status.h"
#include "ingest/sensor/depth_frame.h"
#include "ingest/volume/depth_pyramid.h"
#include "ingest/volume/semantic_volume.h"
#include "ingest/volume/surface_normals.h"

namespace dsg::ingest {

/// Lengths that follow from the options.
struct BandLengths {
  explicit BandLengths(const VolumeOptions& options);

  float voxel_m;
  /// Distances are cut to this.
  float truncation_m;
};

/// What a ray says of a point on it.
struct Reading {
  /// Metres along the optical axis, to the surface or to where free space is known to end.
  float depth_m = 0.0f;
  int column = 0;
  int row = 0;
  bool is_surface = false;
};

/// Threads: safe from many.
class FrameView {
 public:
  /// Errors: FIELD_INVALID when a channel's size is not the camera's, or the pose is no pose.
  static absl::Status Check(const DepthFrame& frame, double voxel_m);

  /// Requires: Check(frame).ok(); `frame` outlives the view.
  FrameView(const DepthFrame& frame, const VolumeOptions& options);

  const DepthFrame& frame() const { return *frame_; }
  const BandLengths& band() const { return band_; }
  const DepthPyramid& pyramid() const { return pyramid_; }
  /// Depth of a surface where positive, end of free space where negative, nothing where 0.
  float Reach(int column, int row) const { return reach_[Offset(column, row)]; }
  size_t Offset(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(frame_->camera.width) +
           static_cast<size_t>(column);
  }
  int64_t used_count() const { return used_count_; }
  int64_t dynamic_count() const { return dynamic_count_; }

  /// False outside the image and where nothing is known. `u`, `v`: pixels.
  bool Read(float u, float v, Reading* reading) const;
  /// Nothing is written further behind a surface at this depth: walls are thin. Far away the noise
  /// is larger: if looks that end too soon said nothing where those that end too late see free
  /// space, a wall would get a second face behind it.
  float BehindM(float depth_m) const {
    return std::max(near_behind_m_, noise_m_ + noise_per_m2_ * depth_m * depth_m);
  }
  /// What turns a distance along the optical axis, on the ray through (x, y, 1), into one to the
  /// surface: across it where its direction is known, else along the ray.
  float DistanceScale(const Reading& reading, float x, float y) const;
  /// The pixel is not next to a jump in depth, where labels and colours of both sides mix.
  bool IsInsideSurface(int column, int row) const;

 private:
  std::vector<float> MakeReach(const VolumeOptions& options);

  const DepthFrame* frame_;
  BandLengths band_;
  float near_behind_m_;
  float noise_m_;
  float noise_per_m2_;
  float scale_min_;
  int edge_px_;
  float edge_m_;
  float edge_per_m2_;
  int64_t used_count_ = 0;
  int64_t dynamic_count_ = 0;
  std::vector<float> reach_;
  DepthPyramid pyramid_;
  SurfaceNormals normals_;
};

}  // namespace dsg::ingest
