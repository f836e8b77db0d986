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
};

}  // namespace

std::vector<BoundOption> InertialOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<InertialOptions>(kInertialFields, this, &bound);
  return bound;
}

}  // namespace dsg::ingest
