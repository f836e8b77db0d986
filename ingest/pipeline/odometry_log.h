// SPDX-License-Identifier: Apache-2.0
// A log whose robot poses are estimated from its images, and its inertial unit if it has one, while
// it is read.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/depth/gravity.h"
#include "ingest/log/log_source.h"
#include "ingest/odometry/estimator/odometry_options.h"
#include "ingest/pipeline/odometry_mesh.h"

namespace dsg::ingest {

struct OdometryLogOptions {
  OdometryOptions odometry;
  /// Nothing is followed on people that label images show.
  bool is_masked = true;
  /// An inertial unit is used where the log has one.
  bool is_inertial = true;
  /// Without a unit: how up is found in the first depth image.
  GravityOptions gravity;
  /// A mesh of the landmarks beside the poses, which it does not change.
  std::optional<OdometryMeshOptions> mesh;

  /// What differs from the defaults, as text; it is part of the identity of the log.
  std::string Digest() const;
};

/// The same log with poses of its body at each pair of images, instead of others that it has; the
/// estimate is causal (odometry.h). With an inertial unit that has a calibration they are those of
/// VisualInertialOdometry, without one those of VisualOdometry. Images are cam0 and cam1, or color0
/// (or cam0) and depth0 where there is no pair; depth may have stamps of its own. What was measured
/// after an image waits until its pose is known: 0.1 s of the log, and while a start in motion is
/// tried a few seconds.
///
/// Without a unit up is what the first depth image shows, if its floors and walls leave no doubt
/// (gravity.h); else the camera is taken for level at the start. A note says which.
/// Of noise that the calibration does not tell, that of OdometryUnitOptions is taken, with a note.
/// Images that cannot be decoded or have no partner of their stamp are passed over and counted in
/// the notes at the end, and so is how often the odometry was lost.
/// Errors: FIELD_INVALID when the log has no such images, a calibration is not valid, or the mesh's
/// file cannot be made; then of LogSource::Next, and of writing the mesh when the log ends.
absl::StatusOr<std::unique_ptr<LogSource>> EstimatePoses(std::unique_ptr<LogSource> log,
                                                         const LogOptions& log_options,
                                                         const OdometryLogOptions& options);

}  // namespace dsg::ingest
