// SPDX-License-Identifier: Apache-2.0
// How frames add up to a volume, and a volume to a mesh: all numbers that decide it.
#pragma once

#include "ingest/config/option_field.h"

namespace dsg::ingest {

/// What a reading says of the voxels on its ray. Units and reasons: the table of the .cc file.
struct FusionOptions {
  double truncation_voxels = 3.0;
  double behind_voxels = 2.0;
  double noise_m = 0.0025;
  double noise_per_m2 = 0.002;
  double stereo_noise_per_m2 = 0.006;
  double noise_spread = 2.5;

  double full_weight_m = 1.0;
  double weight_max = 4.0;
  double free_weight_max = 1.0;
  double slanted_min = 0.05;
  double through_wall = 0.3;
  double scale_min = 0.15;
  int normal_pixel_count_min = 24;
  double misfit_m = 0.02;
  double misfit_per_m2 = 0.004;

  double person_margin_m = 0.1;
  double label_before_voxels = 1.5;
  double label_behind_voxels = 0.5;
  int color_count_max = 16;
  int edge_px = 1;
  double edge_m = 0.2;
  double edge_per_m2 = 0.02;
};

/// Which instance of the map a segment of a label picture is.
struct InstanceOptions {
  int stride_px = 4;
  int sample_count_min = 6;
  int vote_count_min = 3;
  double share_of_samples = 0.1;
  double share_of_mapped = 0.3;
  int join_frame_count = 5;
  int apart_frame_count = 2;
};

/// What of the volume becomes mesh.
struct MeshingOptions {
  double still_voxels = 0.15;
  int speck_face_count = 12;
};

}  // namespace dsg::ingest
