// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/recognized_log.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "ingest/pipeline/log_eye.h"
#include "ingest/pipeline/map_things.h"
#include "ingest/recognition/keyframe_features.h"
#include "ingest/recognition/place_recognizer.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<RecognizedLogOptions> kRecognizedFields[] = {
    {"recognition-period", &RecognizedLogOptions::period_ns, 0.05, 3600.0,
     "From one image that is looked for among those before to the next, seconds: a robot has moved "
     "by a step and turned by a quarter meanwhile"},
};

class RecognizedLog : public LogSource {
 public:
  RecognizedLog(std::unique_ptr<LogSource> log, LogEye eye, KeyframeFeatureFinder finder,
                PlaceRecognizer recognizer, LogInfo info, const RecognizedLogOptions& options)
      : log_(std::move(log)),
        eye_(std::move(eye)),
        images_(eye_.left, eye_.other, /*with_labels=*/true),
        finder_(std::move(finder)),
        recognizer_(std::move(recognizer)),
        info_(std::move(info)),
        note_count_(log_->info().notes.size()),
        options_(options),
        moving_classes_(DynamicClasses(info_.labels)),
        kept_(options.memory) {
    std::sort(moving_classes_.begin(), moving_classes_.end());
  }

  const LogInfo& info() const override { return info_; }
  void SetIdle(std::function<absl::Status()> idle) override { log_->SetIdle(std::move(idle)); }

  // A loop closure comes after all that has its stamp.
  absl::StatusOr<std::optional<Measurement>> Next() override {
    while (true) {
      if (!loops_.empty()) {
        Measurement loop = std::move(loops_.front());
        loops_.pop_front();
        return loop;
      }
      if (held_.has_value()) return std::exchange(held_, std::nullopt);
      if (is_ended_) return std::nullopt;
      DSG_ASSIGN_OR_RETURN(held_, log_->Next());
      is_ended_ = !held_.has_value();
      if (!is_ended_) images_.Add(*held_);
      if (const PoseMeasurement* pose = is_ended_ ? nullptr : std::get_if<PoseMeasurement>(&*held_);
          pose != nullptr && pose->agent_kind == kinds::kRobot) {
        odom_T_body_ = pose->pose.map_T_agent;
      }
      while (!images_.empty() && (is_ended_ || !images_.IsOpen(images_.front_ns()))) {
        Look(images_.Take());
      }
      if (!is_ended_) continue;
      info_.place_memory = EncodePlaceMemory(kept_.keyframes());
      AddLateNotes();
    }
  }

 private:
  void Look(const PairedImages& images) {
    const bool is_due = images.is_whole() &&
                        (!last_ns_.has_value() || images.time_ns - *last_ns_ >= options_.period_ns);
    if (!is_due) return;
    last_ns_ = images.time_ns;
    absl::StatusOr<KeyframeFeatures> features = FeaturesOf(images);
    // A robot that was nowhere yet cannot say later where its keyframe is.
    if (features.ok() && odom_T_body_.has_value()) kept_.Add(*odom_T_body_, *features);
    absl::StatusOr<RecognizedPlaces> places =
        features.ok() ? recognizer_.Add(*std::move(features)) : features.status();
    if (!places.ok()) {
      ++broken_count_;
      if (first_broken_.empty()) first_broken_ = std::string(places.status().message());
      return;
    }
    ++keyframe_count_;
    for (const PlaceLoop& place : places->loops) loops_.emplace_back(LoopOf(place, images));
    loop_count_ += std::ssize(places->loops);
  }

  absl::StatusOr<KeyframeFeatures> FeaturesOf(const PairedImages& images) const {
    DSG_ASSIGN_OR_RETURN(const Image left, images.left->load());
    std::vector<uint8_t> mask;
    if (images.label.has_value()) {
      const absl::StatusOr<Image> labels = images.label->load();
      if (labels.ok()) mask = eye_.eye->MaskOf(*labels, moving_classes_);
    }
    DSG_ASSIGN_OR_RETURN(const OdometryFrame frame,
                         eye_.eye->FrameOf(images.time_ns, left, images.other->load, mask));
    DSG_ASSIGN_OR_RETURN(KeyframeFeatures features,
                         finder_.Find({0, images.time_ns}, frame.left, frame.mask));
    std::vector<Eigen::Vector2d> pixels;
    for (const KeyframeFeature& feature : features.features) {
      pixels.push_back(feature.pixel.cast<double>());
    }
    DSG_ASSIGN_OR_RETURN(const std::vector<std::optional<double>> disparities,
                         frame.disparities(frame.left, pixels));
    const StereoCamera& camera = eye_.eye->camera();
    const double sigma_px = options_.recognition.features.disparity_sigma_px;
    for (size_t i = 0; i < disparities.size(); ++i) {
      if (!disparities[i].has_value() || *disparities[i] <= 0.0) continue;
      const double depth_m = camera.left.fx * camera.baseline_m / *disparities[i];
      features.features[i].depth_m = static_cast<float>(depth_m);
      features.features[i].depth_sigma_m = static_cast<float>(depth_m / *disparities[i] * sigma_px);
    }
    return features;
  }

  LoopMeasurement LoopOf(const PlaceLoop& place, const PairedImages& images) const {
    LoopMeasurement loop;
    loop.time_ns = place.time_ns;
    loop.from_ns = place.from_ns;
    loop.from_T_to = place.from_T_to;
    loop.information = place.information;
    loop.score = place.score;
    loop.origin = absl::StrCat("place known again in ", images.left->origin);
    return loop;
  }

  // What only the end of a log tells.
  void AddLateNotes() {
    const std::vector<std::string>& notes = log_->info().notes;
    for (; note_count_ < notes.size(); ++note_count_) info_.notes.push_back(notes[note_count_]);
    info_.notes.push_back(absl::StrCat("recognition: ", loop_count_, " loop closures in ",
                                       keyframe_count_, " images, of which ",
                                       kept_.keyframes().size(), " are kept for other sessions"));
    if (keyframe_count_ == 0) {
      info_.notes.push_back(absl::StrCat("recognition: no image of ", eye_.left,
                                         " has a partner of its stamp in ", eye_.other));
    }
    if (broken_count_ == 0) return;
    info_.notes.push_back(absl::StrCat("recognition: ", broken_count_,
                                       " images were passed over; the first: ", first_broken_));
  }

  std::unique_ptr<LogSource> log_;
  const LogEye eye_;
  ImagePairing images_;
  KeyframeFeatureFinder finder_;
  PlaceRecognizer recognizer_;
  LogInfo info_;
  /// Of the log's own, those that `info_` has.
  size_t note_count_;
  const RecognizedLogOptions options_;
  std::vector<int32_t> moving_classes_;
  bool is_ended_ = false;
  // Where the robot was last.
  std::optional<Pose3d> odom_T_body_;
  KeptPlaces kept_;
  std::optional<TimeNs> last_ns_;
  std::optional<Measurement> held_;
  std::deque<Measurement> loops_;
  int64_t keyframe_count_ = 0;
  int64_t loop_count_ = 0;
  int64_t broken_count_ = 0;
  std::string first_broken_;
};

}  // namespace

std::vector<BoundOption> RecognizedLogOptions::Bind() {
  std::vector<BoundOption> bound = recognition.Bind();
  for (const BoundOption& field : memory.Bind()) bound.push_back(field);
  BindFields<RecognizedLogOptions>(kRecognizedFields, this, &bound);
  return bound;
}

std::string RecognizedLogOptions::Digest() const {
  return absl::StrCat("recognition\n", DigestOptions(*this), DigestOptions(stereo));
}

absl::StatusOr<std::unique_ptr<LogSource>> RecognizePlaces(std::unique_ptr<LogSource> log,
                                                           const RecognizedLogOptions& options) {
  LogInfo info = log->info();
  DSG_RETURN_IF_ERROR(ValidateOptions(options));
  DSG_ASSIGN_OR_RETURN(LogEye eye, MakeLogEye(info, options.stereo, "--recognize"));
  DSG_ASSIGN_OR_RETURN(
      KeyframeFeatureFinder finder,
      KeyframeFeatureFinder::Make(eye.eye->camera().left, options.recognition.features));
  DSG_ASSIGN_OR_RETURN(PlaceRecognizer recognizer, PlaceRecognizer::Make(options.recognition));
  // How many there will be nobody knows.
  info.channel_counts.try_emplace("loops0", 0);
  info.used_channels.insert({eye.left, eye.other});
  info.content_sha256 = Sha256Hex(absl::StrCat(info.content_sha256, "\n", options.Digest(), "\n"));
  info.notes.push_back(absl::StrCat("places are sought again in ", eye.left, " and ", eye.other));
  return std::make_unique<RecognizedLog>(std::move(log), std::move(eye), std::move(finder),
                                         std::move(recognizer), std::move(info), options);
}

}  // namespace dsg::ingest
