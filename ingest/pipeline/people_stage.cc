// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/people_stage.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "ingest/depth/frame_maker.h"
#include "ingest/log/body_topology.h"
#include "ingest/pipeline/ingest_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {

PeopleStage::PeopleStage(const RigCalibration& rig, const PeopleOptions& options, bool has_depth,
                         const RobotPath& path, PeopleTold told, bool is_on,
                         const std::string& spill_folder)
    : rig_(rig),
      options_(options),
      has_depth_(has_depth),
      is_on_(is_on),
      path_(path),
      tracker_(options.tracker, spill_folder),
      told_(std::move(told)) {}

void PeopleStage::NotePose(TimeNs time_ns) {
  if (!has_depth_) TakeUntil(time_ns, nullptr);
}

bool PeopleStage::Take(const Measurement& measurement) {
  const auto* detection = std::get_if<HumanDetection>(&measurement);
  if (!is_on_ || detection == nullptr) return false;
  AddDetection(*detection);
  return true;
}

void PeopleStage::AddDetection(HumanDetection detection) {
  ++counts_.detection_count;
  if (!detection.vertices_root.empty()) {
    ++counts_.body_count;
    const bool has_faces = FitsTopology(told_.body_topology(), detection.vertices_root);
    if (!has_faces) ++counts_.faceless_body_count;
  }
  if (waiting_.empty() || waiting_.back().time_ns != detection.time_ns) {
    waiting_.push_back({detection.time_ns, {}});
  }
  waiting_.back().detections.push_back(std::move(detection));
}

absl::Status PeopleStage::See(const DepthFrame& frame) {
  TakeUntil(frame.time_ns + options_.look.same_moment_ns, &frame);
  return absl::OkStatus();
}

void PeopleStage::Close() {
  TakeUntil(kTimeMax, nullptr);
  tracker_.Finish();
}

void PeopleStage::Tell(Findings* findings, GraphDelta* delta) {
  if (!is_on_) return;
  floors_m_ = findings->floors_m;
  GraphDelta change = told_.Tell(&tracker_, findings->is_last);
  const auto move = [](auto& source, auto* target) {
    std::move(source.begin(), source.end(), std::back_inserter(*target));
  };
  move(change.nodes, &delta->nodes);
  move(change.edges, &delta->edges);
  move(change.appends, &delta->appends);
  move(change.corrections, &delta->corrections);
  move(change.factors, &delta->factors);
  move(change.shapes, &delta->shapes);
  move(change.assets, &delta->assets);
  Coalesce(delta);
  findings->status.Update(status());
}

void PeopleStage::Summarize(IngestSummary* summary) const {
  if (is_on_) summary->people = PeopleSummary{Counts(), clock_.times()};
}

PeopleCounts PeopleStage::Counts() const {
  PeopleCounts counts = counts_;
  const TrackerCounts tracks = tracker_.counts();
  counts.used_count = tracks.observation_count - tracks.duplicate_count - tracks.unusable_count -
                      tracks.weak_unused_count;
  counts.track_count = tracks.track_count;
  counts.dropped_track_count = tracks.dropped_track_count;
  counts.same_as_count = tracks.same_as_count;
  const auto add = [&counts](const char* reason, int64_t count) {
    if (count > 0) counts.rejected[reason] += count;
  };
  add("a second box about a body", tracks.duplicate_count);
  add("not placeable in time or space", tracks.unusable_count);
  add("at the border and of no track", tracks.weak_unused_count);
  return counts;
}

void PeopleStage::TakeUntil(TimeNs until_ns, const DepthFrame* frame) {
  while (!waiting_.empty() && waiting_.front().time_ns <= until_ns) {
    const Image& image = waiting_.front();
    const bool is_same_moment =
        frame != nullptr && image.time_ns >= frame->time_ns - options_.look.same_moment_ns;
    Track(image, is_same_moment ? frame : nullptr);
    waiting_.pop_front();
  }
}

std::vector<PeopleStage::Filtered> PeopleStage::Filter(const Image& image) {
  std::vector<Filtered> kept;
  const std::string& camera_name = image.detections.front().camera;
  for (const HumanDetection& detection : image.detections) {
    const CameraCalibration* camera = CameraOf(detection.camera);
    std::optional<std::string_view> why;
    if (camera == nullptr) {
      why = "camera without calibration";
    } else if (detection.camera != camera_name) {
      // One person in two images of a stamp would be two persons.
      why = "another camera at the same stamp";
    } else {
      why = WhyRejected(detection, *camera, options_.filter);
    }
    const bool is_weak = why == kAtBorder && options_.is_border_used;
    if (why.has_value() && !is_weak) {
      ++counts_.rejected[std::string(*why)];
    } else {
      kept.push_back({&detection, is_weak});
    }
  }
  return kept;
}

void PeopleStage::Track(const Image& image, const DepthFrame* frame) {
  const StageClock::Span span(&clock_, "people");
  const std::vector<Filtered> detections = Filter(image);
  Pose3d map_T_body;
  if (path_.At(image.time_ns, &map_T_body) != RobotPath::Answer::kKnown) {
    counts_.rejected["no pose"] += static_cast<int64_t>(detections.size());
    return;
  }
  ObservationContext context;
  context.depth = options_.cues.is_depth_used ? frame : nullptr;
  std::vector<PersonObservation> observations;
  for (const auto& [detection, is_weak] : detections) {
    context.camera = CameraOf(detection->camera);
    context.map_T_camera = map_T_body * context.camera->body_T_camera;
    context.floor_z_map = FloorUnder(context.map_T_camera.position.z());
    absl::StatusOr<PersonObservation> observation = Observe(*detection, context, options_.cues);
    if (observation.ok()) {
      observation->is_weak = is_weak;
      observations.push_back(*std::move(observation));
    } else {
      ++counts_.rejected["cannot be placed"];
    }
  }
  const auto count = static_cast<int64_t>(observations.size());
  if (!tracker_.Observe(image.time_ns, std::move(observations))) {
    counts_.rejected["out of order"] += count;
  }
}

const CameraCalibration* PeopleStage::CameraOf(const std::string& name) const {
  for (const CameraCalibration& camera : rig_.cameras) {
    if (camera.name == name) return &camera;
  }
  return nullptr;
}

std::optional<double> PeopleStage::FloorUnder(double camera_z_m) const {
  if (options_.floor_z_m.has_value()) return options_.floor_z_m;
  const LookOptions& look = options_.look;
  const auto above =
      std::upper_bound(floors_m_.begin(), floors_m_.end(), camera_z_m - look.camera_m_min);
  if (above != floors_m_.begin()) return *std::prev(above);
  const bool is_zero_likely = camera_z_m >= look.camera_m_min && camera_z_m <= look.camera_m_max;
  return is_zero_likely ? std::optional<double>(0.0) : std::nullopt;
}

}  // namespace dsg::ingest
