// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/recognized_log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <utility>
#include <variant>

#include "tests/unit/ingest/log/given_log.h"
#include "tests/unit/ingest/odometry/estimator/textured_room.h"

namespace dsg::ingest {
namespace {

// The rig of RoomRig in a room, at places of its own making.
LogInfo RoomInfo() {
  const RoomRig rig;
  LogInfo info;
  info.format = "euroc";
  info.path = "room";
  info.content_sha256 = "00";
  info.rig.cameras = {rig.left, rig.right()};
  info.channel_counts = {{"cam0", 1}, {"cam1", 1}};
  return info;
}

ImageMeasurement PictureOf(TimeNs time_ns, const CameraCalibration& camera,
                           const Pose3d& map_T_body) {
  ImageMeasurement image{time_ns, camera.name, "room", {}};
  image.load = [camera, map_T_body]() -> absl::StatusOr<Image> {
    static const TexturedRoom* const room = new TexturedRoom();
    return room->Seen(camera, map_T_body * camera.body_T_camera);
  };
  return image;
}

// Turned by so many degrees.
Pose3d PlaceAt(double x_m, double y_m, double yaw_deg) {
  return {{x_m, y_m, 0.0}, RotationOf(yaw_deg * M_PI / 180.0 * Eigen::Vector3d::UnitZ())};
}

std::deque<Measurement> PicturesAt(const std::vector<Pose3d>& places, double period_s) {
  const RoomRig rig;
  std::deque<Measurement> pictures;
  for (size_t i = 0; i < places.size(); ++i) {
    const TimeNs time_ns = std::llround(1e9 * period_s * static_cast<double>(i + 1));
    pictures.emplace_back(PictureOf(time_ns, rig.left, places[i]));
    pictures.emplace_back(PictureOf(time_ns, rig.right(), places[i]));
  }
  return pictures;
}

TEST(RecognizedLog, ClosesALoopWhereAPlaceIsSeenAgain) {
  // Around, and back to nearly where it began.
  const std::vector<Pose3d> places = {PlaceAt(0.0, 0.0, 0.0), PlaceAt(0.3, 0.3, 90.0),
                                      PlaceAt(0.0, 0.6, 180.0), PlaceAt(-0.3, 0.3, 270.0),
                                      PlaceAt(0.1, 0.05, 5.0)};
  auto log = RecognizePlaces(std::make_unique<GivenLog>(RoomInfo(), PicturesAt(places, 6.0)), {});
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE((*log)->info().channel_counts.contains("loops0"));
  const ReadLog read = ReadAll(**log);
  ASSERT_GE(read.measurements.size(), 11u);
  int loop_count = 0;
  for (const Measurement& measurement : read.measurements) {
    const auto* loop = std::get_if<LoopMeasurement>(&measurement);
    if (loop == nullptr) continue;
    ++loop_count;
    EXPECT_EQ(loop->time_ns, 30'000'000'000);
    EXPECT_EQ(loop->from_ns, 6'000'000'000);
    const Pose3d truth = places[0].Inverse() * places[4];
    EXPECT_LT((loop->from_T_to.position - truth.position).norm(), 0.05);
    EXPECT_LT(AngleBetween(loop->from_T_to.orientation, truth.orientation), 0.02);
  }
  EXPECT_EQ(loop_count, 1);
  EXPECT_TRUE(HasNote(read.info, "recognition: 1 loop closures in 5 images"));
  EXPECT_TRUE(std::is_sorted(
      read.measurements.begin(), read.measurements.end(),
      [](const Measurement& a, const Measurement& b) { return StampOf(a) < StampOf(b); }));
}

TEST(RecognizedLog, LooksAtOneImageOfAPeriodAndCountsBrokenOnes) {
  std::deque<Measurement> pictures =
      PicturesAt(std::vector<Pose3d>(4, PlaceAt(0.0, 0.0, 0.0)), /*period_s=*/0.6);
  std::get<ImageMeasurement>(pictures[0]).load = []() -> absl::StatusOr<Image> {
    return absl::InvalidArgumentError("is no picture");
  };
  auto log = RecognizePlaces(std::make_unique<GivenLog>(RoomInfo(), pictures), {});
  ASSERT_TRUE(log.ok()) << log.status();
  const ReadLog read = ReadAll(**log);
  EXPECT_EQ(read.measurements.size(), 8u);
  EXPECT_TRUE(HasNote(read.info, "recognition: 0 loop closures in 1 images"));
  EXPECT_TRUE(HasNote(read.info, "1 images were passed over; the first: is no picture"));
}

TEST(RecognizedLog, RefusesALogWithoutDistances) {
  LogInfo info = RoomInfo();
  info.rig.cameras.pop_back();
  info.channel_counts.erase("cam1");
  const auto log = RecognizePlaces(std::make_unique<GivenLog>(info, std::deque<Measurement>()), {});
  EXPECT_EQ(log.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(log.status().message().find("--recognize: room has neither"), std::string::npos);
}

TEST(RecognizedLog, IsAnotherLogWithOtherOptions) {
  const auto sha_of = [](const RecognizedLogOptions& options) {
    auto log =
        RecognizePlaces(std::make_unique<GivenLog>(RoomInfo(), std::deque<Measurement>()), options);
    EXPECT_TRUE(log.ok()) << log.status();
    return (*log)->info().content_sha256;
  };
  RecognizedLogOptions rarer;
  rarer.period_ns *= 2;
  EXPECT_EQ(sha_of({}), sha_of({}));
  EXPECT_NE(sha_of({}), sha_of(rarer));
}

}  // namespace
}  // namespace dsg::ingest
