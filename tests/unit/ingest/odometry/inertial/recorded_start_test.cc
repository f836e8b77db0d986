// SPDX-License-Identifier: Apache-2.0
// Odometry started anywhere in recorded motion (EuRoC): true poses every 0.2 s with the noise of
// stereo, over 2 s. V1_02 flies, and stands on the floor before and after; MH_01 is carried about.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <tuple>

#include "ingest/odometry/inertial/imu_faults.h"
#include "ingest/odometry/inertial/moving_alignment.h"
#include "schema/model/rotation.h"
#include "tests/unit/ingest/odometry/inertial/euroc_tables.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"
#include "tests/unit/ingest/odometry/inertial/made_motion.h"

namespace dsg::ingest {
namespace {

using Eigen::Vector3d;

constexpr size_t kRowsPerKeyframe = 40;

// From a row of the truth on. Samples are those of the keyframes and one beyond on each side.
MadeWindow RecordedWindow(const EurocTables& log, size_t first, int keyframe_count,
                          const PoseNoise& noise, Random* random) {
  MadeWindow window;
  std::vector<TimeNs> times;
  for (int i = 0; i < keyframe_count; ++i) {
    const TrueState& truth = log.truth[first + kRowsPerKeyframe * static_cast<size_t>(i)];
    window.truth.push_back(truth.state);
    times.push_back(truth.time_ns);
  }
  for (const ImuMeasurement& sample : log.samples) {
    if (sample.time_ns > times.front() - 6'000'000 && sample.time_ns < times.back() + 6'000'000) {
      window.samples.push_back(sample);
    }
  }
  window.start_T_imu = SeenPoses(window.truth, noise, random);
  return window;
}

// Of each keyframe's time, as the truth has it.
absl::Status IntegrateRecorded(const EurocTables& log, size_t first, const ImuBias& bias,
                               MadeWindow* window) {
  window->parts.clear();
  for (size_t i = 0; i + 1 < window->truth.size(); ++i) {
    auto part = Preintegration::Make(
        window->samples, log.truth[first + kRowsPerKeyframe * i].time_ns,
        log.truth[first + kRowsPerKeyframe * (i + 1)].time_ns, bias, Adis16448(), {});
    if (!part.ok()) return part.status();
    window->parts.push_back(*std::move(part));
  }
  return absl::OkStatus();
}

struct StartScores {
  int window_count = 0;
  std::vector<std::string> refusals;
  /// Of each start: direction of gravity, degrees; velocity, m/s; biases, rad/s and m/s^2.
  std::vector<double> tilt_deg;
  std::vector<double> speed;
  std::vector<double> gyro;
  std::vector<double> accel;
};

double QuantileOf(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
}

StartScores ScoreStarts(const EurocTables& log, size_t stride, int keyframe_count,
                        const PoseNoise& noise, bool is_bias_known = false) {
  StartScores scores;
  const size_t rows = kRowsPerKeyframe * static_cast<size_t>(keyframe_count - 1);
  for (size_t first = 0; first + rows < log.truth.size(); first += stride) {
    ++scores.window_count;
    Random random(first, 0);
    MadeWindow window = RecordedWindow(log, first, keyframe_count, noise, &random);
    ImuBias known;
    if (is_bias_known) known.accel_m_s2 = window.truth.front().bias.accel_m_s2;
    const absl::Status integrated = IntegrateRecorded(log, first, known, &window);
    EXPECT_TRUE(integrated.ok()) << integrated;
    const auto aligned = AlignInMotion(window.start_T_imu, window.Between(), Adis16448(), 0.0, {});
    if (!aligned.ok()) {
      scores.refusals.emplace_back(aligned.status().message());
      continue;
    }
    const InertialState& state = aligned->last.state;
    const InertialState& truth = window.truth.back();
    const auto in_unit = [](const InertialState& of, const Vector3d& map) -> Vector3d {
      return of.map_T_imu.orientation.conjugate() * map;
    };
    const Vector3d up = in_unit(state, Vector3d::UnitZ());
    const Vector3d true_up = in_unit(truth, Vector3d::UnitZ());
    scores.tilt_deg.push_back(180.0 / M_PI * std::atan2(up.cross(true_up).norm(), up.dot(true_up)));
    scores.speed.push_back(
        (in_unit(state, state.velocity_map) - in_unit(truth, truth.velocity_map)).norm());
    scores.gyro.push_back((state.bias.gyro_rad_s - truth.bias.gyro_rad_s).norm());
    scores.accel.push_back((state.bias.accel_m_s2 - truth.bias.accel_m_s2).norm());
  }
  return scores;
}

void RecordScores(const std::string& name, const StartScores& scores) {
  const auto record = [&](const std::string& part, const std::vector<double>& values) {
    testing::Test::RecordProperty(name + part + "_median", std::to_string(QuantileOf(values, 0.5)));
    testing::Test::RecordProperty(name + part + "_max", std::to_string(QuantileOf(values, 1.0)));
  };
  testing::Test::RecordProperty(name + "windows", std::to_string(scores.window_count));
  testing::Test::RecordProperty(name + "refused", std::to_string(scores.refusals.size()));
  if (scores.tilt_deg.empty()) return;
  record("tilt_deg", scores.tilt_deg);
  record("speed_m_s", scores.speed);
  record("gyro_rad_s", scores.gyro);
  record("accel_m_s2", scores.accel);
  for (const std::string& refusal : scores.refusals) {
    testing::Test::RecordProperty(name + "refusal", refusal);
  }
}

class RecordedStart : public testing::Test {
 protected:
  void SetUp() override {
    flight_ = ReadEuroc("euroc-imu-groundtruth/V1_02_medium");
    hand_ = ReadEuroc("euroc-mh01-stereo/mav0");
    if (flight_.samples.empty() || hand_.samples.empty()) {
      GTEST_SKIP() << "the recorded samples are not there; set DSG_DATA";
    }
  }
  EurocTables flight_;
  EurocTables hand_;
};

TEST_F(RecordedStart, FindsUpSpeedAndBiasesInFlight) {
  const StartScores scores = ScoreStarts(flight_, 200, 11, {});
  RecordScores("v102_", scores);
  PoseNoise chain;
  chain.is_chain = true;
  RecordScores("v102_chain_", ScoreStarts(flight_, 200, 11, chain));
  RecordScores("v102_known_accel_bias_", ScoreStarts(flight_, 200, 11, {}, true));
  RecordScores("v102_1s_", ScoreStarts(flight_, 200, 6, {}));
  RecordScores("v102_4s_", ScoreStarts(flight_, 200, 21, {}));
}

TEST_F(RecordedStart, FindsUpSpeedAndBiasesInAHand) {
  const StartScores scores = ScoreStarts(hand_, 40, 11, {});
  RecordScores("mh01_", scores);
}

// What a driver or a calibration may do to samples.
struct Spoiling {
  const char* name;
  ImuFaultKind kind;
  void (*spoil)(ImuMeasurement* sample);
};

constexpr Spoiling kSpoilings[] = {
    {"g", ImuFaultKind::kForceUnit,
     [](ImuMeasurement* sample) { sample->acceleration_m_s2 /= 9.80665; }},
    {"mg", ImuFaultKind::kForceUnit,
     [](ImuMeasurement* sample) { sample->acceleration_m_s2 /= 9.80665e-3; }},
    {"degrees", ImuFaultKind::kRateUnit,
     [](ImuMeasurement* sample) { sample->angular_velocity_rad_s *= 180.0 / M_PI; }},
    {"swapped", ImuFaultKind::kAxes,
     [](ImuMeasurement* sample) {
       sample->angular_velocity_rad_s.head<2>().reverseInPlace();
       sample->acceleration_m_s2.head<2>().reverseInPlace();
     }},
    {"cycled", ImuFaultKind::kAxes,
     [](ImuMeasurement* sample) {
       const Vector3d w = sample->angular_velocity_rad_s;
       const Vector3d a = sample->acceleration_m_s2;
       *sample = {sample->time_ns, {w.y(), w.z(), w.x()}, {a.y(), a.z(), a.x()}};
     }},
    {"flipped", ImuFaultKind::kAxes,
     [](ImuMeasurement* sample) { sample->angular_velocity_rad_s.z() *= -1.0; }},
};

struct FaultScores {
  int window_count = 0;
  /// With the fault among those that are found, and with another.
  int found_count = 0;
  int other_count = 0;
  /// Starts in spite of it.
  int start_count = 0;
};

FaultScores ScoreFaults(const EurocTables& log, size_t stride, const Spoiling* spoiling) {
  FaultScores scores;
  for (size_t first = 0; first + 10 * kRowsPerKeyframe < log.truth.size(); first += stride) {
    ++scores.window_count;
    Random random(first, 0);
    MadeWindow window = RecordedWindow(log, first, 11, {}, &random);
    for (ImuMeasurement& sample : window.samples) {
      if (spoiling != nullptr) spoiling->spoil(&sample);
    }
    EXPECT_TRUE(IntegrateRecorded(log, first, {}, &window).ok());
    std::vector<SeenTurn> turns;
    for (size_t i = 0; i < window.parts.size(); ++i) {
      turns.push_back({window.parts[i].samples(), SeenTurnOf(window, i)});
    }
    std::vector<ImuFault> faults = FaultsOfTurns(turns, "imu0", {});
    for (ImuFault& fault : FaultsOfSamples(window.samples, "imu0", {})) faults.push_back(fault);
    bool is_found = false;
    bool is_other = false;
    for (const ImuFault& fault : faults) {
      const bool is_right = spoiling != nullptr && fault.kind == spoiling->kind;
      (is_right ? is_found : is_other) = true;
      if (!is_right) std::cout << "first row " << first << ": " << fault.text << "\n";
    }
    scores.found_count += is_found ? 1 : 0;
    scores.other_count += is_other ? 1 : 0;
    const auto aligned = AlignInMotion(window.start_T_imu, window.Between(), Adis16448(), 0.0, {});
    scores.start_count += aligned.ok() ? 1 : 0;
  }
  return scores;
}

void RecordFaults(const std::string& name, const FaultScores& scores) {
  std::cout << name << ": of " << scores.window_count << " windows found in " << scores.found_count
            << ", another in " << scores.other_count << ", started in " << scores.start_count
            << "\n";
}

TEST_F(RecordedStart, NamesWhatIsWrong) {
  for (const auto& [name, log, stride] :
       {std::tuple("v102", &flight_, size_t{200}), std::tuple("mh01", &hand_, size_t{40})}) {
    RecordFaults(std::string(name) + " as it is", ScoreFaults(*log, stride, nullptr));
    for (const Spoiling& spoiling : kSpoilings) {
      RecordFaults(std::string(name) + " " + spoiling.name, ScoreFaults(*log, stride, &spoiling));
    }
  }
}

}  // namespace
}  // namespace dsg::ingest
