// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/inertial_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<InertialOptions> kInertialFields[] = {
    {"inertial-gap", &InertialOptions::gap_ns_max, 0.001, 1.0,
     "Inertial samples farther apart do not tell the motion in between, seconds: a rig in the hand "
     "sways at a few hertz, which a straight line over this still follows"},
    {"inertial-rate-most", &InertialOptions::rate_max_rad_s, 1.0, 1e6,
     "Samples of a higher rate of turning are left out once odometry has started, radians / "
     "second: gyroscopes end at 35 to 70"},
    {"inertial-force-most", &InertialOptions::force_max_m_s2, 10.0, 1e6,
     "The same of accelerations, metres / second^2: units on robots end at 160 to 320"},
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

constexpr OptionField<MotionStartOptions> kMotionStartFields[] = {
    {"inertial-start-keyframes", &MotionStartOptions::keyframe_count_min, 4, 1000,
     "Keyframes at least from which odometry starts in motion: three fit anything, and two more "
     "show what does not fit"},
    {"inertial-start-way", &MotionStartOptions::way_sigma_m, 1e-5, 1.0,
     "What stereo errs by about the way between two keyframes, one standard deviation of each "
     "axis, metres: 3 millimetres for each of the two, three times what is seen of things 2 metres "
     "away"},
    {"inertial-start-turn", &MotionStartOptions::turn_sigma_rad, 1e-5, 0.5,
     "... and about the turn, radians: a tenth of a degree for each of the two"},
    {"inertial-start-misfit", &MotionStartOptions::misfit_sigma_max, 1.0, 1000.0,
     "Most by which cameras and unit may differ between two keyframes, standard deviations: one of "
     "60,000 right ones differs by more"},
    {"inertial-start-gravity", &MotionStartOptions::gravity_error_max, 0.0, 5.0,
     "Most by which gravity's length differs from what it is, when it is found free of that, "
     "metres / second^2: three standard deviations of a bias"},
    {"inertial-start-tilt", &MotionStartOptions::tilt_sigma_max, 0.0001, 1.0,
     "Most that may be unknown of where up is, one standard deviation, radians: twice what a bias "
     "of the accelerometer leaves unknown at rest"},
    {"inertial-start-steps", &MotionStartOptions::step_count, 1, 100,
     "Steps of the fit of all states together: it has converged by then"},
};

constexpr OptionField<ImuFaultOptions> kImuFaultFields[] = {
    {"inertial-fault-span", &ImuFaultOptions::span_ns, 0.1, 600.0,
     "Samples of this long at least say what their unit of measure is, seconds: nothing falls for "
     "longer"},
    {"inertial-fault-scale", &ImuFaultOptions::scale_error_max, 0.0, 0.5,
     "Share by which a scale may differ from that of a unit of measure: motion and biases change "
     "the mean by a tenth"},
    {"inertial-fault-force", &ImuFaultOptions::force_spread_max, 0.1, 0.9,
     "... and by which nine of ten accelerations differ from gravity: without gravity they would "
     "differ by more"},
    {"inertial-fault-clipped", &ImuFaultOptions::clipped_count_min, 2, 1000,
     "Samples at one value in a row that make a peak a clipped one: slow peaks of coarse units "
     "have four"},
    {"inertial-fault-clipped-rate", &ImuFaultOptions::clipped_rate_min, 0.0, 100.0,
     "... at a rate of this or more, radians / second: no unit's range ends below 125 degrees / "
     "second"},
    {"inertial-fault-clipped-accel", &ImuFaultOptions::clipped_accel_min, 0.0, 1000.0,
     "... or an acceleration of this or more, metres / second^2: no unit's range ends below 2 g, "
     "and at rest values repeat up to 1 g"},
    {"inertial-fault-repeats", &ImuFaultOptions::repeat_share_max, 0.0, 1.0,
     "Share of the samples that may repeat the one before: a unit read twice as often as it "
     "measures has half of them"},
    {"inertial-fault-turns", &ImuFaultOptions::turn_count_min, 4, 10'000,
     "Turns between keyframes at least, before those of unit and cameras are compared: fewer agree "
     "by accident"},
    {"inertial-fault-turn-rate", &ImuFaultOptions::turn_rate_sigma_min, 0.001, 10.0,
     "... and how much the rate of turning varies by, one standard deviation, radians / second: "
     "eight times the noise of cameras"},
    {"inertial-fault-correlation", &ImuFaultOptions::turn_correlation_min, 0.0, 1.0,
     "Least correlation of the rates of unit and cameras: noise leaves 0.98"},
    {"inertial-fault-axes", &ImuFaultOptions::axes_ratio_min, 1.1, 100.0,
     "Axes are taken as swapped if that leaves so many times less than the calibration's: a "
     "calibration that is right is at most worse by chance"},
};

}  // namespace

std::vector<BoundOption> MotionStartOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<MotionStartOptions>(kMotionStartFields, this, &bound);
  return bound;
}

std::vector<BoundOption> ImuFaultOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<ImuFaultOptions>(kImuFaultFields, this, &bound);
  return bound;
}

std::vector<BoundOption> InertialOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<InertialOptions>(kInertialFields, this, &bound);
  BindFields<MotionStartOptions>(kMotionStartFields, &start, &bound);
  BindFields<ImuFaultOptions>(kImuFaultFields, &fault, &bound);
  return bound;
}

}  // namespace dsg::ingest
