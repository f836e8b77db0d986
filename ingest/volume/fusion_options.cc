// SPDX-License-Identifier: Apache-2.0
#include "ingest/volume/fusion_options.h"

#include "ingest/volume/semantic_volume.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<VolumeOptions> kVolumeFields[] = {
    {"volume-label-confidence", &VolumeOptions::label_confidence, 0.01, 0.999,
     "How much a label is believed, as the probability that a pixel shows the class it says: of "
     "good networks"},
};

constexpr OptionField<FusionOptions> kFusionFields[] = {
    {"volume-truncation", &FusionOptions::truncation_voxels, 2.0, 16.0,
     "Distances are kept within this of a surface, voxels: three hold the cubes that a surface "
     "cuts and the noise of depth"},
    {"volume-behind", &FusionOptions::behind_voxels, 0.5, 16.0,
     "Nothing is written farther behind a surface, voxels: the corners of a cut cube lie up to the "
     "square root of three behind it, and walls are thin"},
    {"volume-noise", &FusionOptions::noise_m, 0.0, 1.0,
     "... but for the noise of depth, metres: what docs/sensor_logs.md states for the simulated "
     "camera, not measured on a real one"},
    {"volume-noise-square", &FusionOptions::noise_per_m2, 0.0, 1.0,
     "... which grows by this with the square of the distance, 1 / metre: the same"},
    {"volume-noise-stereo", &FusionOptions::stereo_noise_per_m2, 0.0, 1.0,
     "... and of a stereo pair by this, 1 / metre: a quarter of a pixel at 0.1 metres between its "
     "cameras"},
    {"volume-noise-spread", &FusionOptions::noise_spread, 0.0, 10.0,
     "... of which so many standard deviations count: 99 %"},
    {"volume-full-weight", &FusionOptions::full_weight_m, 0.05, 100.0,
     "Readings nearer than this weigh no more for it, metres: depth cameras are no better there"},
    {"volume-weight-max", &FusionOptions::weight_max, 0.01, 1000.0,
     "Weight that a voxel gathers at most: about 35 looks from three metres, enough to average "
     "noise away, few enough to forget what has been taken away"},
    {"volume-free-weight-max", &FusionOptions::free_weight_max, 0.01, 1000.0,
     "... by free space: less, or what is put down would take minutes to appear"},
    {"volume-slanted", &FusionOptions::slanted_min, 0.0, 1.0,
     "Least weight of a slanted look, of one from straight ahead: slanted surfaces are measured "
     "worse"},
    {"volume-through-wall", &FusionOptions::through_wall, 0.0, 1.0,
     "Weight of a look that takes a voxel to be more than a voxel inside, against what its own "
     "side has shown: walls are thin"},
    {"volume-slant-scale", &FusionOptions::scale_min, 0.01, 1.0,
     "Least cosine by which distances along a ray become distances to a surface: a wrong direction "
     "should not make them vanish"},
    {"volume-plane-pixels", &FusionOptions::normal_pixel_count_min, 3, 64,
     "Pixels of a tile of 8 by 8 that say which way its surface faces, at least: fewer are noise"},
    {"volume-plane-misfit", &FusionOptions::misfit_m, 0.0, 1.0,
     "... if they are off a plane by less, metres: noise"},
    {"volume-plane-misfit-square", &FusionOptions::misfit_per_m2, 0.0, 1.0,
     "... and by this with the square of the distance, 1 / metre: as the noise of depth grows"},
    {"volume-person-margin", &FusionOptions::person_margin_m, 0.0, 5.0,
     "Free space ends this far before a person, metres, besides the truncation: clothes, limbs, "
     "rims of masks"},
    {"volume-label-before", &FusionOptions::label_before_voxels, 0.0, 16.0,
     "Labels and colours are kept so far before a surface, voxels: the corners of cut cubes"},
    {"volume-label-behind", &FusionOptions::label_behind_voxels, 0.0, 16.0,
     "... and behind it, voxels: the far side of a thin wall must not take this side's"},
    {"volume-color-count", &FusionOptions::color_count_max, 1, 255,
     "A colour is the mean of so many looks: later ones count as one of them, since light changes"},
    {"volume-edge", &FusionOptions::edge_px, 1, 20,
     "Labels and colours this near to a jump in depth are not taken, pixels: they mix, but a wider "
     "rim would leave small things without a vote"},
    {"volume-edge-jump", &FusionOptions::edge_m, 0.0, 10.0,
     "... of more than this, metres: outlines of things"},
    {"volume-edge-jump-square", &FusionOptions::edge_per_m2, 0.0, 10.0,
     "... and this with the square of the distance, 1 / metre: noise of depth"},
};

constexpr OptionField<InstanceOptions> kInstanceFields[] = {
    {"instance-stride", &InstanceOptions::stride_px, 1, 64,
     "Every so many columns and rows of a label picture are asked: more say the same"},
    {"instance-samples", &InstanceOptions::sample_count_min, 1, 1e6,
     "Segments of fewer of these begin no instance: about 100 pixels"},
    {"instance-votes", &InstanceOptions::vote_count_min, 1, 1e6,
     "An instance is a segment's if so many of these show it: fewer are noise"},
    {"instance-share", &InstanceOptions::share_of_samples, 0.0, 1.0,
     "... and this share of the segment's: most of a new view is new"},
    {"instance-share-mapped", &InstanceOptions::share_of_mapped, 0.0, 1.0,
     "... and this share of those that show any instance: the rest is its neighbours'"},
    {"instance-join", &InstanceOptions::join_frame_count, 1, 1e6,
     "Two instances are one when so many more frames showed them as one: labels run together by "
     "chance"},
    {"instance-apart", &InstanceOptions::apart_frame_count, 0, 1e6,
     "... of which a frame that shows both takes so many away: that is seldom wrong"},
};

constexpr OptionField<MeshingOptions> kMeshingFields[] = {
    {"mesh-still", &MeshingOptions::still_voxels, 0.0, 1.0,
     "A distance that moves by less moves no mesh, voxels: noise of a converged one, and a "
     "fraction of the mesh's error"},
    {"mesh-speck", &MeshingOptions::speck_face_count, 0, 1e6,
     "Pieces of fewer faces that hang together with nothing are left out: specks of noise"},
};

}  // namespace

std::vector<BoundOption> VolumeOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields(kVolumeFields, this, &bound);
  BindFields(kFusionFields, &fusion, &bound);
  BindFields(kInstanceFields, &instances, &bound);
  BindFields(kMeshingFields, &meshing, &bound);
  return bound;
}

}  // namespace dsg::ingest
