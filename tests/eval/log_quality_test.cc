// SPDX-License-Identifier: Apache-2.0
// Are simulated images fit for what estimators do with them? Corners to track, disparities that
// agree with depth, inertial samples that agree with the motion. DSG_QUALITY_FRAMES renders more
// frames than the few that the ordinary run can afford.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "ingest/simulator/motion/dead_reckoning.h"
#include "ingest/simulator/sensors/frame_files.h"
#include "ingest/simulator/sensors/render_frames.h"
#include "ingest/simulator/sensors/session.h"

namespace dsg::simulator {
namespace {

// Kimera-VIO's settings for uHumans2: quality, distance, block.
constexpr int kCornersMax = 300;
constexpr double kCornerQuality = 0.001;
constexpr double kCornerDistancePx = 8.0;
constexpr int kCornersWanted = 250;

int FrameCount() {
  const char* text = std::getenv("DSG_QUALITY_FRAMES");
  return text != nullptr ? std::max(1, std::atoi(text)) : 12;
}

SensorsOptions Options(WorldKind kind, uint64_t seed) {
  SensorsOptions options;
  options.world = {kind, seed};
  options.people_count = kind == WorldKind::kOffice ? 12 : 3;
  options.duration_s = kind == WorldKind::kOffice ? 60.0 : 25.0;
  return options;
}

cv::Mat Decode(const std::vector<FrameFile>& files, const std::string& channel) {
  for (const FrameFile& file : files) {
    if (file.path.find("/" + channel + "/") == std::string::npos) continue;
    const cv::Mat bytes(1, static_cast<int>(file.bytes.size()), CV_8UC1,
                        const_cast<char*>(file.bytes.data()));
    return cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  }
  return {};
}

int CornerCount(const cv::Mat& gray) {
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(gray, corners, kCornersMax, kCornerQuality, kCornerDistancePx,
                          cv::noArray(), 3);
  return static_cast<int>(corners.size());
}

constexpr int kHalfPatch = 7;
// Matching takes a patch for a plane that faces the camera.
constexpr double kPatchSpreadPx = 0.3;
// As far as images with noise and rounding may differ from the depth.
constexpr double kDisparityPx = 0.3;
constexpr int kSearchPx = 4;

double PatchDifference(const cv::Mat& left, const cv::Mat& right, int row, int left_column,
                       int right_column) {
  double sum = 0.0;
  for (int dy = -kHalfPatch; dy <= kHalfPatch; ++dy) {
    for (int dx = -kHalfPatch; dx <= kHalfPatch; ++dx) {
      const double difference = left.at<uint8_t>(row + dy, left_column + dx) -
                                right.at<uint8_t>(row + dy, right_column + dx);
      sum += difference * difference;
    }
  }
  return sum;
}

// A patch that has texture along the row, on a surface that hardly slants. `focal_baseline` is
// disparity times depth, pixels and millimetres.
bool IsTextured(const cv::Mat& left, const cv::Mat& depth, int row, int column,
                double focal_baseline) {
  double gradient = 0.0;
  const double middle = depth.at<uint16_t>(row, column);
  if (middle == 0.0) return false;
  for (int dy = -kHalfPatch; dy <= kHalfPatch; ++dy) {
    for (int dx = -kHalfPatch; dx <= kHalfPatch; ++dx) {
      const double z = depth.at<uint16_t>(row + dy, column + dx);
      if (z == 0.0 || std::abs(focal_baseline / z - focal_baseline / middle) > kPatchSpreadPx) {
        return false;
      }
      const double step =
          left.at<uint8_t>(row + dy, column + dx + 1) - left.at<uint8_t>(row + dy, column + dx - 1);
      gradient += step * step;
    }
  }
  constexpr double kPatchPixels = (2 * kHalfPatch + 1) * (2 * kHalfPatch + 1);
  return gradient / kPatchPixels > 100.0;
}

// Whether the whole patch is in view of the right camera too: nothing stands before it there.
bool IsSeenIn(const RenderedView& right, const cv::Mat& left_depth, int row, int column,
              double disparity) {
  for (const int dy : {-kHalfPatch, 0, kHalfPatch}) {
    for (const int dx : {-kHalfPatch, 0, kHalfPatch}) {
      const int right_column = column + dx - static_cast<int>(std::lround(disparity));
      if (right_column < 0) return false;
      const double z_mm = left_depth.at<uint16_t>(row + dy, column + dx);
      const double right_mm =
          1000.0 * right.depth_m[static_cast<size_t>(row + dy) * static_cast<size_t>(right.width) +
                                 static_cast<size_t>(right_column)];
      if (std::abs(right_mm - z_mm) > 0.05 * z_mm) return false;
    }
  }
  return true;
}

// Whole-pixel search around the true disparity, then a parabola. Nothing where the best is at the
// border of the search.
std::optional<double> DisparityError(const cv::Mat& left, const cv::Mat& right, int row, int column,
                                     double true_disparity) {
  const int start = static_cast<int>(std::lround(true_disparity));
  double best = 0.0;
  int best_offset = -kSearchPx - 1;
  std::vector<double> scores;
  for (int offset = -kSearchPx; offset <= kSearchPx; ++offset) {
    const int right_column = column - start - offset;
    if (right_column < kHalfPatch || right_column >= right.cols - kHalfPatch) return std::nullopt;
    scores.push_back(PatchDifference(left, right, row, column, right_column));
    if (best_offset < -kSearchPx || scores.back() < best) {
      best = scores.back();
      best_offset = offset;
    }
  }
  if (std::abs(best_offset) == kSearchPx) return std::nullopt;
  const auto i = static_cast<size_t>(best_offset + kSearchPx);
  const double curve = scores[i - 1] - 2.0 * scores[i] + scores[i + 1];
  const double shift = curve > 0.0 ? 0.5 * (scores[i - 1] - scores[i + 1]) / curve : 0.0;
  return start + best_offset + shift - true_disparity;
}

double Percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<size_t>(share * static_cast<double>(values.size())))];
}

struct Choice {
  WorldKind kind;
  uint64_t seed;
};

class LogQuality : public testing::TestWithParam<Choice> {
 protected:
  void SetUp() override {
    auto session = SensorSession::Make(Options(GetParam().kind, GetParam().seed));
    ASSERT_TRUE(session.ok()) << session.status();
    session_ = *std::move(session);
  }

  // Keyframes spread over the whole log.
  std::vector<int64_t> Frames() const {
    const int64_t every = session_->options().keyframe_every;
    const int64_t keyframe_count = session_->frame_count() / every;
    const int64_t count = std::min<int64_t>(FrameCount(), keyframe_count);
    std::vector<int64_t> frames;
    for (int64_t i = 0; i < count; ++i) frames.push_back(i * keyframe_count / count * every);
    return frames;
  }

  // The right camera's depth is in no log; the test asks for it to leave out what it cannot see.
  RenderedView RightDepth(int64_t frame) const {
    const ingest::CameraCalibration& camera = *session_->rig().FindCamera("cam1");
    const Pose3d map_T_camera = session_->MapTCamera(camera, frame);
    const auto drawn = session_->BodiesAt(frame, map_T_camera.position);
    std::vector<MovingBody> bodies;
    for (const auto& one : drawn) bodies.push_back(one->body);
    return *session_->renderer().Render(map_T_camera, camera, bodies,
                                        {.gray = false, .depth = true});
  }

  std::unique_ptr<SensorSession> session_;
};

TEST_P(LogQuality, ImagesHaveCornersToTrack) {
  std::vector<double> counts;
  for (const int64_t frame : Frames()) {
    const auto files = RenderFrame(*session_, frame, "log");
    ASSERT_TRUE(files.ok()) << files.status();
    counts.push_back(CornerCount(Decode(*files, "cam0")));
  }
  const auto rich_count = std::count_if(counts.begin(), counts.end(),
                                        [](double count) { return count >= kCornersWanted; });
  const double share = static_cast<double>(rich_count) / static_cast<double>(counts.size());
  std::printf("%zu frames: %.1f %% with %d corners or more; median %.0f, worst %.0f\n",
              counts.size(), 100.0 * share, kCornersWanted, Percentile(counts, 0.5),
              Percentile(counts, 0.0));
  EXPECT_GE(share, counts.size() < 40 ? 0.9 : 0.95);
}

TEST_P(LogQuality, DisparitiesAgreeWithDepth) {
  const ingest::CameraCalibration& camera = *session_->rig().FindCamera("cam0");
  const double baseline_m =
      (session_->rig().FindCamera("cam1")->body_T_camera.position - camera.body_T_camera.position)
          .norm();
  const double focal_baseline = 1000.0 * camera.fx * baseline_m;
  std::vector<double> errors;
  for (const int64_t frame : Frames()) {
    const auto files = RenderFrame(*session_, frame, "log");
    ASSERT_TRUE(files.ok()) << files.status();
    const cv::Mat left = Decode(*files, "cam0");
    const cv::Mat right = Decode(*files, "cam1");
    const cv::Mat depth = Decode(*files, "depth0_clean");
    const RenderedView right_view = RightDepth(frame);
    for (int row = 20; row < left.rows - 20; row += 16) {
      for (int column = 100; column < left.cols - 20; column += 16) {
        if (!IsTextured(left, depth, row, column, focal_baseline)) continue;
        const double disparity = focal_baseline / depth.at<uint16_t>(row, column);
        if (!IsSeenIn(right_view, depth, row, column, disparity)) continue;
        const auto error = DisparityError(left, right, row, column, disparity);
        if (error.has_value()) errors.push_back(std::abs(*error));
      }
    }
  }
  ASSERT_GT(errors.size(), 200u);
  const double median = Percentile(errors, 0.5);
  const auto near_count = std::count_if(errors.begin(), errors.end(),
                                        [](double error) { return error <= kDisparityPx; });
  const double share = static_cast<double>(near_count) / static_cast<double>(errors.size());
  std::printf("%zu patches: disparity error median %.3f px, %.1f %% within %.1f px\n",
              errors.size(), median, 100.0 * share, kDisparityPx);
  EXPECT_LE(median, 0.5 * kDisparityPx);
  EXPECT_GE(share, 0.85);
}

TEST_P(LogQuality, InertialSamplesStayWithinTheirNoiseModel) {
  ReckoningShares sum;
  for (uint64_t seed = 0; seed < 8; ++seed) {
    // The motion is the log's; noise is drawn anew, for enough windows to count.
    const std::vector<ImuSample> samples =
        seed == 0 ? session_->imu() : SimulateImu(session_->robot(), ImuModel(), 200.0, seed);
    const ReckoningShares shares =
        SharesWithin(ReckonWindows(session_->robot(), samples, ImuModel(), kNsPerSecond));
    sum.window_count += shares.window_count;
    sum.position += shares.position / 8.0;
    sum.rotation += shares.rotation / 8.0;
    sum.all += shares.all / 8.0;
  }
  std::printf(
      "%d windows of 1 s: within their 95 %% ellipsoids: position %.1f %%, rotation "
      "%.1f %%, position, rotation and velocity together %.1f %%\n",
      sum.window_count, 100.0 * sum.position, 100.0 * sum.rotation, 100.0 * sum.all);
  EXPECT_NEAR(sum.position, 0.95, 0.04);
  EXPECT_NEAR(sum.rotation, 0.95, 0.04);
  EXPECT_NEAR(sum.all, 0.95, 0.04);
}

INSTANTIATE_TEST_SUITE_P(Worlds, LogQuality,
                         testing::Values(Choice{WorldKind::kApartment, 11},
                                         Choice{WorldKind::kOffice, 12}),
                         [](const auto& param) { return std::string(Name(param.param.kind)); });

}  // namespace
}  // namespace dsg::simulator
