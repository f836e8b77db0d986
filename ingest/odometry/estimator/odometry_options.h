// SPDX-License-Identifier: Apache-2.0
// The numbers of odometry, with an inertial unit and without.
#pragma once

#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/config/option_field.h"
#include "ingest/odometry/frontend/frontend_options.h"
#include "ingest/odometry/inertial/inertial_options.h"
#include "ingest/odometry/window/window_options.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// How features are followed and checked between keyframes. Source: RSS 2020, section V-A.
enum class OdometryMethod {
  /// Five points, and three of stereo: images alone.
  kFivePoint,
  /// Two points, and one of stereo: the rotation is the gyroscope's.
  kTwoPoint,
  /// The same, and features are sought where the gyroscope turns them ("DVIO").
  kDynamic,
};

/// "5pt", "2pt", "dvio". Errors: INVALID_ARGUMENT/FIELD_INVALID for another name.
absl::StatusOr<OdometryMethod> ParseOdometryMethod(std::string_view name);

struct OdometryKeyframeOptions {
  /// Keyframes are this far apart at least, and at most, ns.
  TimeNs period_ns_min = 200'000'000;
  TimeNs period_ns_max = kNsPerSecond;
  /// Between both a keyframe is due when the median feature has moved this far, the rotation taken
  /// off, pixels, or fewer of the last keyframe's features are left than this share.
  double parallax_px = 6.0;
  double share_min = 0.6;
  /// Features of the last keyframe that are enough to tell the motion.
  int sight_count_min = 8;
  /// With fewer than that the unit alone is believed for so long, ns.
  TimeNs blind_ns_max = 2 * kNsPerSecond;
};

/// How sure a start is, standard deviations; and what grows while nothing is known.
struct OdometryStartOptions {
  /// Keyframes that tell a start in motion.
  int keyframe_count = 10;
  double tilt_rad = 0.03;
  double velocity_m_s = 0.2;
  double gyro_bias_rad_s = 0.02;
  double accel_bias_m_s2 = 0.1;
  /// How fast a robot may go that is not seen to move, m/s, and how fast its heading is lost
  /// without a gyroscope, rad/s.
  double lost_speed_m_s = 1.0;
  double lost_turn_rad_s = 1.0;
};

/// Of odometry without an inertial unit.
struct OdometryVisualOptions {
  /// Sizes of the image in which features are sought, instead of the tracker's: nobody tells the
  /// rotation.
  int level_count = 5;
  /// The last turn is expected to go on into an image that comes so soon, ns.
  TimeNs lead_ns_max = 100'000'000;
  /// A landmark agrees with a pose that misses it by this at most, pixels.
  double inlier_px = 3.0;
  /// Share of the landmarks that are followed which have to agree with a pose.
  double agree_share_min = 0.5;
  /// Images that tell no pose are passed over for so long, ns.
  TimeNs blind_ns_max = kNsPerSecond;
  /// Standard deviation of a depth camera's depth at one metre, m; it grows with the square.
  double depth_sigma_m = 0.004;
  /// Images and depth images this far apart at most belong together, ns.
  TimeNs apart_ns_max = 20'000'000;
};

/// Vibration and temperature make a mounted unit noisier than its data sheet says.
struct OdometryUnitOptions {
  /// Of a unit of which the log says none: rad/s/sqrt(Hz), rad/s^2/sqrt(Hz), m/s^2/sqrt(Hz),
  /// m/s^3/sqrt(Hz).
  double gyro_noise_density = 3e-4;
  double gyro_random_walk = 3e-5;
  double accel_noise_density = 4e-3;
  double accel_random_walk = 3e-3;
  double gyro_noise_factor = 1.0;
  double accel_noise_factor = 1.0;
  /// Covariances are told so many times as large as noise alone makes them: clocks and mountings
  /// are off, too, and followed features err alike from image to image.
  double covariance_factor = 10.0;
  /// The path is doubted where at least this share of the features with distances agree on another
  /// motion since the last keyframe, that differs by this way or this turn at least.
  double doubt_share_min = 0.5;
  /// Unless so many of the same agree with the path, too: then they do not tell the two apart.
  double doubt_path_share_max = 0.25;
  double doubt_way_m = 0.15;
  double doubt_turn_rad = 0.05;
  /// After so many keyframes in a row that are doubted the robot is lost.
  int doubt_count_max = 3;
};

struct OdometryOptions {
  OdometryMethod method = OdometryMethod::kDynamic;
  FrontendOptions frontend;
  InertialOptions inertial;
  WindowOptions window;
  OdometryKeyframeOptions keyframe;
  OdometryStartOptions start;
  OdometryUnitOptions unit;
  OdometryVisualOptions visual;

  std::vector<BoundOption> Bind();
};

}  // namespace dsg::ingest
