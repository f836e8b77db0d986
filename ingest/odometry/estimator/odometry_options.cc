// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/estimator/odometry_options.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<OdometryKeyframeOptions> kKeyframeFields[] = {
    {"odometry-keyframe-least", &OdometryKeyframeOptions::period_ns_min, 0.01, 10.0,
     "Least time between keyframes, seconds: 0.2 leaves time for solving between them"},
    {"odometry-keyframe-most", &OdometryKeyframeOptions::period_ns_max, 0.01, 60.0,
     "Most time between keyframes, seconds: what the inertial unit alone tells of a second is good "
     "to centimetres",
     "odometry-keyframe-least"},
    {"odometry-keyframe-parallax", &OdometryKeyframeOptions::parallax_px, 0.0, 1000.0,
     "Median flow of features without their rotation after which a keyframe is due, pixels: below "
     "it a new one says little"},
    {"odometry-keyframe-share", &OdometryKeyframeOptions::share_min, 0.0, 1.0,
     "... or fewer of the last keyframe's features are left than this share: new ones are due"},
    {"odometry-sights", &OdometryKeyframeOptions::sight_count_min, 3, 1000,
     "Features of the last keyframe that are enough to tell the motion: three, and outliers"},
    {"odometry-blind", &OdometryKeyframeOptions::blind_ns_max, 0.0, 60.0,
     "For so long the inertial unit alone is believed while fewer are seen, seconds: then the "
     "position is off by decimetres, and the odometry starts anew"},
};

constexpr OptionField<OdometryStartOptions> kStartFields[] = {
    {"odometry-start-keyframes", &OdometryStartOptions::keyframe_count, 4, 100,
     "Keyframes after which a start in motion is tried: two seconds tell gravity from motion"},
    {"odometry-start-tilt", &OdometryStartOptions::tilt_rad, 0.0001, 1.0,
     "How far off the vertical is after a start in motion, one standard deviation, radians"},
    {"odometry-start-velocity", &OdometryStartOptions::velocity_m_s, 0.0001, 10.0,
     "The same of the velocity, metres / second"},
    {"odometry-start-gyro", &OdometryStartOptions::gyro_bias_rad_s, 0.0001, 1.0,
     "The same of the gyro's bias, radians / second"},
    {"odometry-start-accel", &OdometryStartOptions::accel_bias_m_s2, 0.0001, 5.0,
     "The same of the accelerometer's bias, metres / second^2: cheap units"},
    {"odometry-lost-speed", &OdometryStartOptions::lost_speed_m_s, 0.0, 100.0,
     "How fast a robot moves that is not seen, metres / second: the covariance grows by it until "
     "a new start"},
    {"odometry-lost-turn", &OdometryStartOptions::lost_turn_rad_s, 0.0, 100.0,
     "How fast it turns while its gyroscope says nothing, radians / second"},
};

constexpr OptionField<OdometryVisualOptions> kVisualFields[] = {
    {"odometry-visual-levels", &OdometryVisualOptions::level_count, 1, 10,
     "Without an inertial unit: sizes of the image, each half of the one before, that features are "
     "sought in: turns of 10 degrees between two images are found"},
    {"odometry-visual-lead", &OdometryVisualOptions::lead_ns_max, 0.0, 10.0,
     "... the last turn is expected to go on into an image that comes so soon, seconds: a hand "
     "turns another way within less than a second"},
    {"odometry-visual-inlier", &OdometryVisualOptions::inlier_px, 0.1, 50.0,
     "... a landmark agrees with a pose that misses it by this at most, pixels: three standard "
     "deviations of a feature's place"},
    {"odometry-visual-share", &OdometryVisualOptions::agree_share_min, 0.0, 1.0,
     "... and such a share of the landmarks that are followed has to: after a hand before the lens "
     "most are followed wrongly, and a few agree by accident"},
    {"odometry-visual-blind", &OdometryVisualOptions::blind_ns_max, 0.0, 60.0,
     "... images that tell no pose are passed over for so long, seconds, and the next one is "
     "compared with the last that did: a hand before the lens is gone by then"},
    {"odometry-visual-depth", &OdometryVisualOptions::depth_sigma_m, 1e-5, 1.0,
     "... standard deviation of a depth camera's depth at one metre, metres; it grows with the "
     "square: three times a Kinect's, since colour and depth are not taken at one time"},
    {"odometry-visual-apart", &OdometryVisualOptions::apart_ns_max, 0.0, 1.0,
     "... images and depth images this far apart at most belong together, seconds: TUM's own "
     "tools take 0.02"},
};

constexpr OptionField<OdometryUnitOptions> kUnitFields[] = {
    {"odometry-unit-gyro", &OdometryUnitOptions::gyro_noise_density, 1e-7, 1.0,
     "Noise density of a gyroscope of which the log says none (bags), radians / second / sqrt(Hz): "
     "0.017 degrees, a consumer unit's (BMI055: 0.014)"},
    {"odometry-unit-gyro-walk", &OdometryUnitOptions::gyro_random_walk, 1e-9, 1.0,
     "The same of the random walk of its bias, radians / second^2 / sqrt(Hz): 0.1 degrees / second "
     "in an hour"},
    {"odometry-unit-accel", &OdometryUnitOptions::accel_noise_density, 1e-6, 10.0,
     "The same of an accelerometer, metres / second^2 / sqrt(Hz): 400 micro-g, a consumer unit's "
     "(MPU-6050)"},
    {"odometry-unit-accel-walk", &OdometryUnitOptions::accel_random_walk, 1e-8, 10.0,
     "The same of the random walk of its bias, metres / second^3 / sqrt(Hz): that of EuRoC's unit"},
    {"odometry-gyro-noise", &OdometryUnitOptions::gyro_noise_factor, 0.1, 1000.0,
     "Noise of the gyroscope in units of its data sheet's: 1 if the calibration is that of the "
     "mounted unit"},
    {"odometry-accel-noise", &OdometryUnitOptions::accel_noise_factor, 0.1, 1000.0,
     "The same of the accelerometer: vibrating frames want more"},
    {"odometry-covariance", &OdometryUnitOptions::covariance_factor, 0.01, 10'000.0,
     "Covariances of poses are told so many times as large as noise alone makes them: in simulated "
     "and recorded logs squared errors are that much larger, since clocks and mountings are off, "
     "too"},
    {"odometry-doubt-share", &OdometryUnitOptions::doubt_share_min, 0.0, 1.0,
     "Share of the features with distances that must agree on another motion than the path before "
     "it is doubted: with half of them nobody can tell which is right"},
    {"odometry-doubt-path", &OdometryUnitOptions::doubt_path_share_max, 0.0, 1.0,
     "... and the share of them that may agree with the path all the same: more do not tell the "
     "two motions apart, as few points on a far wall"},
    {"odometry-doubt-way", &OdometryUnitOptions::doubt_way_m, 0.001, 100.0,
     "Least difference of these motions between two keyframes, metres: three times the largest of "
     "simulated and recorded logs without faults"},
    {"odometry-doubt-turn", &OdometryUnitOptions::doubt_turn_rad, 0.001, 3.0,
     "... or of their turns, radians: the same"},
    {"odometry-doubt-count", &OdometryUnitOptions::doubt_count_max, 1, 1000,
     "Keyframes in a row that are doubted after which the robot is lost: who passes the lens is "
     "gone by then, a velocity that is wrong stays"},
};

void Append(std::vector<BoundOption> more, std::vector<BoundOption>* bound) {
  bound->insert(bound->end(), more.begin(), more.end());
}

}  // namespace

absl::StatusOr<OdometryMethod> ParseOdometryMethod(std::string_view name) {
  if (name == "5pt") return OdometryMethod::kFivePoint;
  if (name == "2pt") return OdometryMethod::kTwoPoint;
  if (name == "dvio") return OdometryMethod::kDynamic;
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("odometry method \"", std::string(name), "\" is unknown; give 5pt, 2pt or dvio"),
      {{"field", "odometry"}, {"value", std::string(name)}});
}

std::vector<BoundOption> OdometryOptions::Bind() {
  std::vector<BoundOption> bound = frontend.Bind();
  Append(inertial.Bind(), &bound);
  Append(window.Bind(), &bound);
  BindFields<OdometryKeyframeOptions>(kKeyframeFields, &keyframe, &bound);
  BindFields<OdometryStartOptions>(kStartFields, &start, &bound);
  BindFields<OdometryUnitOptions>(kUnitFields, &unit, &bound);
  BindFields<OdometryVisualOptions>(kVisualFields, &visual, &bound);
  return bound;
}

}  // namespace dsg::ingest
