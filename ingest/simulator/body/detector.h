// SPDX-License-Identifier: Apache-2.0
// The stand-in for a neural human detector: from what each image shows of each body to
// detections that err as the paper's network does. Refuses to see pixels; the renderer counts
// them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ingest/sensor/calibration.h"
#include "ingest/sensor/human_detection.h"
#include "ingest/simulator/body/body_model.h"
#include "ingest/simulator/body/detected_skin.h"
#include "ingest/simulator/body/detection_statistics.h"
#include "ingest/simulator/body/human_motion.h"
#include "ingest/truth/truth.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::simulator {

/// One body in one image, as rendered.
struct BodyView {
  TimeNs time_ns = 0;
  /// Number of the image; with the person it seeds the errors.
  int64_t frame = 0;
  int person = 0;
  BodyState state;
  /// Share of the body's pixels that the image shows, 0 to 1.
  double visibility = 1.0;
  /// Of the visible pixels: left, top, right, bottom.
  Eigen::Vector4d box_px = Eigen::Vector4d::Zero();
  bool touches_border = false;
  /// In the label image.
  int mask_instance = 0;
};

struct DetectorOptions {
  std::string camera = "cam0";
  /// Less visible bodies are not detected.
  double visibility_min = 0.1;
  /// The same for bodies farther away: 60 pixels of height is where networks begin to miss people,
  /// and the error model was made for 2.5 to 11 m.
  double range_m_max = 12.0;
  /// The same for boxes whose longer side is less, pixels.
  double box_side_min_px = 10.0;
  /// Detections of nobody, per image with at least one view.
  double false_positive_rate = 0.0;
  /// Whether the rate of outliers is scaled until the mean error is near the paper's.
  bool scale_outliers = true;
  /// Metres. Source: RSS 2020, table III (1.07 m).
  double target_mean_m = 1.1;
  /// Left as it is when the plain rate comes as close as this, metres.
  double target_tolerance_m = 0.1;
  /// Whether outputs have the bodies that their skins are made of.
  bool has_bodies = false;
};

struct DetectionOutput {
  ingest::HumanDetection detection;
  truth::DetectionTruth truth;
  /// Set if DetectorOptions::has_bodies.
  std::optional<DetectedBody> body;
};

struct DetectorResult {
  /// Ascending by time, then id; ids count from 1.
  std::vector<DetectionOutput> outputs;
  DetectionStatistics statistics;
};

/// True pose of the camera of a view.
using CameraPoseOf = std::function<Pose3d(const BodyView&)>;

/// Detections of a whole log. The errors of a detection depend on seed, frame and person alone,
/// and, through the scale of the outlier rate, on the log as a whole.
///
/// Torsos nearer to the camera than half a metre are left out.
/// Requires: views in any order; shapes[person] for each view;
/// a valid camera. Frames: `camera` and the poses are the true ones.
DetectorResult MakeDetections(const std::vector<BodyView>& views,
                              const CameraPoseOf& map_T_camera_of,
                              const ingest::CameraCalibration& camera,
                              const std::vector<ShapeCoefficients>& shapes, uint64_t seed,
                              const DetectorOptions& options);

}  // namespace dsg::simulator
