// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/motion/odometry_drift.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/motion/imu.h"
#include "schema/base/random.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

constexpr uint64_t kDriftStream = 1;
constexpr uint64_t kRightStream = 2;
constexpr uint64_t kWrongStream = 3;
// How finely the way is searched for places seen before.
constexpr TimeNs kSearchStepNs = 200'000'000;
// A loop that says nearly the truth is not wrong.
constexpr double kWrongMinM = 1.0;
constexpr int kTriesMax = 1000;

Eigen::Quaterniond TurnBy(const Eigen::Vector3d& rotation) {
  const double angle_rad = rotation.norm();
  if (angle_rad < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, rotation / angle_rad));
}

// One sample of the way in each search step.
struct Sample {
  StampedPose pose;
  double way_m = 0.0;
};

std::vector<Sample> SampleWay(const std::vector<StampedPose>& truth) {
  std::vector<Sample> samples;
  double way_m = 0.0;
  for (size_t i = 0; i < truth.size(); ++i) {
    if (i > 0) {
      way_m += (truth[i].map_T_body.position - truth[i - 1].map_T_body.position).norm();
    }
    if (samples.empty() || truth[i].time_ns - samples.back().pose.time_ns >= kSearchStepNs) {
      samples.push_back({truth[i], way_m});
    }
  }
  return samples;
}

std::vector<SimulatedLoop> DrawRight(const std::vector<Sample>& samples,
                                     const DriftOptions& options) {
  Random random(options.seed, kRightStream);
  std::vector<SimulatedLoop> loops;
  for (const Sample& to : samples) {
    if (!loops.empty() && to.pose.time_ns - loops.back().to_ns < options.loop_period_ns) continue;
    std::vector<const Sample*> known;
    for (const Sample& from : samples) {
      const bool is_apart = to.pose.time_ns - from.pose.time_ns >= options.loop_age_ns &&
                            to.way_m - from.way_m >= options.loop_way_m;
      if (!is_apart) break;
      const Pose3d from_T_to = from.pose.map_T_body.Inverse() * to.pose.map_T_body;
      if (from_T_to.position.norm() <= options.loop_range_m &&
          AngleBetween(from_T_to.orientation, Eigen::Quaterniond::Identity()) <=
              options.loop_turn_rad) {
        known.push_back(&from);
      }
    }
    if (known.empty()) continue;
    const StampedPose& from = known[random.Index(static_cast<int>(known.size()))]->pose;
    Pose3d from_T_to = from.map_T_body.Inverse() * to.pose.map_T_body;
    from_T_to.position += NormalVector(options.loop_sigma_m, &random);
    from_T_to.orientation =
        (from_T_to.orientation * TurnBy(NormalVector(options.loop_sigma_rad, &random)))
            .normalized();
    loops.push_back({from.time_ns, to.pose.time_ns, from_T_to, true});
  }
  return loops;
}

// Two places that look alike: the pose is such as between two views of one place.
std::vector<SimulatedLoop> DrawWrong(const std::vector<Sample>& samples, size_t count,
                                     const DriftOptions& options) {
  Random random(options.seed, kWrongStream);
  std::vector<SimulatedLoop> loops;
  const auto sample_count = static_cast<int>(samples.size());
  for (int tries = 0; tries < kTriesMax && loops.size() < count && sample_count > 0; ++tries) {
    const StampedPose& to = samples[random.Index(sample_count)].pose;
    const StampedPose& from = samples[random.Index(sample_count)].pose;
    const double angle_rad = random.Uniform(-std::numbers::pi, std::numbers::pi);
    const double range_m = random.Uniform(0.0, options.loop_range_m);
    const double turn_rad = random.Uniform(-options.loop_turn_rad, options.loop_turn_rad);
    if (to.time_ns - from.time_ns < options.loop_age_ns) continue;
    Pose3d from_T_to;
    from_T_to.position = {range_m * std::cos(angle_rad), range_m * std::sin(angle_rad), 0.0};
    from_T_to.orientation = TurnBy({0.0, 0.0, turn_rad});
    const Pose3d right = from.map_T_body.Inverse() * to.map_T_body;
    if ((right.position - from_T_to.position).norm() < kWrongMinM) continue;
    loops.push_back({from.time_ns, to.time_ns, from_T_to, false});
  }
  return loops;
}

absl::Status CheckRange(const char* field, double value, double min, double max) {
  if (value >= min && value <= max) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(field, " is ", value, "; give ", min, " to ", max),
                   {{"field", field}, {"value", absl::StrCat(value)}});
}

}  // namespace

absl::Status DriftOptions::Validate() const {
  DSG_RETURN_IF_ERROR(CheckRange("drift_m_per_m", drift_m_per_m, 0.0, 1.0));
  DSG_RETURN_IF_ERROR(CheckRange("drift_rad_per_m", drift_rad_per_m, 0.0, 1.0));
  DSG_RETURN_IF_ERROR(
      CheckRange("loop_period", 1e-9 * static_cast<double>(loop_period_ns), 0.0, 1e6));
  return CheckRange("wrong_loops", wrong_share, 0.0, 0.95);
}

std::vector<StampedPose> AddDrift(const std::vector<StampedPose>& truth,
                                  const DriftOptions& options) {
  Random random(options.seed, kDriftStream);
  std::vector<StampedPose> odometry;
  odometry.reserve(truth.size());
  double yaw_rad = 0.0;
  for (size_t i = 0; i < truth.size(); ++i) {
    StampedPose pose = truth[i];
    if (i > 0) {
      const Pose3d& from = truth[i - 1].map_T_body;
      const Eigen::Vector3d step_map = pose.map_T_body.position - from.position;
      const double way_m = step_map.norm();
      const double walk = std::sqrt(way_m);
      const Eigen::Vector3d noise = NormalVector(options.drift_m_per_m * walk, &random);
      const Eigen::Quaterniond turned = TurnBy({0.0, 0.0, yaw_rad});
      pose.map_T_body.position = odometry.back().map_T_body.position + turned * (step_map + noise);
      yaw_rad += options.drift_rad_per_m * walk * random.Normal();
    }
    pose.map_T_body.orientation =
        (TurnBy({0.0, 0.0, yaw_rad}) * pose.map_T_body.orientation).normalized();
    odometry.push_back(pose);
  }
  return odometry;
}

std::vector<SimulatedLoop> DrawLoops(const std::vector<StampedPose>& truth,
                                     const DriftOptions& options) {
  const std::vector<Sample> samples = SampleWay(truth);
  std::vector<SimulatedLoop> loops = DrawRight(samples, options);
  const double wrong_per_right = options.wrong_share / (1.0 - options.wrong_share);
  const auto wrong_count =
      static_cast<size_t>(std::lround(wrong_per_right * static_cast<double>(loops.size())));
  const std::vector<SimulatedLoop> wrong = DrawWrong(samples, wrong_count, options);
  loops.insert(loops.end(), wrong.begin(), wrong.end());
  std::stable_sort(loops.begin(), loops.end(), [](const SimulatedLoop& a, const SimulatedLoop& b) {
    return std::tie(a.to_ns, a.from_ns) < std::tie(b.to_ns, b.from_ns);
  });
  return loops;
}

}  // namespace dsg::simulator
