// SPDX-License-Identifier: Apache-2.0
// Fractions of a pixel for disparities that a matcher has found. OpenCV's types: for .cc files.
// Refuses long steps: what was matched wrongly stays wrong.
#pragma once

#include <opencv2/core.hpp>

#include "ingest/depth/depth_options.h"

namespace dsg::ingest {

/// One step of least squares on a window of matches around each; 0 = no match. The matcher's own
/// fractions lean towards whole pixels by up to a quarter.
/// Requires: rectified images of one size, left.row(v) seen in right.row(v).
/// Source: Lucas and Kanade, "An iterative image registration technique with an application to
/// stereo vision", IJCAI 1981.
void RefineDisparity(const cv::Mat1f& left, const cv::Mat1f& right, const RefineOptions& options,
                     cv::Mat1f* disparity);

}  // namespace dsg::ingest
