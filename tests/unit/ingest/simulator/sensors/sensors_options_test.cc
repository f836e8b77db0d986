// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/sensors_options.h"

#include <gtest/gtest.h>

#include <cmath>

#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

TEST(SensorsOptions, RefuseWhatNoLogCouldHold) {
  const auto refuses = [](auto change, const char* option) {
    SensorsOptions options;
    change(&options);
    const absl::Status status = options.Validate();
    EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << option;
    EXPECT_NE(std::string(status.message()).find(option), std::string::npos) << status;
  };
  refuses([](SensorsOptions* o) { o->people_count = -1; }, "--humans");
  refuses([](SensorsOptions* o) { o->people_count = 251; }, "--humans");
  refuses([](SensorsOptions* o) { o->duration_s = 0.0; }, "--seconds");
  refuses([](SensorsOptions* o) { o->duration_s = NAN; }, "--seconds");
  refuses([](SensorsOptions* o) { o->duration_s = 1e9; }, "--seconds");
  refuses([](SensorsOptions* o) { o->rate_hz = 0.0; }, "--rate");
  refuses([](SensorsOptions* o) { o->keyframe_every = 0; }, "--keyframe-every");
  refuses([](SensorsOptions* o) { o->imu_noise_factor = -1.0; }, "--imu-noise");
  refuses([](SensorsOptions* o) { o->calibration_error_factor = INFINITY; }, "--calibration-error");
  EXPECT_TRUE(SensorsOptions().Validate().ok());
}

TEST(SensorsOptions, CountFramesWithoutLosingOneToRounding) {
  SensorsOptions options;
  options.duration_s = 25.0;
  options.rate_hz = 20.0;
  EXPECT_EQ(options.FrameCount(), 500);
  options.duration_s = 1.0;
  options.rate_hz = 3.0;
  EXPECT_EQ(options.FrameCount(), 3);
  options.duration_s = 1.2;
  options.rate_hz = 10.0;
  EXPECT_EQ(options.FrameCount(), 12);
}

TEST(FrameRanges, AreReadOrRefused) {
  EXPECT_EQ(*ParseFrameRange("0:250"), (FrameRange{0, 250}));
  for (const char* bad : {"", "5", "5:", ":5", "5:5", "6:5", "-1:5", "1:2:3", "a:b", "1:2 "}) {
    EXPECT_EQ(ReasonOf(ParseFrameRange(bad).status()), Reason::kFieldInvalid) << bad;
  }
}

}  // namespace
}  // namespace dsg::simulator
