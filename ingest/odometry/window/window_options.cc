// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/window/window_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<WindowOptions> kWindowFields[] = {
    {"odometry-window-keyframes", &WindowOptions::keyframe_count, 2, 100,
     "Keyframes that are estimated together; older ones become a prior: more than 12 cost time and "
     "bring little"},
    {"odometry-window-steps", &WindowOptions::step_count, 1, 100,
     "Steps of the solver after each keyframe: it begins where the inertial unit predicts"},
    {"odometry-window-pixel", &WindowOptions::pixel_sigma_px, 0.01, 50.0,
     "Standard deviation of a feature's place, pixels: that of a tracker that drifts along edges"},
    {"odometry-window-disparity", &WindowOptions::disparity_sigma_px, 0.01, 50.0,
     "Standard deviation of a disparity, pixels: calibrations err too"},
    {"odometry-window-offset", &WindowOptions::disparity_offset_px, 1e-6, 100.0,
     "How far off all disparities may be, one standard deviation, pixels: 0.1 degrees between the "
     "cameras make one"},
    {"odometry-window-baseline", &WindowOptions::baseline_share, 1e-6, 0.5,
     "The same of the baseline, a share of it: calibrations measure it to 0.2 mm of a decimetre, "
     "and a unit whose clock is a millisecond off tells it worse"},
    {"odometry-window-clock", &WindowOptions::clock_s, 1e-6, 0.1,
     "The same of the clock of the unit beside the stamps of images, seconds: drivers that stamp "
     "what they receive are some milliseconds late"},
    {"odometry-window-huber", &WindowOptions::huber_sigmas, 0.1, 1000.0,
     "From so many standard deviations on a miss costs its size instead of its square: Huber's "
     "choice"},
    {"odometry-window-miss", &WindowOptions::miss_px_max, 0.1, 1000.0,
     "Landmarks that miss their images by more on average are dropped, pixels: three standard "
     "deviations"},
    {"odometry-window-parallax", &WindowOptions::parallax_deg_min, 0.01, 90.0,
     "Angle between the rays to a landmark without a disparity, degrees: below it the distance is "
     "a guess"},
    {"odometry-window-nearest", &WindowOptions::nearest_m, 0.01, 10.0,
     "Least distance of a landmark, metres: nearer ones are out of focus"},
    {"odometry-window-farthest", &WindowOptions::farthest_m, 1.0, 10'000.0,
     "Largest distance of a landmark, metres: that of a large hall", "odometry-window-nearest"},
};

}  // namespace

std::vector<BoundOption> WindowOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<WindowOptions>(kWindowFields, this, &bound);
  return bound;
}

}  // namespace dsg::ingest
