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
     "to centimetres"},
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

constexpr OptionField<OdometryUnitOptions> kUnitFields[] = {
    {"odometry-gyro-noise", &OdometryUnitOptions::gyro_noise_factor, 0.1, 1000.0,
     "Noise of the gyroscope in units of its data sheet's: 1 if the calibration is that of the "
     "mounted unit"},
    {"odometry-accel-noise", &OdometryUnitOptions::accel_noise_factor, 0.1, 1000.0,
     "The same of the accelerometer: vibrating frames want more"},
    {"odometry-covariance", &OdometryUnitOptions::covariance_factor, 0.01, 10'000.0,
     "Covariances of poses are told so many times as large as noise alone makes them: in simulated "
     "and recorded logs squared errors are that much larger, since clocks and mountings are off, "
     "too"},
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
  return bound;
}

}  // namespace dsg::ingest
