// SPDX-License-Identifier: Apache-2.0
// How far observations are from the truth, cue by cue, on simulated logs: DSG_LOGS names folders
// that dsg-simulate wrote, separated by colons. Prints a table; fails only on what must hold.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "ingest/agents/detections/detection_filter.h"
#include "ingest/agents/detections/observe.h"
#include "ingest/agents/detections/perspective.h"
#include "ingest/depth/frame_maker.h"
#include "ingest/log/log_source.h"
#include "ingest/truth/truth.h"

namespace dsg::ingest {
namespace {

struct Column {
  std::map<int, std::vector<double>> errors_of_human;
  std::vector<double> errors;

  void Add(int human, double error_m) {
    errors_of_human[human].push_back(error_m);
    errors.push_back(error_m);
  }
  double Share(double share) {
    if (errors.empty()) return NAN;
    std::sort(errors.begin(), errors.end());
    return errors[static_cast<size_t>(share * static_cast<double>(errors.size() - 1))];
  }
  double MeanOverHumans() const {
    double sum = 0.0;
    for (const auto& [human, own] : errors_of_human) {
      double mean = 0.0;
      for (const double error : own) mean += error / static_cast<double>(own.size());
      sum += mean;
    }
    return sum / static_cast<double>(errors_of_human.size());
  }
};

using Table = std::map<std::string, Column>;

Eigen::Vector3d Fuse(const PersonObservation& seen, const std::set<PositionCue::Kind>& kinds,
                     bool is_robust) {
  Eigen::Matrix3d prior = seen.position_covariance_map.inverse();
  Eigen::Vector3d at = seen.map_T_torso.position;
  for (int round = 0; round < (is_robust ? 10 : 1); ++round) {
    const auto weight = [&](const Eigen::Matrix3d& information, const Eigen::Vector3d& from) {
      const double square = (at - from).dot(information * (at - from));
      return is_robust && round > 0 ? 1.0 / (1.0 + square / 9.0) : 1.0;
    };
    const double own = weight(prior, seen.map_T_torso.position);
    Eigen::Matrix3d information = own * prior;
    Eigen::Vector3d right = own * prior * seen.map_T_torso.position;
    for (const PositionCue& cue : seen.cues) {
      if (!kinds.contains(cue.kind)) continue;
      const double w = weight(cue.information_map, cue.torso_map);
      information += w * cue.information_map;
      right += w * cue.information_map * cue.torso_map;
    }
    at = information.ldlt().solve(right);
  }
  return at;
}

const char* NameOf(PositionCue::Kind kind) {
  if (kind == PositionCue::Kind::kFloorContact) return "floor";
  return kind == PositionCue::Kind::kDepthImage ? "depth" : "height";
}

class Log {
 public:
  explicit Log(const std::string& folder) : folder_(folder) {}

  void Read() {
    const auto truth = truth::ReadTruth(folder_ + "/truth");
    ASSERT_TRUE(truth.ok()) << truth.status();
    for (const auto& detection : truth->detections) truth_of_[detection.id] = detection;
    for (const auto& state : truth->human_states) {
      torso_of_[{state.human, state.time_ns}] = state.map_T_torso;
    }
    LogOptions options;
    options.poses = PoseSource::kGroundTruth;
    auto log = OpenLog(folder_ + "/log", options);
    ASSERT_TRUE(log.ok()) << log.status();
    rig_ = (*log)->info().rig;
    DepthOptions depth;
    for (const SemanticLabel& label : (*log)->info().labels) {
      if (label.name == "human" || label.name == "person") depth.dynamic_classes = {label.id};
    }
    FrameMaker frames(rig_, depth, path_);
    while (true) {
      auto next = (*log)->Next();
      ASSERT_TRUE(next.ok()) << next.status();
      if (!next->has_value()) break;
      Take(std::move(**next), &frames);
      while (auto frame = frames.Next()) Finish(*frame);
    }
    frames.Finish();
    while (auto frame = frames.Next()) Finish(*frame);
  }

  Table& table() { return table_; }
  size_t case_count() const { return case_count_; }

 private:
  void Take(Measurement measurement, FrameMaker* frames) {
    if (const auto* pose = std::get_if<PoseMeasurement>(&measurement)) {
      if (path_.Add(pose->pose)) frames->NotePose();
    } else if (auto* image = std::get_if<ImageMeasurement>(&measurement)) {
      if (image->channel != "depth0" && image->channel != "label0") return;
      frames->AddPicture({image->time_ns, image->channel, image->origin, image->load});
    } else if (const auto* detection = std::get_if<HumanDetection>(&measurement)) {
      frames->AddDetection(*detection);
      waiting_.push_back(*detection);
    }
  }

  void Finish(const DepthFrame& frame) {
    while (!waiting_.empty() && waiting_.front().time_ns <= frame.time_ns) {
      if (waiting_.front().time_ns == frame.time_ns) Measure(waiting_.front(), frame);
      waiting_.pop_front();
    }
  }

  void Measure(const HumanDetection& detection, const DepthFrame& frame);
  void MeasureCues(const PersonObservation& seen, const truth::DetectionTruth& truth);

  std::string folder_;
  std::map<int64_t, truth::DetectionTruth> truth_of_;
  std::map<std::pair<int, TimeNs>, Pose3d> torso_of_;
  RigCalibration rig_;
  RobotPath path_;
  std::deque<HumanDetection> waiting_;
  Table table_;
  size_t case_count_ = 0;
};

void Log::Measure(const HumanDetection& detection, const DepthFrame& frame) {
  const truth::DetectionTruth& truth = truth_of_.at(detection.id);
  if (truth.human < 0) return;
  const CameraCalibration& camera = *rig_.FindCamera(detection.camera);
  ObservationContext context;
  context.camera = &camera;
  // Depth and left camera are one.
  context.map_T_camera =
      frame.map_T_camera * frame.camera.body_T_camera.Inverse() * camera.body_T_camera;
  context.depth = &frame;
  context.floor_z_map = 0.0;
  const auto seen = Observe(detection, context, CueOptions());
  ASSERT_TRUE(seen.ok()) << seen.status();
  ++case_count_;
  const Eigen::Vector3d pnp = seen->map_T_torso.position;
  const Eigen::Vector3d weak =
      context.map_T_camera * PlaceByWeakCamera(detection, camera).value_or(Eigen::Vector3d::Zero());
  const auto add = [&](const std::string& name, const Eigen::Vector3d& at) {
    table_[name].Add(truth.human, (at - truth.torso_map).norm());
  };
  table_["01 pnp - detected"].Add(truth.human, (pnp - truth.detected_torso_map).norm());
  table_["02 weak - detected"].Add(truth.human, (weak - truth.detected_torso_map).norm());
  add("10 raw pnp", pnp);
  add("11 raw weak", weak);
  if (WhyRejected(detection, camera, DetectionFilterOptions()).has_value()) return;
  using Kind = PositionCue::Kind;
  add("20 filtered pnp", pnp);
  add("21 filtered weak", weak);
  add("22 filtered detected (truth table)", truth.detected_torso_map);
  for (const bool robust : {false, true}) {
    const std::string tail = robust ? " robust" : "";
    add("30 +height" + tail, Fuse(*seen, {Kind::kTorsoHeight}, robust));
    add("31 +floor" + tail, Fuse(*seen, {Kind::kFloorContact}, robust));
    add("32 +floor+height" + tail, Fuse(*seen, {Kind::kFloorContact, Kind::kTorsoHeight}, robust));
    add("33 +depth" + tail, Fuse(*seen, {Kind::kDepthImage}, robust));
    add("34 +depth+height" + tail, Fuse(*seen, {Kind::kDepthImage, Kind::kTorsoHeight}, robust));
    add("35 all" + tail,
        Fuse(*seen, {Kind::kDepthImage, Kind::kTorsoHeight, Kind::kFloorContact}, robust));
  }
  const Eigen::Vector3d off = pnp - truth.torso_map;
  table_["40 detection nees/3"].Add(truth.human,
                                    off.dot(seen->position_covariance_map.inverse() * off) / 3.0);
  const auto torso = torso_of_.find({truth.human, truth.time_ns});
  if (torso != torso_of_.end() && seen->has_heading) {
    const double off_rad = AngleBetween(seen->map_T_torso.orientation, torso->second.orientation);
    table_["41 heading, rad"].Add(truth.human, off_rad);
    table_["42 heading nees"].Add(truth.human, std::pow(off_rad / seen->heading_sigma_rad, 2));
  }
  MeasureCues(*seen, truth);
}

void Log::MeasureCues(const PersonObservation& seen, const truth::DetectionTruth& truth) {
  Eigen::Vector3d view = truth.torso_map - seen.camera_map;
  view.z() = 0.0;
  view.normalize();
  const Eigen::Vector3d side(-view.y(), view.x(), 0.0);
  std::string line;
  for (const PositionCue& cue : seen.cues) {
    const Eigen::Vector3d off = cue.torso_map - truth.torso_map;
    const std::string name = NameOf(cue.kind);
    const double rank = cue.kind == PositionCue::Kind::kDepthImage ? 2.0 : 1.0;
    table_["50 " + name + " nees/rank"].Add(truth.human, off.dot(cue.information_map * off) / rank);
    if (cue.kind == PositionCue::Kind::kTorsoHeight) {
      table_["51 " + name + " z signed"].Add(truth.human, off.z());
    } else {
      table_["51 " + name + " range signed"].Add(truth.human, view.dot(off));
      table_["52 " + name + " range abs"].Add(truth.human, std::abs(view.dot(off)));
    }
    if (cue.kind == PositionCue::Kind::kDepthImage) {
      table_["53 depth side signed"].Add(truth.human, side.dot(off));
      table_["53 depth side abs"].Add(truth.human, std::abs(side.dot(off)));
    }
    char text[200];
    std::snprintf(text, sizeof text, " %s r %.2f s %.2f z %.2f n %.1f;", name.c_str(),
                  view.dot(off), side.dot(off), off.z(), off.dot(cue.information_map * off) / rank);
    line += text;
  }
  if (std::getenv("DSG_LINES") == nullptr) return;
  const Eigen::Vector3d off = seen.map_T_torso.position - truth.torso_map;
  std::printf("# %ld v %.2f d %.1f det r %.2f s %.2f z %.2f;%s\n", static_cast<long>(truth.id),
              truth.visibility, truth.distance_m, view.dot(off), side.dot(off), off.z(),
              line.c_str());
}

TEST(ObservationFigures, AreNearerToTheTruthWithEachCue) {
  const char* const folders = std::getenv("DSG_LOGS");
  if (folders == nullptr) GTEST_SKIP() << "no simulated logs; set DSG_LOGS";
  for (const std::string& folder : std::vector<std::string>(absl::StrSplit(folders, ':'))) {
    Log log(folder);
    log.Read();
    if (testing::Test::HasFatalFailure()) return;
    std::printf("%s: %zu detections of people\n%-36s %6s %8s %8s %8s %8s\n", folder.c_str(),
                log.case_count(), "metres", "count", "mean/pp", "median", "p90", "p99");
    for (auto& [name, column] : log.table()) {
      std::printf("%-36s %6zu %8.3f %8.3f %8.3f %8.3f\n", name.c_str(), column.errors.size(),
                  column.MeanOverHumans(), column.Share(0.5), column.Share(0.9),
                  column.Share(0.99));
    }
    Table& table = log.table();
    EXPECT_LT(table["02 weak - detected"].Share(0.5), 0.05);
    EXPECT_LT(table["01 pnp - detected"].Share(0.5), 0.1);
    EXPECT_LT(table["32 +floor+height robust"].MeanOverHumans(),
              table["20 filtered pnp"].MeanOverHumans());
    EXPECT_LT(table["34 +depth+height robust"].MeanOverHumans(),
              table["32 +floor+height robust"].MeanOverHumans());
  }
}

}  // namespace
}  // namespace dsg::ingest
