// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/simulator/bag/small_log.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/model/node.h"

namespace dsg::simulator::test {
namespace {

constexpr TimeNs kFirstNs = 1'600'000'000'123'456'789;
constexpr TimeNs kStepNs = 49'999'999;
constexpr int kStepCount = 20;
// Large enough for several chunks in a bag.
constexpr int kWidth = 161;
constexpr int kHeight = 97;

using Generator = std::mt19937_64;

double Uniform(Generator* random) { return std::uniform_real_distribution(-3.0, 3.0)(*random); }

Eigen::Vector3d RandomVector(Generator* random) {
  const double x = Uniform(random);
  const double y = Uniform(random);
  return {x, y, Uniform(random)};
}

Pose3d RandomPose(Generator* random) {
  const Eigen::Vector3d axis = RandomVector(random).normalized();
  const double angle_rad = Uniform(random);
  return {RandomVector(random), Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis))};
}

ingest::Image RandomImage(ingest::PixelFormat format, Generator* random) {
  ingest::Image image{.width = kWidth, .height = kHeight, .format = format, .bytes = {}};
  const size_t pixel_count = size_t{kWidth} * size_t{kHeight};
  image.bytes.resize(pixel_count * static_cast<size_t>(ingest::BytesPerPixel(format)));
  for (uint8_t& byte : image.bytes) byte = static_cast<uint8_t>((*random)() % 256);
  for (size_t i = 0; i < pixel_count; ++i) {
    if (format == ingest::PixelFormat::kLabel16) image.bytes[2 * i + 1] %= 3;
    const float depth_m = static_cast<float>(i) * 0.37F;
    if (format == ingest::PixelFormat::kDepth32) std::memcpy(&image.bytes[4 * i], &depth_m, 4);
  }
  return image;
}

ingest::ImageMeasurement RandomImageAt(TimeNs time_ns, const std::string& channel,
                                       ingest::PixelFormat format, Generator* random) {
  ingest::Image image = RandomImage(format, random);
  return {.time_ns = time_ns,
          .channel = channel,
          .origin = absl::StrCat(channel, "/", time_ns),
          .load = [image]() -> absl::StatusOr<ingest::Image> { return image; }};
}

ingest::CameraCalibration Camera(const std::string& name, const Pose3d& body_T_camera) {
  return {.name = name,
          .width = kWidth,
          .height = kHeight,
          .rate_hz = 20.0,
          .fx = 12.5,
          .fy = 12.25,
          .cx = 8.1,
          .cy = 4.2,
          .distortion = ingest::Distortion::kRadialTangential,
          .distortion_coefficients = {-0.28, 0.07, 0.0002, 0.00002},
          .body_T_camera = body_T_camera};
}

ingest::RigCalibration MakeRig(Generator* random) {
  ingest::RigCalibration rig;
  const Pose3d body_T_left = RandomPose(random);
  rig.cameras.push_back(Camera("cam0", body_T_left));
  rig.cameras.push_back(
      Camera("cam1", body_T_left * Pose3d{{0.11, 0.002, -0.001}, Eigen::Quaterniond::Identity()}));
  for (const char* name : {"color0", "depth0", "label0"}) {
    rig.cameras.push_back(Camera(name, body_T_left));
  }
  rig.imu = ingest::ImuCalibration{.name = "imu0", .rate_hz = 200.0};
  return rig;
}

void AddStep(int step, Generator* random, std::vector<ingest::Measurement>* out) {
  const TimeNs now = kFirstNs + step * kStepNs;
  out->push_back(ingest::ImuMeasurement{now, RandomVector(random), RandomVector(random)});
  out->push_back(
      ingest::PoseMeasurement{.agent_name = "robot",
                              .agent_kind = kinds::kRobot,
                              .pose = {.time_ns = now, .map_T_agent = RandomPose(random)}});
  out->push_back(RandomImageAt(now, "cam0", ingest::PixelFormat::kGray8, random));
  out->push_back(RandomImageAt(now, "cam1", ingest::PixelFormat::kGray8, random));
  if (step % 3 == 0) {
    const ingest::PixelFormat depth =
        step % 2 == 0 ? ingest::PixelFormat::kDepth16 : ingest::PixelFormat::kDepth32;
    out->push_back(RandomImageAt(now, "color0", ingest::PixelFormat::kRgb8, random));
    out->push_back(RandomImageAt(now, "depth0", depth, random));
    out->push_back(RandomImageAt(now, "label0", ingest::PixelFormat::kLabel16, random));
    out->push_back(ingest::HumanDetection{.time_ns = now, .camera = "cam0", .id = step});
  }
  out->push_back(
      ingest::ImuMeasurement{now + kStepNs / 2, RandomVector(random), RandomVector(random)});
}

}  // namespace

SmallLog MakeSmallLog(uint64_t seed) {
  Generator random(seed);
  SmallLog log;
  log.log_info.format = "small";
  log.log_info.path = "small log";
  log.log_info.rig = MakeRig(&random);
  for (int step = 0; step < kStepCount; ++step) AddStep(step, &random, &log.measurements);
  log.log_info.first_ns = kFirstNs;
  log.log_info.measurement_count = static_cast<int64_t>(log.measurements.size());
  log.log_info.channel_counts = {{"label0", 1}, {"detections0", 1}};
  return log;
}

std::vector<std::string> DetectionLinesOf(const SmallLog& log) {
  std::vector<std::string> lines;
  TimeNs last_ns = 0;
  for (const ingest::Measurement& measurement : log.measurements) {
    const auto* detection = std::get_if<ingest::HumanDetection>(&measurement);
    if (detection == nullptr) continue;
    last_ns = detection->time_ns;
    // Blanks that a parser and a printer would not keep.
    lines.push_back(absl::StrCat("{ \"id\":1,  \"time_ns\": ", last_ns, ", \"score\": 0.50}"));
    lines.push_back(absl::StrCat("{\"time_ns\":", last_ns, ",\"id\":2,\"joints\":[[1,2,3.0]]}"));
  }
  lines.push_back(absl::StrCat("{\"time_ns\":", last_ns + kNsPerSecond * 9, ",\"id\":3}"));
  return lines;
}

void WriteText(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::string ReadBytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void WriteFolder(const SmallLog& log, const std::string& folder) {
  std::filesystem::create_directories(folder + "/mav0/detections0");
  std::string text;
  for (const std::string& line : DetectionLinesOf(log)) absl::StrAppend(&text, line, "\n");
  WriteText(folder + "/mav0/detections0/data.jsonl", text);
  WriteText(folder + "/labels.csv", kLabels);
}

}  // namespace dsg::simulator::test
