// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/inertial_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<InertialOptions> kInertialFields[] = {
    {"inertial-gap", &InertialOptions::gap_ns_max, 0.001, 1.0,
     "Inertial samples farther apart do not tell the motion in between, seconds: a rig in the hand "
     "sways at a few hertz, which a straight line over this still follows"},
    {"inertial-gyro-shift", &InertialOptions::gyro_bias_shift_max, 0.0, 1.0,
     "Samples are integrated anew when the gyro bias has moved further, radians / second: within a "
     "second the error of the first-order correction stays below the noise"},
    {"inertial-accel-shift", &InertialOptions::accel_bias_shift_max, 0.0, 10.0,
     "The same of the accelerometer's bias, metres / second^2"},
    {"inertial-gravity", &InertialOptions::gravity_m_s2, 9.7, 9.9,
     "Gravity, metres / second^2: within 0.05 of that of every place on earth"},
    {"inertial-rest", &InertialOptions::rest_ns, 0.1, 60.0,
     "Standing still is told of samples of this long, seconds: swaying takes about a second"},
    {"inertial-rest-gyro", &InertialOptions::rest_gyro_sigma_max, 0.0, 1.0,
     "Most by which a rate of turning varies at rest, one standard deviation, radians / second: "
     "ten times the noise of a cheap unit, a tenth of a slow turn"},
    {"inertial-rest-accel", &InertialOptions::rest_accel_sigma_max, 0.0, 10.0,
     "The same of accelerations, metres / second^2: motors may run"},
    {"inertial-rest-rate", &InertialOptions::rest_rate_max, 0.0, 1.0,
     "Largest bias of a gyro, radians / second: 11 degrees / second, above it the unit turns or "
     "measures degrees"},
    {"inertial-rest-gravity", &InertialOptions::rest_gravity_error_max, 0.0, 5.0,
     "Most by which what is felt at rest differs from gravity, metres / second^2: five standard "
     "deviations of a bias"},
    {"inertial-rest-bias", &InertialOptions::rest_accel_bias_sigma, 0.0001, 5.0,
     "What an accelerometer's bias may be after it was switched on, one standard deviation, "
     "metres / second^2: cheap units"},
};

}  // namespace

std::vector<BoundOption> InertialOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<InertialOptions>(kInertialFields, this, &bound);
  return bound;
}

}  // namespace dsg::ingest
