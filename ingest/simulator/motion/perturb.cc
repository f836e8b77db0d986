// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/perturb.h"

#include <algorithm>
#include <cmath>

#include "ingest/simulator/motion/imu.h"
#include "schema/base/random.h"

namespace dsg::simulator {
namespace {

using ingest::CameraCalibration;
using ingest::RigCalibration;

constexpr uint64_t kPerturbStream = 0x70657274;  // "pert"

double DrawNormal(double sigma, Random* random) {
  return sigma * std::clamp(random->Normal(), -3.0, 3.0);
}

// The length's standard deviation is `sigma`: a third of the variance on each axis.
Eigen::Vector3d DrawVector(double sigma, Random* random) {
  const double x = DrawNormal(sigma / std::sqrt(3.0), random);
  const double y = DrawNormal(sigma / std::sqrt(3.0), random);
  const double z = DrawNormal(sigma / std::sqrt(3.0), random);
  return {x, y, z};
}

bool SamePlaceAndLens(const CameraCalibration& a, const CameraCalibration& b) {
  return a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy &&
         a.body_T_camera.position == b.body_T_camera.position &&
         a.body_T_camera.orientation.coeffs() == b.body_T_camera.orientation.coeffs();
}

void Perturb(const PerturbOptions& options, Random* random, CameraCalibration* camera) {
  camera->fx += DrawNormal(options.pixel, random);
  camera->fy += DrawNormal(options.pixel, random);
  camera->cx += DrawNormal(options.pixel, random);
  camera->cy += DrawNormal(options.pixel, random);
  const Eigen::Vector3d turn = DrawVector(options.rotation_rad, random);
  Pose3d& pose = camera->body_T_camera;
  if (turn.norm() > 0.0) {
    pose.orientation =
        (pose.orientation * Eigen::AngleAxisd(turn.norm(), turn.normalized())).normalized();
  }
  pose.position += DrawVector(options.translation_m, random);
}

CameraCalibration ReferenceCamera(const char* name, double rate_hz, double y_m) {
  CameraCalibration camera;
  camera.name = name;
  camera.width = 720;
  camera.height = 480;
  camera.rate_hz = rate_hz;
  camera.fx = camera.fy = 415.692194;
  camera.cx = 360.0;
  camera.cy = 240.0;
  // Optical axes (x right, y down, z forward) on a body with x forward, y left, z up.
  camera.body_T_camera.position = Eigen::Vector3d(0.0, y_m, 0.0);
  camera.body_T_camera.orientation = Eigen::Quaterniond(-0.5, 0.5, -0.5, 0.5);
  return camera;
}

}  // namespace

RigCalibration ReferenceRig() {
  RigCalibration rig;
  rig.cameras = {ReferenceCamera("cam0", 20.0, 0.05), ReferenceCamera("cam1", 20.0, -0.05),
                 ReferenceCamera("color0", 5.0, 0.05), ReferenceCamera("depth0", 5.0, 0.05),
                 ReferenceCamera("label0", 5.0, 0.05)};
  const ImuModel datasheet;
  rig.imu = {.name = "imu0",
             .rate_hz = 200.0,
             .gyro_noise_density = datasheet.gyro_noise_density,
             .gyro_random_walk = datasheet.gyro_random_walk,
             .accel_noise_density = datasheet.accel_noise_density,
             .accel_random_walk = datasheet.accel_random_walk,
             .body_T_imu = Pose3d()};
  return rig;
}

PerturbedRig PerturbRig(const RigCalibration& truth, const PerturbOptions& options, uint64_t seed) {
  Random random(seed, kPerturbStream);
  PerturbedRig out{truth, 0};
  out.camera_time_offset_ns = std::llround(1e9 * DrawNormal(options.time_offset_s, &random));
  std::vector<CameraCalibration>& told = out.told.cameras;
  for (size_t i = 0; i < told.size(); ++i) {
    const auto end = truth.cameras.begin() + static_cast<ptrdiff_t>(i);
    const auto twin =
        std::find_if(truth.cameras.begin(), end, [&](const CameraCalibration& camera) {
          return SamePlaceAndLens(camera, truth.cameras[i]);
        });
    if (twin == end) {
      Perturb(options, &random, &told[i]);
      continue;
    }
    const CameraCalibration& same = told[static_cast<size_t>(twin - truth.cameras.begin())];
    told[i].fx = same.fx;
    told[i].fy = same.fy;
    told[i].cx = same.cx;
    told[i].cy = same.cy;
    told[i].body_T_camera = same.body_T_camera;
  }
  return out;
}

}  // namespace dsg::simulator
