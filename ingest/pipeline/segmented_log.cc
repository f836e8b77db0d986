// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/segmented_log.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/label_table.h"
#include "ingest/log/log_digest.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr char kLabelChannel[] = "label0";

class SegmentedLog : public LogSource {
 public:
  SegmentedLog(std::unique_ptr<LogSource> log, std::string channel,
               std::shared_ptr<Segmenter> segmenter, LogInfo info)
      : log_(std::move(log)),
        channel_(std::move(channel)),
        segmenter_(std::move(segmenter)),
        info_(std::move(info)),
        note_count_(log_->info().notes.size()) {}

  const LogInfo& info() const override { return info_; }
  void SetIdle(std::function<absl::Status()> idle) override { log_->SetIdle(std::move(idle)); }

  absl::StatusOr<std::optional<Measurement>> Next() override {
    if (label_.has_value()) return std::exchange(label_, std::nullopt);
    DSG_ASSIGN_OR_RETURN(std::optional<Measurement> measurement, log_->Next());
    if (!measurement.has_value()) {
      AddLateNotes();
      return measurement;
    }
    const auto* const image = std::get_if<ImageMeasurement>(&*measurement);
    if (image != nullptr && image->channel == channel_) label_ = LabelOf(*image);
    return measurement;
  }

 private:
  // What only the end of a log tells.
  void AddLateNotes() {
    const std::vector<std::string>& notes = log_->info().notes;
    for (; note_count_ < notes.size(); ++note_count_) info_.notes.push_back(notes[note_count_]);
  }

  Measurement LabelOf(const ImageMeasurement& image) const {
    ImageMeasurement label;
    label.time_ns = image.time_ns;
    label.channel = kLabelChannel;
    label.origin = absl::StrCat("labels of ", image.origin);
    label.load = [segmenter = segmenter_, load = image.load]() -> absl::StatusOr<Image> {
      DSG_ASSIGN_OR_RETURN(const Image picture, load());
      return segmenter->Segment(picture);
    };
    return label;
  }

  std::unique_ptr<LogSource> log_;
  std::string channel_;
  std::shared_ptr<Segmenter> segmenter_;
  LogInfo info_;
  /// Of the log's own, those that `info_` has.
  size_t note_count_;
  /// Of the image that was given last.
  std::optional<Measurement> label_;
};

// For a log that keeps its own labels.
class NotedLog : public LogSource {
 public:
  NotedLog(std::unique_ptr<LogSource> log, const std::string& note)
      : log_(std::move(log)), info_(log_->info()) {
    info_.notes.push_back(note);
  }
  const LogInfo& info() const override { return info_; }
  void SetIdle(std::function<absl::Status()> idle) override { log_->SetIdle(std::move(idle)); }
  absl::StatusOr<std::optional<Measurement>> Next() override { return log_->Next(); }

 private:
  std::unique_ptr<LogSource> log_;
  LogInfo info_;
};

absl::Status HasNoColor(const LogInfo& info, const Segmentation& segmentation) {
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--segmenter ", segmentation.options.model_file, ": ", info.path,
                                " has neither color0 nor cam0 to look at; leave --segmenter out"),
                   {{"field", "segmenter"}, {"value", segmentation.options.model_file}});
}

}  // namespace

absl::StatusOr<Segmentation> MakeSegmentation(SegmenterOptions options) {
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(options.classes_file));
  DSG_ASSIGN_OR_RETURN(ClassList classes, ReadClassList(file));
  options.label_of_class.assign(
      classes.ids.label_of_id.begin(),
      classes.ids.label_of_id.begin() + static_cast<std::ptrdiff_t>(classes.count));
  DSG_RETURN_IF_ERROR(Segmenter::Load(options).status());
  DSG_ASSIGN_OR_RETURN(const std::string model_sha256, Sha256OfFile(options.model_file));
  std::string all = absl::StrCat("segmenter=", model_sha256, "\nsize=", options.input_width_px, "x",
                                 options.input_height_px, "\n");
  for (size_t i = 0; i < 3; ++i) {
    absl::StrAppend(&all, "mean=", options.mean[i], " scale=", options.scale[i], "\n");
  }
  absl::StrAppend(&all, "classes=", Sha256Hex(file.bytes), "\n");
  return Segmentation{std::move(options), std::move(classes.ids.classes), Sha256Hex(all)};
}

absl::StatusOr<std::unique_ptr<LogSource>> SegmentLog(std::unique_ptr<LogSource> log,
                                                      const Segmentation& segmentation) {
  LogInfo info = log->info();
  if (info.channel_counts.contains(kLabelChannel)) {
    return std::make_unique<NotedLog>(
        std::move(log), "the log has label images of its own, so --segmenter is not used");
  }
  const std::string channel = info.channel_counts.contains("color0") ? "color0" : "cam0";
  if (!info.channel_counts.contains(channel)) return HasNoColor(info, segmentation);
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<Segmenter> segmenter, Segmenter::Load(segmentation.options));
  const int64_t count = info.channel_counts[channel];
  info.channel_counts[kLabelChannel] = count;
  // 0 = unknown, as of a log that grows.
  if (info.measurement_count > 0) info.measurement_count += count;
  info.labels = segmentation.labels;
  info.content_sha256 =
      Sha256Hex(absl::StrCat(info.content_sha256, "\n", segmentation.sha256, "\n"));
  info.notes.push_back(absl::StrCat("the labels are those of --segmenter for ", channel));
  if (const CameraCalibration* const camera = info.rig.FindCamera(channel); camera != nullptr) {
    CameraCalibration of_labels = *camera;
    of_labels.name = kLabelChannel;
    info.rig.cameras.push_back(std::move(of_labels));
    std::sort(
        info.rig.cameras.begin(), info.rig.cameras.end(),
        [](const CameraCalibration& a, const CameraCalibration& b) { return a.name < b.name; });
  }
  return std::make_unique<SegmentedLog>(std::move(log), channel, std::move(segmenter),
                                        std::move(info));
}

}  // namespace dsg::ingest
