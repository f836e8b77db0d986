// SPDX-License-Identifier: Apache-2.0
// Logs with detections of people into real stores: tracks, factors, shapes, stays, and what a
// repetition, an interruption and a second log change.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/pipeline/ingest_log.h"
#include "ingest/pipeline/log_run.h"
#include "schema/base/status.h"
#include "schema/codec/topology.h"
#include "schema/store/graph_store.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {
namespace {

constexpr TimeNs kImageStepNs = 200'000'000;
constexpr TimeNs kBeginNs = 1'000'000'000'000;

// A log held in memory.
class ScriptedLog : public LogSource {
 public:
  ScriptedLog(std::vector<Measurement> measurements, std::string content,
              std::shared_ptr<const Topology> topology = nullptr) {
    info_.body_topology = std::move(topology);
    measurements_ = std::move(measurements);
    info_.format = "scripted";
    info_.path = "scripted";
    info_.content_sha256 = std::move(content);
    info_.has_clock = true;
    info_.channel_counts = {{"poses", 1}, {"detections0", 1}};
    CameraCalibration camera;
    camera.name = "cam0";
    camera.width = 720;
    camera.height = 480;
    camera.fx = camera.fy = 415.0;
    camera.cx = 360.0;
    camera.cy = 240.0;
    // Looks along the body's x; x of the image is to the right, y down.
    Eigen::Matrix3d body_R_camera;
    body_R_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    camera.body_T_camera.orientation = Eigen::Quaterniond(body_R_camera);
    info_.rig.cameras.push_back(camera);
  }

  const LogInfo& info() const override { return info_; }
  absl::StatusOr<std::optional<Measurement>> Next() override {
    if (next_ == measurements_.size()) return std::nullopt;
    return measurements_[next_++];
  }

 private:
  LogInfo info_;
  std::vector<Measurement> measurements_;
  size_t next_ = 0;
};

PoseMeasurement RobotAt(TimeNs time_ns) {
  PoseMeasurement pose;
  pose.agent_name = "body";
  pose.agent_kind = kinds::kRobot;
  pose.pose.time_ns = time_ns;
  pose.pose.map_T_agent.position = {0, 0, 1};
  return pose;
}

// Of each joint of somebody who stands, from the pelvis, metres.
constexpr std::array<double, kJointCount> kDown = {
    0.0,  0.08,  0.08,  -0.12, 0.48,  0.48,  -0.25, 0.88,  0.88, -0.3, 0.93, 0.93,
    -0.5, -0.45, -0.45, -0.6,  -0.42, -0.42, -0.15, -0.15, 0.1,  0.1,  0.18, 0.18};
constexpr std::array<double, kJointCount> kRight = {
    0.0, -0.1, 0.1, 0.0, -0.1, 0.1, 0.0,   -0.1, 0.1,   0.0,  -0.1,  0.1,
    0.0, -0.1, 0.1, 0.0, -0.2, 0.2, -0.25, 0.25, -0.25, 0.25, -0.25, 0.25};

// Joints of somebody who stands `left_m` to the left and `ahead_m` before the robot, seen exactly.
HumanDetection Seen(TimeNs time_ns, int64_t id, double ahead_m, double left_m, float tallness) {
  HumanDetection detection;
  detection.time_ns = time_ns;
  detection.camera = "cam0";
  detection.id = id;
  detection.score = 0.9;
  const Eigen::Vector3d pelvis_camera(-left_m, 0.05, ahead_m);
  Eigen::Vector2d low(1e9, 1e9);
  Eigen::Vector2d high(-1e9, -1e9);
  for (int i = 0; i < kJointCount; ++i) {
    const auto joint = static_cast<size_t>(i);
    detection.joints_root[joint] = {kRight[joint], kDown[joint], 0.0};
    const Eigen::Vector3d at = pelvis_camera + detection.joints_root[joint];
    detection.joints_px[joint] = {360.0 + 415.0 * at.x() / at.z(), 240.0 + 415.0 * at.y() / at.z()};
    detection.joint_visibility[joint] = 1.0;
    low = low.cwiseMin(detection.joints_px[joint]);
    high = high.cwiseMax(detection.joints_px[joint]);
  }
  detection.box_px = {low.x(), low.y(), high.x(), high.y()};
  detection.pelvis_camera = pelvis_camera;
  detection.shape_coefficients = std::vector<float>(kShapeCount, tallness);
  return detection;
}

// Somebody walks to the left for `step_count` images, a little over half a metre a second.
std::vector<Measurement> WalkLeft(int step_count) {
  std::vector<Measurement> log;
  for (int i = 0; i < step_count; ++i) {
    const TimeNs time_ns = kBeginNs + i * kImageStepNs;
    log.emplace_back(RobotAt(time_ns));
    log.emplace_back(Seen(time_ns, i, 4.0, -1.5 + 0.12 * i, 0.5F));
  }
  return log;
}

class PeopleLog : public testing::Test {
 protected:
  void SetUp() override { SetUpStore("store"); }

  void SetUpStore(const std::string& name) {
    StoreOptions options;
    options.create = true;
    store_ = *GraphStore::Open(folder_.Path(name), options);
    MapSpec spec;
    spec.name = "test";
    spec.epoch_ns = kBeginNs;
    ASSERT_TRUE(store_->CreateMap(spec).ok());
    writer_ = *store_->OpenWriter("test");
    reader_ = *store_->OpenMap("test");
  }

  absl::StatusOr<IngestSummary> Ingest(std::vector<Measurement> measurements,
                                       const std::string& content = "one",
                                       const IngestOptions& options = {}) {
    return IngestWith(std::move(measurements), *writer_, content, options);
  }

  absl::StatusOr<IngestSummary> IngestWith(std::vector<Measurement> measurements,
                                           GraphWriter& writer, const std::string& content = "one",
                                           const IngestOptions& options = {}) {
    ScriptedLog log(std::move(measurements), content, topology_);
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> latest, reader_->Latest());
    const std::unique_ptr<MapView> view = MakeSnapshotMapView(latest, reader_);
    return IngestLog(log, {}, options, *view, writer, {});
  }

  std::shared_ptr<const Snapshot> Latest() { return *reader_->Latest(); }

  std::vector<TrackInfo> People() {
    std::vector<TrackInfo> people = *Latest()->Tracks();
    std::erase_if(people, [](const TrackInfo& track) { return track.kind != kinds::kHuman; });
    return people;
  }

  TempFolder folder_;
  std::shared_ptr<const Topology> topology_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<GraphWriter> writer_;
  std::shared_ptr<MapReader> reader_;
};

TEST_F(PeopleLog, MakesOneTrackOfOneWalker) {
  const auto summary = Ingest(WalkLeft(20));
  ASSERT_TRUE(summary.ok()) << summary.status();
  const std::vector<TrackInfo> people = People();
  ASSERT_EQ(people.size(), 1U);
  EXPECT_EQ(people[0].name, "person-1");
  EXPECT_EQ(people[0].pose_count, 20);
  const auto there = Latest()->Locate(people[0].agent, kBeginNs + 10 * kImageStepNs);
  ASSERT_TRUE(there.ok()) << there.status();
  EXPECT_NEAR(there->map_T_agent.position.x(), 4.0, 0.3);
  EXPECT_NEAR(there->map_T_agent.position.y(), -0.3, 0.15);
}

TEST_F(PeopleLog, KeepsFactorsAndShapesOfEachDetection) {
  ASSERT_TRUE(Ingest(WalkLeft(20)).ok());
  const NodeId agent = People().at(0).agent;
  const auto factors = Latest()->Factors(agent, kTimeMin, kTimeMax);
  ASSERT_TRUE(factors.ok());
  EXPECT_EQ(std::count_if(factors->begin(), factors->end(),
                          [](const PoseFactor& f) { return f.type == "detection_prior"; }),
            20);
  EXPECT_GE(factors->size(), 39U);
  const auto shapes = Latest()->Shapes(agent, kTimeMin, kTimeMax);
  ASSERT_TRUE(shapes.ok());
  ASSERT_EQ(shapes->size(), 20U);
  EXPECT_EQ(shapes->front().joints.size(), 72U);
  EXPECT_EQ(shapes->front().shape_coefficients.size(), 10U);
}

TEST_F(PeopleLog, StoresTheFacesOnceAndBodiesThatTheyDoNotFitAsPoints) {
  std::vector<Measurement> walk = WalkLeft(20);
  for (Measurement& measurement : walk) {
    auto* seen = std::get_if<HumanDetection>(&measurement);
    if (seen == nullptr || seen->id == 0) continue;
    // Down, right and towards the camera from the pelvis; one body has a vertex too many.
    seen->vertices_root = {0, 0.5F, 0, 0.25F, 0, 0, 0, 0, -0.25F};
    if (seen->id == 7) seen->vertices_root.insert(seen->vertices_root.end(), {0, 0, 0});
  }
  topology_ = std::make_shared<Topology>(Topology{3, {{0, 1, 2}}});
  const auto summary = Ingest(std::move(walk));
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->people->counts.body_count, 19);
  EXPECT_EQ(summary->people->counts.faceless_body_count, 1);
  const NodeId agent = People().at(0).agent;
  int64_t faced_count = 0;
  int64_t bare_count = 0;
  ASSERT_TRUE(Latest()
                  ->ReadShapes(agent, kTimeMin, kTimeMax, /*with_vertices=*/true, {},
                               [&](const ShownShape& shown) {
                                 ++(shown.topology.has_value() ? faced_count : bare_count);
                                 if (!shown.topology.has_value()) return true;
                                 const auto asset = Latest()->ReadAsset(*shown.topology);
                                 Topology stored;
                                 EXPECT_TRUE(asset.ok() && DecodeTopology(asset->content, &stored));
                                 EXPECT_EQ(stored, *topology_);
                                 // Half a metre below the pelvis of one who stands.
                                 EXPECT_NEAR(shown.shape.vertices[2], -0.5F, 0.02F);
                                 return true;
                               })
                  .ok());
  EXPECT_EQ(faced_count, 18);
  EXPECT_EQ(bare_count, 2);
}

TEST_F(PeopleLog, AddsNothingWhenRepeated) {
  ASSERT_TRUE(Ingest(WalkLeft(20)).ok());
  const Revision before = Latest()->revision();
  const auto again = Ingest(WalkLeft(20));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(Latest()->revision(), before);
}

TEST_F(PeopleLog, KeepsThePeopleOfTwoLogsApart) {
  ASSERT_TRUE(Ingest(WalkLeft(20), "one").ok());
  std::vector<Measurement> later = WalkLeft(20);
  for (Measurement& measurement : later) {
    if (auto* pose = std::get_if<PoseMeasurement>(&measurement))
      pose->pose.time_ns += 60 * kNsPerSecond;
    if (auto* seen = std::get_if<HumanDetection>(&measurement)) seen->time_ns += 60 * kNsPerSecond;
  }
  const auto second = Ingest(std::move(later), "two");
  ASSERT_TRUE(second.ok()) << second.status();
  const std::vector<TrackInfo> people = People();
  ASSERT_EQ(people.size(), 2U);
  EXPECT_EQ(people[1].name, "person-1-1");
  EXPECT_EQ(people[0].pose_count, 20);
  EXPECT_EQ(people[1].pose_count, 20);
}

TEST_F(PeopleLog, LeavesOutWhatItCannotUseAndSaysHowMuch) {
  std::vector<Measurement> log = WalkLeft(20);
  // Before the robot's first pose, at the border, and of another camera.
  log.insert(log.begin(), Measurement(Seen(kBeginNs - kImageStepNs, 100, 4.0, 0.0, 0.5F)));
  HumanDetection at_border = Seen(kBeginNs + 19 * kImageStepNs, 101, 4.0, 0.0, 0.5F);
  at_border.box_px[0] = 2.0;
  log.emplace_back(at_border);
  HumanDetection unknown = Seen(kBeginNs + 19 * kImageStepNs, 102, 4.0, 0.0, 0.5F);
  unknown.camera = "cam7";
  log.emplace_back(unknown);
  const auto summary = Ingest(std::move(log));
  ASSERT_TRUE(summary.ok()) << summary.status();
  ASSERT_TRUE(summary->people.has_value());
  EXPECT_EQ(summary->people->counts.detection_count, 23);
  EXPECT_EQ(summary->people->counts.used_count, 20);
  EXPECT_EQ(summary->people->counts.rejected.at("no pose"), 1);
  EXPECT_EQ(summary->people->counts.rejected.at("camera without calibration"), 1);
}

TEST_F(PeopleLog, MakesNoTracksWhenSwitchedOff) {
  IngestOptions options;
  options.people.is_on = false;
  const auto summary = Ingest(WalkLeft(20), "one", options);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_FALSE(summary->people.has_value());
  EXPECT_TRUE(People().empty());
  EXPECT_EQ(summary->unused.at("detections0"), 20);
}

TEST_F(PeopleLog, TellsAnEncounterOfTwoPeople) {
  std::vector<Measurement> log;
  for (int i = 0; i < 25; ++i) {
    const TimeNs time_ns = kBeginNs + i * kImageStepNs;
    log.emplace_back(RobotAt(time_ns));
    log.emplace_back(Seen(time_ns, 2 * i, 4.0, -1.9 + 0.12 * i, -1.0F));
    log.emplace_back(Seen(time_ns, 2 * i + 1, 6.0, 1.9 - 0.12 * i, 2.0F));
  }
  IngestOptions options;
  options.people.contacts.encounter_m = 2.5;
  ASSERT_TRUE(Ingest(std::move(log), "one", options).ok());
  ASSERT_EQ(People().size(), 2U);
  EdgeFilter filter;
  filter.relation = relations::kNear;
  std::optional<Edge> edge;
  ASSERT_TRUE(Latest()
                  ->ScanEdges(filter, std::nullopt, {},
                              [&edge](const Edge& found) {
                                edge = found;
                                return true;
                              })
                  .ok());
  ASSERT_TRUE(edge.has_value());
  EXPECT_EQ(edge->source, People()[0].agent);
  EXPECT_EQ(edge->target, People()[1].agent);
  EXPECT_NEAR(edge->weight, 2.0, 0.3);
  EXPECT_EQ(edge->attributes.at("contact"), AttributeValue(std::string("encounter")));
}

TEST_F(PeopleLog, KeepsAStrayDetectionAsEvidenceOnly) {
  std::vector<Measurement> log = WalkLeft(20);
  // Far from the walker, once, with another body.
  log.insert(log.begin() + 10,
             Measurement(Seen(kBeginNs + 4 * kImageStepNs, 100, 9.0, 3.0, -2.0F)));
  ASSERT_TRUE(Ingest(std::move(log)).ok());
  const std::vector<TrackInfo> people = People();
  ASSERT_EQ(people.size(), 2U);
  EXPECT_EQ(people[1].name.substr(0, 12), "unconfirmed-");
  EXPECT_EQ(people[1].pose_count, 0);
  const auto node = Latest()->GetNode(people[1].agent);
  ASSERT_TRUE(node.ok()) << node.status();
  EXPECT_EQ(node->agent->track_state, "dropped");
  EXPECT_EQ(node->confidence, 0.0);
  EXPECT_EQ(Latest()->Factors(people[1].agent, kTimeMin, kTimeMax)->size(), 1U);
}

TEST_F(PeopleLog, EndsTheSameAfterAnInterruption) {
  std::vector<Measurement> log = WalkLeft(30);
  log.insert(log.begin() + 10,
             Measurement(Seen(kBeginNs + 4 * kImageStepNs, 100, 9.0, 3.0, -2.0F)));
  ASSERT_TRUE(Ingest(log).ok());
  const std::vector<TrackInfo> whole = People();
  const Revision whole_revision = Latest()->revision();
  for (int commits = 0; commits < 8; ++commits) {
    SetUpStore(absl::StrCat("cut", commits));
    FragileWriter fragile(*writer_, commits);
    EXPECT_FALSE(IngestWith(log, fragile).ok());
    ASSERT_TRUE(Ingest(log).ok());
    const std::vector<TrackInfo> people = People();
    ASSERT_EQ(people.size(), whole.size()) << commits;
    for (size_t i = 0; i < people.size(); ++i) {
      EXPECT_EQ(people[i].agent, whole[i].agent) << commits;
      EXPECT_EQ(people[i].name, whole[i].name) << commits;
      EXPECT_EQ(people[i].pose_count, whole[i].pose_count) << commits;
    }
    EXPECT_EQ(Latest()->revision(), whole_revision) << commits;
  }
}

// Another session has told where the robot was: what a session makes of that must not depend on
// whether it is run for the first time.
TEST_F(PeopleLog, AddsNothingWhenASecondSessionIsRepeated) {
  IngestOptions paper;
  paper.people = PeopleOptions::Paper();
  ASSERT_TRUE(Ingest(WalkLeft(20)).ok());
  ASSERT_TRUE(Ingest(WalkLeft(20), "one", paper).ok());
  const Revision before = Latest()->revision();
  ASSERT_TRUE(Ingest(WalkLeft(20), "one", paper).ok());
  ASSERT_TRUE(Ingest(WalkLeft(20)).ok());
  EXPECT_EQ(Latest()->revision(), before);
}

TEST_F(PeopleLog, ASecondSessionEndsTheSameAfterAnInterruption) {
  IngestOptions paper;
  paper.people = PeopleOptions::Paper();
  ASSERT_TRUE(Ingest(WalkLeft(20)).ok());
  ASSERT_TRUE(Ingest(WalkLeft(20), "one", paper).ok());
  const Revision whole_revision = Latest()->revision();
  const size_t whole_count = People().size();
  for (int commits = 0; commits < 5; ++commits) {
    SetUpStore(absl::StrCat("second", commits));
    ASSERT_TRUE(Ingest(WalkLeft(20)).ok());
    FragileWriter fragile(*writer_, commits);
    EXPECT_FALSE(IngestWith(WalkLeft(20), fragile, "one", paper).ok());
    ASSERT_TRUE(Ingest(WalkLeft(20), "one", paper).ok());
    EXPECT_EQ(Latest()->revision(), whole_revision) << commits;
    EXPECT_EQ(People().size(), whole_count) << commits;
  }
}

// What the recipe of docs/contributing.md makes: tells how often it saw the robot move and people
// stand before it.
class Counter : public Stage {
 public:
  void NotePose(TimeNs) override { ++pose_count_; }
  bool Take(const Measurement& measurement) override {
    person_count_ += std::holds_alternative<HumanDetection>(measurement) ? 1 : 0;
    return false;
  }
  void Tell(Findings* findings, GraphDelta* delta) override {
    Node node;
    node.id = NodeId('O', 900);
    node.layer = layers::kObjects;
    node.kind = kinds::kObject;
    node.name = "counter";
    node.last_observed_ns = findings->now_ns;
    node.attributes["poses"] = static_cast<double>(pose_count_);
    node.attributes["people"] = static_cast<double>(person_count_);
    delta->nodes.push_back(node);
  }
  void Summarize(IngestSummary* summary) const override {
    summary->unused["counted"] = pose_count_;
  }

 private:
  int64_t pose_count_ = 0;
  int64_t person_count_ = 0;
};

TEST_F(PeopleLog, AStageOfTheCallersSeesAllAndIsToldWithTheOthers) {
  const std::vector<Measurement> script = WalkLeft(20);
  ScriptedLog log(script, "one");
  const std::unique_ptr<MapView> view = MakeSnapshotMapView(*reader_->Latest(), reader_);
  absl::StatusOr<RunPlan> plan = MakePlan(log.info(), {}, *view, "toy");
  ASSERT_TRUE(plan.ok()) << plan.status();
  plan->more_stages.push_back(std::make_unique<Counter>());
  LogRun run(*std::move(plan), *view,
             DeltaSink({.map = "test", .session_id = "toy"}, 0, false, *view, *writer_));
  while (true) {
    auto measurement = log.Next();
    ASSERT_TRUE(measurement.ok());
    if (!measurement->has_value()) break;
    ASSERT_TRUE(run.Take(**measurement).ok());
  }
  ASSERT_TRUE(run.Finish({}).ok());
  const auto node = (*reader_->Latest())->GetNode(NodeId('O', 900));
  ASSERT_TRUE(node.ok()) << node.status();
  EXPECT_EQ(node->attributes.at("poses"), AttributeValue(20.0));
  EXPECT_EQ(node->attributes.at("people"), AttributeValue(20.0));
  EXPECT_EQ(run.Summary().unused.at("counted"), 20);
  // The stages before it did their work as ever.
  EXPECT_EQ(run.Summary().people->counts.track_count, 1);
}

}  // namespace
}  // namespace dsg::ingest
