// SPDX-License-Identifier: Apache-2.0
// How wrong the detections of a log are, beside the paper's figures for its network.
// Refuses to judge detections of nobody; they are counted only.
#pragma once

#include <string>
#include <vector>

namespace dsg::simulator {

/// Source: RSS 2020, table III, raw and filtered.
inline constexpr double kPaperRawMeanM = 1.07;
inline constexpr double kPaperFilteredMeanM = 0.88;
/// The paper's filter drops boxes so near to the image's border, or so small, pixels.
inline constexpr double kFilterBorderPx = 5.0;
inline constexpr double kFilterSidePx = 30.0;
/// With fewer detections the mean says little.
inline constexpr int kLowStatisticsCount = 200;

/// Errors of torso positions, metres.
struct ErrorSummary {
  int count = 0;
  double mean_m = 0.0;
  double std_m = 0.0;
  double median_m = 0.0;
  double p99_m = 0.0;
};

struct DetectionStatistics {
  ErrorSummary raw;
  ErrorSummary filtered;
  /// Of the vertices against the pelvis, a detection's mean each; none without bodies.
  ErrorSummary skin;
  int false_positive_count = 0;
  /// Views that were too hidden or too small.
  int dropped_view_count = 0;
  /// Factor of the outlier rate, 1 = as designed.
  double outlier_scale = 1.0;
  /// Mean error at factor 1.
  double unscaled_mean_m = 0.0;
  bool low_statistics = false;
  /// No factor brings the mean into the band.
  bool off_target = false;
};

ErrorSummary Summarize(std::vector<double> errors_m);

/// A few lines for people, with the paper's figures.
std::string FormatDetectionStatistics(const DetectionStatistics& statistics);

}  // namespace dsg::simulator
