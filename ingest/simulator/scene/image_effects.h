// SPDX-License-Identifier: Apache-2.0
// From what an ideal camera sees to the bytes that a real one, a depth sensor and a segmentation
// network deliver. Refuses state: a frame's bytes depend on its view and its random numbers alone.
#pragma once

#include <cstdint>
#include <span>

#include "ingest/sensor/image.h"
#include "ingest/simulator/scene/renderer.h"
#include "schema/base/random.h"
#include "schema/base/time.h"

namespace dsg::simulator {

/// A linear camera: byte = 255 * gain * vignetting * light + noise, rounded and clamped.
struct CameraEffects {
  /// From ExposureGain.
  double gain = 1.0;
  /// Share of the light that the corners lose; falls with the square of the distance from the
  /// middle.
  double vignetting = 0.2;
  /// Standard deviation in the dark, grey levels.
  double read_noise = 1.0;
  /// Standard deviation at full light, grey levels; falls with the square root of the light.
  double shot_noise = 3.0;
};

/// Depth noise: sigma = base + square * z^2, metres.
struct DepthEffects {
  double sigma_base_m = 0.0025;
  double sigma_square_per_m = 0.002;
  /// No reading where the ray meets the surface flatter than this from its normal.
  double grazing_deg_max = 75.0;
  /// No reading where a neighbour is farther off than this share of the depth.
  double edge_ratio = 0.03;
  double range_m_max = 10.0;
};

/// Mistakes of a segmentation network, drawn for each image anew.
struct LabelEffects {
  /// Outlines wander by up to this many pixels, drawn between the two.
  double jitter_px_min = 1.0;
  double jitter_px_max = 3.0;
  /// Of an instance in an image: it is missed (label 0).
  double miss_probability = 0.02;
  /// Of an instance in an image: it is taken for another class.
  double swap_probability = 0.01;
};

/// Gain of an automatic exposure that drifts: smooth over time, within 10 % of 1.
double ExposureGain(TimeNs time_ns, uint64_t seed);

/// Gray8. Requires: view.gray is filled.
ingest::Image MakeGray(const RenderedView& view, const CameraEffects& effects, Random* random);
/// Rgb8. Requires: view.rgb is filled.
ingest::Image MakeRgb(const RenderedView& view, const CameraEffects& effects, Random* random);

/// Depth16, rounded to millimetres; 0 beyond 65.535 m. Requires: view.depth_m is filled.
ingest::Image MakeCleanDepth(const RenderedView& view);
/// Depth16 with noise and holes. Requires: view.depth_m is filled.
ingest::Image MakeDepth(const RenderedView& view, const DepthEffects& effects, Random* random);

/// Label16. Requires: view.label is filled.
ingest::Image MakeCleanLabels(const RenderedView& view);
/// Label16 with mistakes; structures (instance 0) are neither missed nor swapped. `classes` are
/// those that an instance may be taken for. Requires: view.label is filled.
ingest::Image MakeLabels(const RenderedView& view, const LabelEffects& effects,
                         std::span<const int> classes, Random* random);

}  // namespace dsg::simulator
