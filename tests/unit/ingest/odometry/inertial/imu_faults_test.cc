// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/inertial/imu_faults.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "schema/model/rotation.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/ingest/odometry/inertial/inertial_test_util.h"
#include "tests/unit/ingest/odometry/inertial/made_motion.h"

namespace dsg::ingest {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegrees = 180.0 / M_PI;

std::vector<ImuFault> TurnFaults(const MadeWindow& window) {
  std::vector<SeenTurn> turns;
  for (size_t i = 0; i < window.parts.size(); ++i) {
    turns.push_back({window.parts[i].samples(), SeenTurnOf(window, i)});
  }
  return FaultsOfTurns(turns, "imu0", {});
}

MadeWindow CarriedWindow(Random* random) {
  const MadeMotion motion = CarriedMotion(random);
  const ImuBias bias = {NormalVector(0.05, random), NormalVector(0.05, random)};
  return MakeWindow(motion, random->Uniform(0.0, 10.0), 11, bias, {}, random);
}

// One fault of that kind and no other, whose text has the words.
void ExpectFault(const std::vector<ImuFault>& faults, ImuFaultKind kind, const std::string& words) {
  ASSERT_EQ(faults.size(), 1u) << (faults.empty() ? "no fault" : faults.back().text);
  EXPECT_EQ(faults[0].kind, kind) << faults[0].text;
  EXPECT_NE(faults[0].text.find(words), std::string::npos)
      << "no \"" << words << "\" in: " << faults[0].text;
  EXPECT_EQ(faults[0].text.substr(0, 6), "imu0: ");
}

TEST(ImuFaults, AreNotFoundWhereThereAreNone) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    Random random(test::TestSeed(seed), 0);
    MadeWindow moving = CarriedWindow(&random);
    ASSERT_TRUE(Integrate(&moving));
    for (const ImuFault& fault : FaultsOfSamples(moving.samples, "imu0", {})) {
      ADD_FAILURE() << fault.text;
    }
    for (const ImuFault& fault : TurnFaults(moving)) ADD_FAILURE() << fault.text;
    const MadeWindow resting = MakeWindow({}, 0.0, 11, {}, {}, &random);
    for (const ImuFault& fault : FaultsOfSamples(resting.samples, "imu0", {})) {
      ADD_FAILURE() << fault.text;
    }
  }
}

TEST(ImuFaults, TellUnitsOfAcceleration) {
  Random random(test::TestSeed(1), 0);
  const MadeWindow moving = CarriedWindow(&random);
  const MadeWindow resting = MakeWindow({}, 0.0, 11, {}, {}, &random);
  struct Case {
    double factor;
    ImuFaultKind kind;
    const char* words;
  };
  for (const Case& c :
       {Case{1.0 / 9.80665, ImuFaultKind::kForceUnit, "look like g, multiply them by 9.80665"},
        Case{1e3 / 9.80665, ImuFaultKind::kForceUnit, "look like mg"},
        Case{100.0, ImuFaultKind::kForceUnit, "cm/s^2"},
        Case{3.28084, ImuFaultKind::kForceUnit, "ft/s^2"},
        Case{10.0, ImuFaultKind::kForceScale, "check the unit's scale"}}) {
    SCOPED_TRACE(c.words);
    for (MadeWindow window : {moving, resting}) {
      for (ImuMeasurement& sample : window.samples) sample.acceleration_m_s2 *= c.factor;
      const auto faults = FaultsOfSamples(window.samples, "imu0", {});
      ASSERT_FALSE(faults.empty());
      ExpectFault({faults.front()}, c.kind, c.words);
    }
  }
}

TEST(ImuFaults, TellThatGravityIsMissing) {
  Random random(test::TestSeed(1), 0);
  const MadeMotion motion = CarriedMotion(&random);
  MadeWindow window = MakeWindow(motion, 0.0, 11, {}, {}, &random);
  for (ImuMeasurement& sample : window.samples) {
    const double t = 1e-9 * static_cast<double>(sample.time_ns);
    sample.acceleration_m_s2 +=
        motion.PoseAt(t).orientation.conjugate() * InertialOptions().gravity_map();
  }
  ExpectFault(FaultsOfSamples(window.samples, "imu0", {}), ImuFaultKind::kNoGravity, "subtracted");
}

TEST(ImuFaults, TellNoUnitOfShortStretches) {
  Random random(test::TestSeed(1), 0);
  MadeWindow window = CarriedWindow(&random);
  for (ImuMeasurement& sample : window.samples) sample.acceleration_m_s2 /= 9.80665;
  window.samples.resize(150);
  EXPECT_TRUE(FaultsOfSamples(window.samples, "imu0", {}).empty());
  EXPECT_TRUE(FaultsOfSamples({}, "imu0", {}).empty());
}

TEST(ImuFaults, TellClippedPeaks) {
  Random random(test::TestSeed(1), 0);
  const MadeWindow good = CarriedWindow(&random);
  MadeWindow window = good;
  for (ImuMeasurement& sample : window.samples) {
    sample.angular_velocity_rad_s.y() =
        std::clamp(8.0 * sample.angular_velocity_rad_s.y(), -4.363, 4.363);
  }
  ExpectFault(FaultsOfSamples(window.samples, "imu0", {}), ImuFaultKind::kClipped, "gyro's y");
  window = good;
  for (size_t i = 100; i < 105; ++i) window.samples[i].acceleration_m_s2.x() = -19.6133;
  ExpectFault(FaultsOfSamples(window.samples, "imu0", {}), ImuFaultKind::kClipped,
              "accelerometer's x stays at its extreme of -19.6133");
  // A short knock is none.
  window = good;
  for (size_t i = 100; i < 104; ++i) window.samples[i].acceleration_m_s2.x() = -19.6133;
  EXPECT_TRUE(FaultsOfSamples(window.samples, "imu0", {}).empty());
}

TEST(ImuFaults, TellAStuckUnit) {
  Random random(test::TestSeed(1), 0);
  const MadeWindow good = CarriedWindow(&random);
  for (const auto& [count, is_stuck] : {std::pair(11, false), std::pair(12, true)}) {
    MadeWindow window = good;
    for (int i = 1; i < count; ++i) {
      ImuMeasurement& sample = window.samples[static_cast<size_t>(200 + i)];
      sample = {sample.time_ns, window.samples[200].angular_velocity_rad_s,
                window.samples[200].acceleration_m_s2};
    }
    const auto faults = FaultsOfSamples(window.samples, "imu0", {});
    if (is_stuck) {
      ExpectFault(faults, ImuFaultKind::kStuck, "for 12 samples");
    } else {
      EXPECT_TRUE(faults.empty());
    }
  }
}

TEST(ImuFaults, TellAUnitThatIsReadTooOften) {
  Random random(test::TestSeed(1), 0);
  MadeWindow window = CarriedWindow(&random);
  for (size_t i = 1; i < window.samples.size(); i += 2) {
    window.samples[i].acceleration_m_s2 = window.samples[i - 1].acceleration_m_s2;
  }
  ExpectFault(FaultsOfSamples(window.samples, "imu0", {}), ImuFaultKind::kRepeated,
              "of the accelerometer repeat");
}

TEST(ImuFaults, TellUnitsOfRates) {
  struct Case {
    double factor;
    ImuFaultKind kind;
    const char* words;
  };
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    Random random(test::TestSeed(seed), 0);
    const MadeWindow good = CarriedWindow(&random);
    for (const Case& c : {Case{kDegrees, ImuFaultKind::kRateUnit,
                               "look like degrees/s, multiply them by 0.0174533"},
                          Case{1.0 / kDegrees, ImuFaultKind::kRateUnit, "radians twice"},
                          Case{1000.0, ImuFaultKind::kRateUnit, "look like mrad/s"},
                          Case{2.0, ImuFaultKind::kRateScale, "check the gyro's scale"}}) {
      SCOPED_TRACE(c.words);
      MadeWindow window = good;
      for (ImuMeasurement& sample : window.samples) sample.angular_velocity_rad_s *= c.factor;
      ASSERT_TRUE(Integrate(&window));
      ExpectFault(TurnFaults(window), c.kind, c.words);
    }
  }
}

// All 47 wrong ones, each named as what makes it right.
TEST(ImuFaults, NameTheAxes) {
  Random random(test::TestSeed(1), 0);
  MadeMotion motion = CarriedMotion(&random);
  motion.swing_rad = 1.0;
  const MadeWindow good = MakeWindow(motion, 0.0, 11, {}, {}, &random);
  std::array<int, 3> columns = {0, 1, 2};
  do {
    for (int signs = columns == std::array{0, 1, 2} ? 1 : 0; signs < 8; ++signs) {
      Matrix3d calibrated_R_unit = Matrix3d::Zero();
      std::string name;
      for (int row = 0; row < 3; ++row) {
        const bool is_negative = (signs >> row & 1) != 0;
        calibrated_R_unit(row, columns[row]) = is_negative ? -1.0 : 1.0;
        name += std::string(row > 0 ? ", " : "") + (is_negative ? "-" : "") + "xyz"[columns[row]];
      }
      MadeWindow window = good;
      for (ImuMeasurement& sample : window.samples) {
        sample.angular_velocity_rad_s =
            calibrated_R_unit.transpose() * sample.angular_velocity_rad_s;
      }
      ASSERT_TRUE(Integrate(&window));
      const auto faults = TurnFaults(window);
      ExpectFault(faults, ImuFaultKind::kAxes,
                  "are the gyro's " + name + (calibrated_R_unit.determinant() < 0.0 ? " (" : ";"));
      EXPECT_EQ(faults.front().text.find("mirror") != std::string::npos,
                calibrated_R_unit.determinant() < 0.0)
          << faults.front().text;
    }
  } while (std::next_permutation(columns.begin(), columns.end()));
}

TEST(ImuFaults, NameAxesAndUnitTogether) {
  Random random(test::TestSeed(1), 0);
  MadeMotion motion = CarriedMotion(&random);
  motion.swing_rad = 1.0;
  MadeWindow window = MakeWindow(motion, 0.0, 11, {}, {}, &random);
  for (ImuMeasurement& sample : window.samples) {
    const Vector3d rate = sample.angular_velocity_rad_s;
    sample.angular_velocity_rad_s = kDegrees * Vector3d(rate.y(), rate.z(), rate.x());
  }
  ASSERT_TRUE(Integrate(&window));
  const auto faults = TurnFaults(window);
  ASSERT_EQ(faults.size(), 2u);
  ExpectFault({faults[0]}, ImuFaultKind::kAxes, "are the gyro's z, x, y");
  ExpectFault({faults[1]}, ImuFaultKind::kRateUnit, "degrees/s");
}

// A robot on wheels: the other axes may be called anything.
TEST(ImuFaults, NameOnlyTheAxesThatTurned) {
  Random random(test::TestSeed(1), 0);
  MadeWindow window = MakeWindow({}, 0.0, 11, {}, {}, &random);
  for (size_t i = 0; i < window.truth.size(); ++i) {
    const double t = 0.2 * static_cast<double>(i);
    window.truth[i].map_T_imu.orientation = RotationOf({0.0, 0.0, 0.3 * std::sin(2.0 * t)});
  }
  window.start_T_imu = SeenPoses(window.truth, {}, &random);
  MadeWindow flipped = window;
  for (size_t i = 0; i < window.samples.size(); ++i) {
    const double rate = 0.6 * std::cos(2.0 * 0.005 * static_cast<double>(i));
    window.samples[i].angular_velocity_rad_s.z() += rate;
    flipped.samples[i].angular_velocity_rad_s.x() -= rate;
  }
  ASSERT_TRUE(Integrate(&window));
  for (const ImuFault& fault : TurnFaults(window)) ADD_FAILURE() << fault.text;
  ASSERT_TRUE(Integrate(&flipped));
  ExpectFault(TurnFaults(flipped), ImuFaultKind::kAxes, "are the gyro's ?, ?, -x;");
}

TEST(ImuFaults, TellAnUnrelatedGyro) {
  Random random(test::TestSeed(1), 0);
  MadeWindow window = MakeWindow(CarriedMotion(&random), 0.0, 16, {}, {}, &random);
  for (ImuMeasurement& sample : window.samples) {
    sample.angular_velocity_rad_s = NormalVector(0.5, &random);
  }
  ASSERT_TRUE(Integrate(&window));
  ExpectFault(TurnFaults(window), ImuFaultKind::kUnrelated, "check both clocks");
}

TEST(ImuFaults, SayNothingOfTurnsThatDoNotTell) {
  Random random(test::TestSeed(1), 0);
  MadeWindow resting = MakeWindow({}, 0.0, 11, {}, {}, &random);
  for (ImuMeasurement& sample : resting.samples) sample.angular_velocity_rad_s *= -kDegrees;
  ASSERT_TRUE(Integrate(&resting));
  EXPECT_TRUE(TurnFaults(resting).empty());
  MadeWindow few = MakeWindow(CarriedMotion(&random), 0.0, 5, {}, {}, &random);
  for (ImuMeasurement& sample : few.samples) sample.angular_velocity_rad_s *= -kDegrees;
  ASSERT_TRUE(Integrate(&few));
  EXPECT_TRUE(TurnFaults(few).empty());
  EXPECT_TRUE(FaultsOfTurns({}, "imu0", {}).empty());
}

}  // namespace
}  // namespace dsg::ingest
