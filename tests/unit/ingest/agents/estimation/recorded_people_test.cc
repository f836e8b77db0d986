// SPDX-License-Identifier: Apache-2.0
// How near the truth the torso graph comes when everybody is known by name: simulated logs.
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "gtest/gtest.h"
#include "ingest/agents/estimation/torso_graph.h"
#include "ingest/truth/truth.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/agents/estimation/walker.h"

namespace dsg::ingest {
namespace {

// Longer unseen, the tracker begins a new track.
constexpr TimeNs kTrackGapNs = 5'000'000'000;
constexpr double kAnkleVisibility = 0.7;
// Nearer, the feet are below the image.
constexpr double kFeetRangeM = 2.1;

struct Cues {
  bool floor = false;
  bool depth = false;
  bool height = false;
};

Pose3d RobotAt(const truth::Truth& truth, TimeNs time_ns) {
  const auto after =
      std::lower_bound(truth.robot.begin(), truth.robot.end(), time_ns,
                       [](const truth::RobotState& s, TimeNs t) { return s.time_ns < t; });
  if (after == truth.robot.end()) return truth.robot.back().map_T_body;
  if (after == truth.robot.begin()) return after->map_T_body;
  const auto before = after - 1;
  const double fraction = static_cast<double>(time_ns - before->time_ns) /
                          static_cast<double>(after->time_ns - before->time_ns);
  return Interpolate(before->map_T_body, after->map_T_body, fraction);
}

double HeadingAt(const truth::Truth& truth, int human, TimeNs time_ns) {
  const auto begin =
      std::lower_bound(truth.human_states.begin(), truth.human_states.end(), time_ns - 60'000'000,
                       [](const truth::HumanState& s, TimeNs t) { return s.time_ns < t; });
  for (auto state = begin; state != truth.human_states.end(); ++state) {
    if (state->human != human) continue;
    const Eigen::Vector3d x = state->map_T_torso.orientation * Eigen::Vector3d::UnitX();
    return std::atan2(x.y(), x.x());
  }
  return 0.0;
}

Eigen::Matrix3d AlongRay(const Eigen::Vector3d& ray, double along_m, double across_m) {
  const Eigen::Matrix3d along = ray * ray.transpose();
  return along_m * along_m * along + across_m * across_m * (Eigen::Matrix3d::Identity() - along);
}

PositionCue RayCue(PositionCue::Kind kind, const Eigen::Vector3d& torso_map,
                   const Eigen::Vector3d& ray, double sigma_m) {
  PositionCue cue;
  cue.kind = kind;
  cue.torso_map = torso_map;
  cue.information_map = ray * ray.transpose() / (sigma_m * sigma_m);
  return cue;
}

void AddCues(const truth::DetectionTruth& row, const Cues& cues, Random* random,
             PersonObservation* observation) {
  const Eigen::Vector3d ray = (row.torso_map - observation->camera_map).normalized();
  const double range_m = (row.torso_map - observation->camera_map).norm();
  // Drawn always, so that each combination sees the same noise.
  const double floor_noise = random->Normal();
  const double depth_noise = random->Normal();
  if (cues.floor && row.visibility > kAnkleVisibility && range_m > kFeetRangeM) {
    const double sigma_m = range_m * range_m * 3.0 / (415.7 * 1.2) + 0.05;
    observation->cues.push_back(RayCue(PositionCue::Kind::kFloorContact,
                                       row.torso_map + sigma_m * floor_noise * ray, ray, sigma_m));
  }
  if (cues.depth && row.visibility > 0.05) {
    const double sigma_m = 0.06 + 0.002 * range_m * range_m;
    observation->cues.push_back(RayCue(PositionCue::Kind::kDepthImage,
                                       row.torso_map + sigma_m * depth_noise * ray, ray, sigma_m));
  }
  if (cues.height) {
    PositionCue cue;
    cue.kind = PositionCue::Kind::kTorsoHeight;
    cue.torso_map = Eigen::Vector3d(0.0, 0.0, 0.95);
    cue.information_map(2, 2) = 1.0 / (0.15 * 0.15);
    observation->cues.push_back(cue);
  }
}

struct Person {
  std::vector<PersonObservation> observations;
  std::vector<Pose3d> truth;
};

/// One per person and visit.
std::vector<std::pair<int, Person>> People(const truth::Truth& truth, const Cues& cues) {
  std::map<int, std::vector<Person>> tracks;
  Random random(truth.seed, 77);
  const CameraCalibration* camera = truth.rig.FindCamera("cam0");
  for (const truth::DetectionTruth& row : truth.detections) {
    if (row.human < 0 || row.touches_border) continue;
    PersonObservation observation;
    observation.time_ns = row.time_ns;
    observation.camera_map = (RobotAt(truth, row.time_ns) * camera->body_T_camera).position;
    const Eigen::Vector3d offset = row.detected_torso_map - observation.camera_map;
    observation.position_covariance_map =
        AlongRay(offset.normalized(), 0.12 * offset.norm() + 0.1, 0.02 * offset.norm() + 0.08);
    const double heading = HeadingAt(truth, row.human, row.time_ns);
    const double heading_seen = heading + 0.35 * random.Normal();
    observation.map_T_torso = TorsoAt(row.detected_torso_map, heading_seen);
    AddCues(row, cues, &random, &observation);
    std::vector<Person>& own = tracks[row.human];
    if (own.empty() || row.time_ns - own.back().observations.back().time_ns > kTrackGapNs) {
      own.emplace_back();
    }
    own.back().observations.push_back(observation);
    own.back().truth.push_back(TorsoAt(row.torso_map, heading));
  }
  std::vector<std::pair<int, Person>> people;
  for (auto& [human, own] : tracks) {
    for (Person& person : own) people.emplace_back(human, std::move(person));
  }
  return people;
}

struct Figures {
  double error_m = 0.0;
  double live_m = 0.0;
  double heading_rad = 0.0;
  double nees = 0.0;
  double sound_share = 0.0;
  /// Of detections in the gate of the prediction, and its squared distance.
  double gated_share = 0.0;
};

struct Sums {
  double error_m = 0.0;
  double live_m = 0.0;
  double heading_rad = 0.0;
  int count = 0;
};

double Square(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance) {
  return error.dot(covariance.llt().solve(error));
}

Figures Estimate(const std::vector<std::pair<int, Person>>& people, const TorsoOptions& options) {
  std::map<int, Sums> sums;
  Figures figures;
  int count = 0;
  int predicted_count = 0;
  for (const auto& [human, person] : people) {
    TorsoGraph graph(options);
    Sums& sum = sums[human];
    for (size_t i = 0; i < person.observations.size(); ++i) {
      const PersonObservation& observation = person.observations[i];
      if (i > 0) {
        const TorsoPrediction prediction = graph.Predict(observation.time_ns);
        const double square =
            Square(observation.map_T_torso.position - prediction.position_map,
                   prediction.covariance_map + observation.position_covariance_map);
        figures.gated_share += square < 11.34 ? 1.0 : 0.0;
        ++predicted_count;
      }
      graph.Add(observation);
      graph.SolveRecent();
      sum.live_m +=
          (graph.estimates().back().map_T_torso.position - person.truth[i].position).norm();
    }
    graph.SolveAll();
    for (size_t i = 0; i < person.truth.size(); ++i) {
      const TorsoEstimate& estimate = graph.estimates()[i];
      const Eigen::Vector3d error = estimate.map_T_torso.position - person.truth[i].position;
      sum.error_m += error.norm();
      sum.heading_rad +=
          AngleBetween(estimate.map_T_torso.orientation, person.truth[i].orientation);
      const double square = Square(error, PositionCovariance(estimate));
      figures.nees += square;
      figures.sound_share += square < 11.34 ? 1.0 : 0.0;
      ++sum.count;
      ++count;
    }
  }
  for (const auto& [human, sum] : sums) {
    figures.error_m += sum.error_m / sum.count / static_cast<double>(sums.size());
    figures.live_m += sum.live_m / sum.count / static_cast<double>(sums.size());
    figures.heading_rad += sum.heading_rad / sum.count / static_cast<double>(sums.size());
  }
  figures.nees /= 3.0 * count;
  figures.sound_share /= count;
  figures.gated_share /= std::max(1, predicted_count);
  return figures;
}

double Raw(const std::vector<std::pair<int, Person>>& people) {
  std::map<int, std::pair<double, int>> sums;
  for (const auto& [human, person] : people) {
    for (size_t i = 0; i < person.truth.size(); ++i) {
      sums[human].first +=
          (person.observations[i].map_T_torso.position - person.truth[i].position).norm();
      ++sums[human].second;
    }
  }
  double mean = 0.0;
  for (const auto& [human, sum] : sums) {
    mean += sum.first / sum.second / static_cast<double>(sums.size());
  }
  return mean;
}

double Number(const char* name, double otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::atof(text);
}

/// The defaults, or what the environment says, for trying others.
TorsoOptions Options(TorsoModel model) {
  TorsoOptions options;
  options.model = model;
  options.loss_scale = Number("DSG_TORSO_LOSS", options.loss_scale);
  options.paper_loss_scale = Number("DSG_TORSO_PAPER_LOSS", options.paper_loss_scale);
  options.acceleration_sigma = Number("DSG_TORSO_ACCELERATION", options.acceleration_sigma);
  options.vertical_acceleration_sigma =
      Number("DSG_TORSO_VERTICAL", options.vertical_acceleration_sigma);
  options.walk_memory_s = Number("DSG_TORSO_MEMORY", options.walk_memory_s);
  options.turn_walk_sigma_rad = Number("DSG_TORSO_TURN", options.turn_walk_sigma_rad);
  options.lasting_share = Number("DSG_TORSO_SHARE", options.lasting_share);
  options.lasting_s = Number("DSG_TORSO_LASTING", options.lasting_s);
  options.lag_count = static_cast<int>(Number("DSG_TORSO_LAG", options.lag_count));
  return options;
}

void Print(const char* name, const Figures& figures) {
  std::printf("  %-22s %6.3f %6.3f %8.3f %6.2f %6.3f %6.3f\n", name, figures.error_m,
              figures.live_m, figures.heading_rad, figures.nees, figures.sound_share,
              figures.gated_share);
}

TEST(RecordedPeople, AreFoundNearerTheTruthThanDetectionsSay) {
  const char* logs = std::getenv("DSG_LOGS");
  if (logs == nullptr) {
    GTEST_SKIP() << "needs simulated logs with truth: set DSG_LOGS to their folders, with colons";
  }
  for (const std::string& log : std::vector<std::string>(absl::StrSplit(logs, ':'))) {
    const absl::StatusOr<truth::Truth> truth = truth::ReadTruth(log + "/truth");
    ASSERT_TRUE(truth.ok()) << truth.status();
    const auto bare = People(*truth, {});
    std::printf("%s: %zu tracks, raw %.3f m\n", log.c_str(), bare.size(), Raw(bare));
    std::printf("  %-22s %6s %6s %8s %6s %6s %6s\n", "", "full", "live", "heading", "nees", "sound",
                "gated");
    Print("paper", Estimate(bare, Options(TorsoModel::kPaper)));
    const TorsoOptions smooth = Options(TorsoModel::kSmooth);
    Print("smooth", Estimate(bare, smooth));
    Print("smooth height", Estimate(People(*truth, {false, false, true}), smooth));
    const Figures floor = Estimate(People(*truth, {true, false, true}), smooth);
    Print("smooth floor", floor);
    const Figures depth = Estimate(People(*truth, {true, true, true}), smooth);
    Print("smooth depth", depth);
    EXPECT_LT(depth.error_m, floor.error_m);
    EXPECT_LT(floor.error_m, Raw(bare));
  }
}

}  // namespace
}  // namespace dsg::ingest
