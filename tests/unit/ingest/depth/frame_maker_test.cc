// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/frame_maker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "ingest/sensor/pinhole.h"
#include "tests/unit/ingest/depth/depth_test_util.h"

namespace dsg::ingest {
namespace {

// Poses along x at 1 m/s, each 10 ms, both ends included.
void AddPoses(TimeNs from_ns, TimeNs to_ns, PosedFrameMaker* maker) {
  for (TimeNs t = from_ns; t <= to_ns; t += 10 * kMs) {
    maker->AddPose(t, At(1e-9 * static_cast<double>(t)));
  }
}

TEST(FrameMaker, JoinsChannelsOfOneStampInAnyOrder) {
  for (const bool is_depth_first : {true, false}) {
    PosedFrameMaker maker(TestRig(), {});
    ASSERT_TRUE(maker.CanMakeFrames());
    AddPoses(0, 1000 * kMs, &maker);
    if (is_depth_first) maker.AddPicture(Shot(500 * kMs, "depth0", FlatDepth(2.0f)));
    maker.AddPicture(Shot(500 * kMs, "label0", LabelImage(64, 48, [](int u, int) {
                            return static_cast<uint16_t>(u << 8 | 7);
                          })));
    maker.AddPicture(Shot(500 * kMs, "color0", ColorImage(64, 48, 200)));
    if (!is_depth_first) maker.AddPicture(Shot(500 * kMs, "depth0", FlatDepth(2.0f)));
    const std::vector<DepthFrame> frames = Drain(&maker);
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(frames[0].time_ns, 500 * kMs);
    EXPECT_NEAR(frames[0].map_T_camera.position.x(), 0.5, 1e-12);
    EXPECT_EQ(frames[0].depth_m, std::vector<float>(64 * 48, 2.0f));
    ASSERT_EQ(frames[0].labels.size(), 64u * 48u);
    EXPECT_EQ(frames[0].labels[64 + 3], 3 << 8 | 7);
    ASSERT_EQ(frames[0].rgb.size(), 3u * 64u * 48u);
    EXPECT_EQ(frames[0].rgb[3 * (2 * 64 + 5)], 200);
    EXPECT_EQ(frames[0].rgb[3 * (2 * 64 + 5) + 1], 5);
    EXPECT_EQ(frames[0].rgb[3 * (2 * 64 + 5) + 2], 2);
    EXPECT_TRUE(frames[0].dynamic.empty());
    EXPECT_FALSE(frames[0].is_stereo);
    EXPECT_TRUE(maker.skips().empty());
  }
}

TEST(FrameMaker, PutsTheCameraWhereTheBodyCarriesIt) {
  RigCalibration rig = TestRig();
  for (CameraCalibration& camera : rig.cameras) {
    camera.body_T_camera.position = {0.1, 0.2, 0.3};
    camera.body_T_camera.orientation =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()));
  }
  PosedFrameMaker maker(rig, {});
  Pose3d map_T_body = At(1.0, 2.0, 3.0);
  map_T_body.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI_2, Eigen::Vector3d::UnitZ()));
  maker.AddPose(100, map_T_body);
  maker.AddPicture(Shot(100, "depth0", FlatDepth(2.0f)));
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 1u);
  const Pose3d expected = map_T_body * rig.cameras[0].body_T_camera;
  EXPECT_NEAR((frames[0].map_T_camera.position - expected.position).norm(), 0.0, 1e-12);
  EXPECT_NEAR((frames[0].map_T_camera.position - Eigen::Vector3d(0.8, 2.1, 3.3)).norm(), 0.0, 1e-9);
  EXPECT_NEAR(AngleBetween(frames[0].map_T_camera.orientation, expected.orientation), 0.0, 1e-9);
}

TEST(FrameMaker, TakesTheNearestColourWithinTwentyMilliseconds) {
  PosedFrameMaker maker(TestRig(), {});
  maker.AddPose(0, At(0.0));
  const auto color = [&](TimeNs t, uint8_t red) {
    maker.AddPicture(Shot(t, "color0", ColorImage(64, 48, red)));
  };
  const auto depth = [&](TimeNs t) { maker.AddPicture(Shot(t, "depth0", FlatDepth(1.0f))); };
  color(92 * kMs, 1);
  depth(100 * kMs);
  color(104 * kMs, 2);
  depth(300 * kMs);
  color(319 * kMs, 3);
  maker.AddPose(400 * kMs, At(0.0));
  depth(500 * kMs);
  color(521 * kMs, 4);
  maker.AddPose(600 * kMs, At(0.0));
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].rgb.at(0), 2);
  EXPECT_EQ(frames[1].rgb.at(0), 3);
  EXPECT_TRUE(frames[2].rgb.empty());
}

TEST(FrameMaker, ColourOfTheNextFrameIsNotTaken) {
  RigCalibration rig = TestRig();
  for (CameraCalibration& camera : rig.cameras) camera.rate_hz = 100.0;
  PosedFrameMaker maker(rig, {});
  AddPoses(0, 100 * kMs, &maker);
  maker.AddPicture(Shot(50 * kMs, "depth0", FlatDepth(1.0f)));
  maker.AddPicture(Shot(60 * kMs, "color0", ColorImage(64, 48, 1)));
  maker.AddPicture(Shot(60 * kMs, "depth0", FlatDepth(1.0f)));
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_TRUE(frames[0].rgb.empty());
  EXPECT_FALSE(frames[1].rgb.empty());
}

TEST(FrameMaker, GreyStandsInForColour) {
  PosedFrameMaker maker(TestRig(), {});
  maker.AddPose(0, At(0.0));
  maker.AddPicture(Shot(0, "cam0", GrayImage(64, 48, [](int u, int) { return 2.0 * u; })));
  maker.AddPicture(Shot(0, "depth0", FlatDepth(1.0f)));
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 1u);
  ASSERT_FALSE(frames[0].rgb.empty());
  for (size_t c = 0; c < 3; ++c) EXPECT_EQ(frames[0].rgb[3 * 10 + c], 20);
}

TEST(FrameMaker, SmallerColourIsSpreadByTheNearestPixel) {
  RigCalibration rig = TestRig();
  rig.cameras[1] = TestCamera("color0", 32, 24);
  PosedFrameMaker maker(rig, {});
  maker.AddPose(0, At(0.0));
  maker.AddPicture(Shot(0, "color0", ColorImage(32, 24, 9)));
  maker.AddPicture(Shot(0, "depth0", FlatDepth(1.0f)));
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 1u);
  ASSERT_EQ(frames[0].rgb.size(), 3u * 64u * 48u);
  EXPECT_NEAR(frames[0].rgb[3 * (20 * 64 + 40) + 1], 20, 1);
  EXPECT_NEAR(frames[0].rgb[3 * (20 * 64 + 40) + 2], 10, 1);
}

TEST(FrameMaker, ColourFromBesideIsLeftOutAndSaid) {
  RigCalibration rig = TestRig();
  rig.cameras[1].body_T_camera.position.x() = 0.05;
  PosedFrameMaker maker(rig, {});
  maker.AddPose(0, At(0.0));
  maker.AddPicture(Shot(0, "color0", ColorImage(64, 48, 9)));
  maker.AddPicture(Shot(0, "depth0", FlatDepth(1.0f)));
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_TRUE(frames[0].rgb.empty());
  EXPECT_EQ(maker.skips(), (SkipCounts{{"colour left out: taken from another place", 1}}));
}

TEST(FrameMaker, CleansReadingsThatAreNone) {
  const float inf = std::numeric_limits<float>::infinity();
  const std::vector<float> given = {
      1.5f, NAN, inf, -inf, -1.0f, 0.0f, 60.0f, 1e10f, std::numeric_limits<float>::max()};
  PosedFrameMaker maker(TestRig(), {});
  AddPoses(0, 200 * kMs, &maker);
  maker.AddPicture(Shot(0, "depth0", Depth32Image(64, 48, [&](int u, int) {
                          return u < 9 ? given[static_cast<size_t>(u)] : 2.0f;
                        })));
  maker.AddPicture(Shot(100 * kMs, "depth0", Depth16Image(64, 48, [](int u, int) {
                          return static_cast<uint16_t>(u == 0 ? 0 : u == 1 ? 65535 : 1234);
                        })));
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 2u);
  const std::vector<float> expected = {1.5f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 60.0f, 0.0f, 0.0f};
  EXPECT_EQ(std::vector<float>(frames[0].depth_m.begin(), frames[0].depth_m.begin() + 9), expected);
  EXPECT_EQ(frames[1].depth_m[0], 0.0f);
  EXPECT_EQ(frames[1].depth_m[1], 0.0f);
  EXPECT_FLOAT_EQ(frames[1].depth_m[2], 1.234f);
}

TEST(FrameMaker, SkipsFramesWithoutAPoseAndAcrossAJump) {
  PosedFrameMaker maker(TestRig(), {});
  const auto depth = [&](TimeNs t) { maker.AddPicture(Shot(t, "depth0", FlatDepth(1.0f))); };
  depth(0);
  maker.AddPose(100 * kMs, At(0.0));
  depth(150 * kMs);
  maker.AddPose(200 * kMs, At(0.1));
  depth(250 * kMs);
  maker.AddPose(300 * kMs, At(9.0));
  depth(350 * kMs);
  maker.AddPose(400 * kMs, At(9.1));
  depth(700 * kMs);
  maker.AddPose(1000 * kMs, At(9.1));
  depth(1100 * kMs);
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].time_ns, 150 * kMs);
  EXPECT_EQ(frames[1].time_ns, 350 * kMs);
  EXPECT_EQ(maker.skips(), (SkipCounts{{"no pose", 3}, {"pose jump", 1}}));
}

TEST(FrameMaker, CountsBrokenAndWrongPicturesAndGoesOn) {
  PosedFrameMaker maker(TestRig(), {});
  AddPoses(0, 1000 * kMs, &maker);
  maker.AddPicture(BrokenShot(100 * kMs, "depth0"));
  maker.AddPicture(Shot(200 * kMs, "depth0", FlatDepth(1.0f, 32, 24)));
  maker.AddPicture(Shot(300 * kMs, "depth0", ColorImage(64, 48, 1)));
  Image torn = FlatDepth(1.0f);
  torn.bytes.resize(100);
  maker.AddPicture(Shot(400 * kMs, "depth0", torn));
  maker.AddPicture({450 * kMs, "depth0", "nothing", nullptr});
  maker.AddPicture(Shot(500 * kMs, "depth0", FlatDepth(1.0f)));
  maker.AddPicture(BrokenShot(500 * kMs, "color0"));
  maker.AddPicture(Shot(500 * kMs, "label0", LabelImage(32, 24, [](int, int) { return 0; })));
  maker.AddPicture(Shot(600 * kMs, "depth0", FlatDepth(1.0f)));
  maker.AddPicture(Shot(600 * kMs, "label0", ColorImage(64, 48, 1)));
  maker.AddPicture(Shot(600 * kMs, "thermal0", ColorImage(64, 48, 1)));
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 2u);
  for (const DepthFrame& frame : frames) {
    EXPECT_TRUE(frame.rgb.empty());
    EXPECT_TRUE(frame.labels.empty());
  }
  EXPECT_EQ(maker.skips(), (SkipCounts{{"broken image", 3},
                                       {"size differs from calibration", 1},
                                       {"no depth image", 1},
                                       {"colour left out: broken image", 1},
                                       {"labels left out: size differs from calibration", 1},
                                       {"labels left out: no labels", 1}}));
}

TEST(FrameMaker, MissingDepthIsSaidOnce) {
  PosedFrameMaker maker(TestRig(), {});
  AddPoses(0, 100 * kMs, &maker);
  for (int i = 0; i < 3; ++i) {
    maker.AddPicture(Shot(i * 20 * kMs, "color0", ColorImage(64, 48, 1)));
  }
  EXPECT_TRUE(Drain(&maker).empty());
  EXPECT_EQ(maker.skips(), (SkipCounts{{"no depth image", 3}}));
}

TEST(FrameMaker, RigWithoutDepthMakesNothing) {
  RigCalibration rig;
  rig.cameras.push_back(TestCamera("cam0"));
  PosedFrameMaker maker(rig, {});
  EXPECT_FALSE(maker.CanMakeFrames());
  maker.AddPose(0, At(0.0));
  maker.AddPicture(Shot(0, "cam0", GrayImage(64, 48, [](int, int) { return 0.0; })));
  EXPECT_TRUE(Drain(&maker).empty());
  // A pair at one spot sees no parallax.
  rig.cameras.push_back(TestCamera("cam1"));
  EXPECT_FALSE(PosedFrameMaker(rig, {}).CanMakeFrames());
}

TEST(FrameMaker, RepeatedAndLatePicturesAreCounted) {
  PosedFrameMaker maker(TestRig(), {});
  AddPoses(0, 1000 * kMs, &maker);
  const auto depth = [&](TimeNs t) { maker.AddPicture(Shot(t, "depth0", FlatDepth(1.0f))); };
  depth(500 * kMs);
  depth(500 * kMs);
  depth(490 * kMs);
  depth(600 * kMs);
  depth(100 * kMs);
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].time_ns, 490 * kMs) << "little late is sorted in";
  EXPECT_EQ(frames[1].time_ns, 500 * kMs);
  EXPECT_EQ(maker.skips(), (SkipCounts{{"out of order", 2}}));
}

TEST(FrameMaker, PicturesWaitForPosesButNotForEver) {
  PosedFrameMaker maker(TestRig(), {});
  for (int i = 0; i < 10'100; ++i) maker.AddPicture(BrokenShot(i * kMs, "depth0"));
  EXPECT_FALSE(maker.Next().has_value());
  EXPECT_EQ(maker.skips(), (SkipCounts{{"no pose", 100}}));
}

TEST(FrameMaker, FramesStreamOutOneBehind) {
  PosedFrameMaker maker(TestRig(), {});
  std::vector<TimeNs> stamps;
  for (int i = 0; i < 20; ++i) {
    maker.AddPose(i * 100 * kMs, At(0.01 * i));
    maker.AddPicture(Shot(i * 100 * kMs, "depth0", FlatDepth(1.0f)));
    while (const std::optional<DepthFrame> frame = maker.Next()) stamps.push_back(frame->time_ns);
    // One waits for the next stamp, one is being opened.
    EXPECT_EQ(stamps.size(), static_cast<size_t>(std::max(0, i - 1)));
  }
  for (const DepthFrame& frame : Drain(&maker)) stamps.push_back(frame.time_ns);
  ASSERT_EQ(stamps.size(), 20u);
  for (size_t i = 0; i < 20; ++i) EXPECT_EQ(stamps[i], static_cast<TimeNs>(i) * 100 * kMs);
}

TEST(FrameMaker, AskingOftenOrOnlyAtTheEndGivesTheSame) {
  std::vector<DepthFrame> results[2];
  SkipCounts skips[2];
  for (const bool asks_often : {false, true}) {
    PosedFrameMaker maker(TestRig(), {});
    std::vector<DepthFrame>& frames = results[asks_often ? 1 : 0];
    for (int i = 0; i < 40; ++i) {
      const TimeNs t = i * 50 * kMs;
      if (i % 3 != 0) maker.AddPose(t - (i % 5) * kMs, At(0.02 * i));
      maker.AddPicture(Shot(t + 3 * kMs, "color0", ColorImage(64, 48, static_cast<uint8_t>(i))));
      if (i % 7 == 3) {
        maker.AddPicture(BrokenShot(t, "depth0"));
      } else {
        maker.AddPicture(Shot(t, "depth0", FlatDepth(1.0f + 0.01f * static_cast<float>(i))));
      }
      while (asks_often) {
        std::optional<DepthFrame> frame = maker.Next();
        if (!frame.has_value()) break;
        frames.push_back(*std::move(frame));
      }
    }
    for (DepthFrame& frame : Drain(&maker)) frames.push_back(std::move(frame));
    skips[asks_often ? 1 : 0] = maker.skips();
  }
  EXPECT_EQ(skips[0], skips[1]);
  ASSERT_EQ(results[0].size(), results[1].size());
  ASSERT_GT(results[0].size(), 20u);
  for (size_t i = 0; i < results[0].size(); ++i) {
    EXPECT_EQ(results[0][i].time_ns, results[1][i].time_ns);
    EXPECT_EQ(results[0][i].depth_m, results[1][i].depth_m);
    EXPECT_EQ(results[0][i].rgb, results[1][i].rgb);
    EXPECT_EQ(results[0][i].map_T_camera.position, results[1][i].map_T_camera.position);
  }
}

TEST(FrameMaker, MayBeThrownAwayWhileItOpensPictures) {
  PosedFrameMaker maker(TestRig(), {});
  AddPoses(0, 1000 * kMs, &maker);
  for (int i = 0; i < 5; ++i) maker.AddPicture(Shot(i * 100 * kMs, "depth0", FlatDepth(1.0f)));
}

TEST(FrameMaker, BentDepthIsRectified) {
  // A wall whose depth is a plane: after rectification each pixel has the plane's depth at its own
  // pinhole ray.
  RigCalibration rig;
  CameraCalibration bent = TestCamera("depth0", 320, 240);
  bent.distortion = Distortion::kRadialTangential;
  bent.distortion_coefficients = {-0.28, 0.07, 2e-4, 1.8e-5};
  rig.cameras.push_back(bent);
  const auto plane_m = [](const Eigen::Vector3d& ray) { return 3.0 / (1.0 + 0.8 * ray.x()); };
  PosedFrameMaker maker(rig, {});
  maker.AddPose(0, At(0.0));
  maker.AddPicture(Shot(0, "depth0", Depth32Image(320, 240, [&](int u, int v) {
                          const auto ray = RayOf(bent, Eigen::Vector2d(u, v));
                          return ray.has_value() ? static_cast<float>(plane_m(*ray)) : 0.0f;
                        })));
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 1u);
  const CameraCalibration& camera = frames[0].camera;
  EXPECT_EQ(camera.distortion, Distortion::kNone);
  double worst_m = 0.0;
  int reading_count = 0;
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      const float depth_m = frames[0].depth_m[static_cast<size_t>(v * 320 + u)];
      if (depth_m <= 0.0f) continue;
      ++reading_count;
      worst_m = std::max(worst_m, std::abs(depth_m - plane_m(PinholeRay(camera, u, v))));
    }
  }
  EXPECT_GT(reading_count, 320 * 240 * 9 / 10);
  // Half a pixel on the steepest part.
  EXPECT_LT(worst_m, 0.04);
}

TEST(FrameMaker, FarReadingsOfADepthCameraAreKept) {
  DepthOptions options;
  options.range_m = 3.0;
  PosedFrameMaker maker(TestRig(), options);
  maker.AddPose(0, At(0.0));
  maker.AddPicture(Shot(0, "depth0", FlatDepth(8.0f)));
  const std::vector<DepthFrame> frames = Drain(&maker);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].depth_m[0], 8.0f);
}

}  // namespace
}  // namespace dsg::ingest
