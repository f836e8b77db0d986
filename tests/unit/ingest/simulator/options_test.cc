// SPDX-License-Identifier: Apache-2.0
// Bounds of the options and what their errors say.
#include "ingest/simulator/world/options.h"

#include <gtest/gtest.h>

#include <limits>

#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

TracksOptions Good() {
  TracksOptions options;
  options.out = "somewhere";
  return options;
}

void ExpectRefused(const TracksOptions& options, const std::string& field) {
  const absl::Status status = options.Validate();
  EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << field;
  EXPECT_EQ(MetadataOf(status)["field"], field);
  EXPECT_NE(std::string(status.message()).find(field), std::string::npos) << status.message();
}

TEST(SimulatorOptions, AcceptsItsDefaultsAndItsBounds) {
  EXPECT_TRUE(Good().Validate().ok());
  TracksOptions options = Good();
  options.crowd = {10'000, 86'400.0};
  options.sensor.rate_hz = 200.0;
  EXPECT_TRUE(options.Validate().ok());
  options.crowd = {0, 1.0};
  options.sensor.rate_hz = 0.1;
  EXPECT_TRUE(options.Validate().ok());
}

TEST(SimulatorOptions, RefusesWhatIsOutOfBoundsNamingTheOption) {
  TracksOptions options = Good();
  options.out = "";
  ExpectRefused(options, "--out");
  for (const int people : {-1, 10'001}) {
    options = Good();
    options.crowd.people_count = people;
    ExpectRefused(options, "--people");
  }
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const double seconds : {0.0, 86'401.0, kNan}) {
    options = Good();
    options.crowd.duration_s = seconds;
    ExpectRefused(options, "--seconds");
  }
  for (const double rate : {0.0, 201.0, kNan}) {
    options = Good();
    options.sensor.rate_hz = rate;
    ExpectRefused(options, "--rate");
  }
  options = Good();
  options.sensor.position_noise_m = -0.1;
  ExpectRefused(options, "--noise-m");
  options = Good();
  options.sensor.yaw_noise_rad = kNan;
  ExpectRefused(options, "--noise-yaw");
  options = Good();
  options.sensor.clock_jitter_s = 2.0;
  ExpectRefused(options, "--jitter-s");
  options = Good();
  options.sensor.gap_rate_per_min = 61.0;
  ExpectRefused(options, "--gap-rate");
}

TEST(SimulatorOptions, KnowsTheNamesOfWorlds) {
  EXPECT_EQ(*ParseWorldKind("office"), WorldKind::kOffice);
  EXPECT_EQ(*ParseWorldKind("apartment"), WorldKind::kApartment);
  EXPECT_EQ(*ParseWorldKind("wing"), WorldKind::kWing);
  for (const WorldKind kind : {WorldKind::kOffice, WorldKind::kWing, WorldKind::kApartment}) {
    EXPECT_EQ(*ParseWorldKind(Name(kind)), kind);
  }
  EXPECT_EQ(ReasonOf(ParseWorldKind("castle").status()), Reason::kFieldInvalid);
}

}  // namespace
}  // namespace dsg::simulator
