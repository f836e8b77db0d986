// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/frame_files.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/scene/image_effects.h"
#include "ingest/simulator/sensors/image_codec.h"
#include "ingest/simulator/sensors/instance_shuffle.h"
#include "ingest/simulator/sensors/label_colors.h"
#include "ingest/simulator/sensors/streams.h"
#include "ingest/simulator/world/catalogue.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

using ingest::CameraCalibration;
using ingest::Image;

constexpr int kJpegQuality = 92;

const CameraCalibration& CameraOf(const SensorSession& session, const char* channel) {
  const CameraCalibration* camera = session.rig().FindCamera(channel);
  DSG_CHECK(camera != nullptr);
  return *camera;
}

/// One frame on its way from rays to files.
class FrameJob {
 public:
  FrameJob(const SensorSession& session, int64_t frame, const std::string& log_folder)
      : session_(session), frame_(frame), log_folder_(log_folder) {
    effects_.gain = ExposureGain(session.TimeOf(frame), session.options().world.seed);
    const Pose3d map_T_left = session.MapTCamera(CameraOf(session, kLeftChannel), frame);
    drawn_ = session.BodiesAt(frame, map_T_left.position);
    for (const auto& drawn : drawn_) bodies_.push_back(drawn->body);
  }

  absl::Status Left() {
    const bool is_keyframe = session_.IsKeyframe(frame_);
    const ViewWants wants{
        .gray = true, .rgb = is_keyframe, .depth = is_keyframe, .label = is_keyframe};
    DSG_ASSIGN_OR_RETURN(const RenderedView view, Render(kLeftChannel, wants));
    Random noise = Noise(FrameNoise::kLeft);
    DSG_RETURN_IF_ERROR(Add(kLeftChannel, MakeGray(view, effects_, &noise)));
    return is_keyframe ? Keyframe(view) : absl::OkStatus();
  }

  absl::Status Right() {
    DSG_ASSIGN_OR_RETURN(const RenderedView view, Render(kRightChannel, {.gray = true}));
    Random noise = Noise(FrameNoise::kRight);
    return Add(kRightChannel, MakeGray(view, effects_, &noise));
  }

  std::vector<FrameFile> TakeFiles() { return std::move(files_); }

 private:
  absl::Status Keyframe(const RenderedView& view) {
    Random color_noise = Noise(FrameNoise::kColor);
    DSG_RETURN_IF_ERROR(Add(kColorChannel, MakeRgb(view, effects_, &color_noise)));
    DSG_RETURN_IF_ERROR(Add(kDepthCleanChannel, MakeCleanDepth(view)));
    Random depth_noise = Noise(FrameNoise::kDepth);
    DSG_RETURN_IF_ERROR(Add(kDepthChannel, MakeDepth(view, {}, &depth_noise)));
    DSG_RETURN_IF_ERROR(Add(kLabelsCleanChannel, MakeCleanLabels(view)));
    std::vector<int> classes;
    for (const SemanticLabel& label : Labels()) {
      if (label.id <= kSurfaceClassMax) classes.push_back(label.id);
    }
    Random label_noise = Noise(FrameNoise::kLabels);
    Image labels = MakeLabels(view, {}, classes, &label_noise);
    InstanceShuffle(session_.options().world.seed, frame_).Apply(&labels);
    return Add(kLabelsChannel, labels);
  }

  absl::StatusOr<RenderedView> Render(const char* camera_name, const ViewWants& wants) const {
    const CameraCalibration& camera = CameraOf(session_, camera_name);
    return session_.renderer().Render(session_.MapTCamera(camera, frame_), camera, bodies_, wants);
  }

  Random Noise(FrameNoise noise) const {
    return Random(session_.options().world.seed, FrameStream(noise, frame_));
  }

  absl::Status Add(std::string_view channel_name, const Image& image) {
    for (const ImageChannel& channel : ImageChannels()) {
      if (channel.name != channel_name) continue;
      const bool is_jpeg = std::string_view(channel.ending) == ".jpg";
      DSG_ASSIGN_OR_RETURN(std::string bytes,
                           is_jpeg ? EncodeJpeg(image, kJpegQuality) : EncodePng(image));
      files_.push_back(
          {ImagePath(log_folder_, channel, session_.StampOf(frame_)), std::move(bytes)});
      return absl::OkStatus();
    }
    return absl::InternalError("no such channel");
  }

  const SensorSession& session_;
  const int64_t frame_;
  const std::string& log_folder_;
  CameraEffects effects_;
  std::vector<std::unique_ptr<DrawnBody>> drawn_;
  std::vector<MovingBody> bodies_;
  std::vector<FrameFile> files_;
};

// A file that was cut off, or whose end never reached the disk, lacks the mark.
bool EndsWhole(const std::string& path) {
  const std::string_view mark = path.ends_with(".jpg") ? std::string_view("\xff\xd9", 2)
                                                       : std::string_view("IEND\xae\x42\x60\x82");
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const auto size = static_cast<std::streamoff>(in.tellg());
  if (!in || size < static_cast<std::streamoff>(mark.size())) return false;
  std::string tail(mark.size(), '\0');
  in.seekg(size - static_cast<std::streamoff>(mark.size()));
  in.read(tail.data(), static_cast<std::streamsize>(tail.size()));
  return in && tail == mark;
}

}  // namespace

absl::StatusOr<std::vector<FrameFile>> RenderFrame(const SensorSession& session, int64_t frame,
                                                   const std::string& log_folder) {
  FrameJob job(session, frame, log_folder);
  DSG_RETURN_IF_ERROR(job.Left());
  DSG_RETURN_IF_ERROR(job.Right());
  return job.TakeFiles();
}

std::vector<std::string> FramePaths(const SensorSession& session, int64_t frame,
                                    const std::string& log_folder) {
  std::vector<std::string> paths;
  for (const ImageChannel& channel : ImageChannels()) {
    if (channel.keyframes_only && !session.IsKeyframe(frame)) continue;
    paths.push_back(ImagePath(log_folder, channel, session.StampOf(frame)));
  }
  return paths;
}

bool IsFrameComplete(const SensorSession& session, int64_t frame, const std::string& log_folder) {
  for (const std::string& path : FramePaths(session, frame, log_folder)) {
    if (!EndsWhole(path)) return false;
  }
  return true;
}

}  // namespace dsg::simulator
