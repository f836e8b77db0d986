// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/detector_feed.h"

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {

absl::StatusOr<DetectorFeed> DetectorFeed::Make(const LogInfo& info,
                                                const PersonDetectorOptions& options,
                                                TimeNs period_ns) {
  for (const char* channel : {"color0", "cam0"}) {
    if (!info.channel_counts.contains(channel)) continue;
    DSG_ASSIGN_OR_RETURN(std::unique_ptr<PersonDetector> detector, PersonDetector::Load(options));
    return DetectorFeed(channel, std::move(detector), period_ns);
  }
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--detector ", options.model_file, ": ", info.path,
                                " has neither color0 nor cam0 to look at; leave --detector out"),
                   {{"field", "detector"}, {"value", options.model_file}});
}

absl::StatusOr<std::vector<HumanDetection>> DetectorFeed::Look(const Measurement& measurement) {
  std::vector<HumanDetection> seen;
  const auto* image = std::get_if<ImageMeasurement>(&measurement);
  if (image == nullptr || image->channel != channel_ || image->time_ns < next_ns_) return seen;
  const absl::StatusOr<Image> picture = image->load();
  if (!picture.ok()) {
    ++broken_image_count_;
    return seen;
  }
  next_ns_ = image->time_ns + period_ns_;
  DSG_ASSIGN_OR_RETURN(seen, detector_->Detect(*picture, image->time_ns, channel_, next_id_));
  next_id_ += static_cast<int64_t>(seen.size());
  return seen;
}

}  // namespace dsg::ingest
