// SPDX-License-Identifier: Apache-2.0
// Trajectories of files and of a map against files of truth.
#include "ingest/evaluation/compare_tracks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "ingest/evaluation/pose_file.h"
#include "schema/base/status.h"
#include "tests/support/temp_folder.h"

namespace dsg::evaluation {
namespace {

constexpr TimeNs kFirst = 1'600'000'000 * kNsPerSecond;
constexpr TimeNs kTick = 100'000'000;

// 30 s in which a circle of 2 m is gone round twice.
std::vector<StampedPose> Circle(int count = 301) {
  std::vector<StampedPose> path;
  for (int i = 0; i < count; ++i) {
    const double turn = 4.0 * M_PI * i / 300.0;
    const Eigen::AngleAxisd yaw(turn, Eigen::Vector3d::UnitZ());
    path.push_back({kFirst + i * kTick,
                    {{2 * std::cos(turn), 2 * std::sin(turn), 1}, Eigen::Quaterniond(yaw)},
                    nullptr});
  }
  return path;
}

std::string Text(const std::vector<StampedPose>& path, const std::string& form) {
  std::ostringstream out;
  out << std::setprecision(17);
  if (form == "euroc") out << "#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z\n";
  for (const StampedPose& pose : path) {
    const Eigen::Vector3d& p = pose.map_T_body.position;
    const Eigen::Quaterniond& q = pose.map_T_body.orientation;
    if (form == "euroc") {
      out << pose.time_ns << "," << p.x() << "," << p.y() << "," << p.z() << "," << q.w() << ","
          << q.x() << "," << q.y() << "," << q.z() << "\n";
    } else if (form == "tum") {
      out << pose.time_ns / kNsPerSecond << "." << std::setfill('0') << std::setw(9)
          << pose.time_ns % kNsPerSecond << " " << p.x() << " " << p.y() << " " << p.z() << " "
          << q.x() << " " << q.y() << " " << q.z() << " " << q.w() << "\n";
    } else {
      const Eigen::Matrix3d r = q.toRotationMatrix();
      for (int i = 0; i < 3; ++i) {
        out << r(i, 0) << " " << r(i, 1) << " " << r(i, 2) << " " << p[i] << (i < 2 ? " " : "\n");
      }
    }
  }
  return out.str();
}

class CompareTracksTest : public testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& text) {
    const std::filesystem::path path = std::filesystem::path(folder_.path()) / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
    return path.string();
  }

  void MakeMap() {
    store_ = *GraphStore::Open("memory:" + folder_.path(), {.create = true});
    MapSpec spec;
    spec.name = "office";
    spec.clock = Clock::kUnix;
    spec.epoch_ns = kFirst;
    spec.codec = TrajectoryCodec::kLossless;
    ASSERT_TRUE(store_->CreateMap(spec).ok());
    writer_ = *store_->OpenWriter("office");
  }

  void Commit(GraphDelta delta) {
    delta.map = "office";
    delta.session_id = "test";
    delta.sequence = ++sequence_;
    const auto result = writer_->Commit(std::move(delta));
    ASSERT_TRUE(result.ok()) << result.status();
  }

  static Node Robot(uint64_t index, const std::string& name) {
    Node node;
    node.id = NodeId('r', index);
    node.kind = kinds::kRobot;
    node.layer = *LayerOfKind(kinds::kRobot);
    node.name = name;
    node.agent = AgentInfo();
    return node;
  }

  // Told 0.3 m too far in x, and corrected in the second revision.
  void CommitRobot(uint64_t index, const std::string& name, bool has_covariance) {
    Covariance6 covariance{};
    for (const size_t diagonal : {0, 6, 11, 15, 18, 20}) covariance[diagonal] = 0.01f;
    GraphDelta told;
    told.nodes.push_back(Robot(index, name));
    TrajectoryAppend append{NodeId('r', index), {}};
    std::vector<TimedPose> corrected;
    for (const StampedPose& pose : Circle()) {
      TimedPose timed{pose.time_ns, 0, pose.map_T_body, nullptr};
      if (has_covariance) timed.covariance = std::make_shared<const Covariance6>(covariance);
      corrected.push_back(timed);
      timed.map_T_agent.position.x() += pose.time_ns % (2 * kTick) == 0 ? 0.3 : -0.3;
      append.poses.push_back(timed);
    }
    told.appends.push_back(append);
    Commit(told);
    GraphDelta correction;
    correction.corrections = {
        {NodeId('r', index), corrected.front().time_ns, corrected.back().time_ns + 1, corrected}};
    Commit(correction);
  }

  absl::StatusOr<TrackReport> OfMap(TrackRequest request) {
    const auto map = *store_->OpenMap("office");
    return CompareTracks(request, map.get(), {});
  }

  test::TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<GraphWriter> writer_;
  int64_t sequence_ = 0;
};

TEST_F(CompareTracksTest, ReadsTheSameOfAllForms) {
  const std::string tum = Write("a.txt", Text(Circle(), "tum"));
  Write("seq/mav0/state_groundtruth_estimate0/data.csv", Text(Circle(), "euroc"));
  Write("desk/groundtruth.txt", "# remark\n" + Text(Circle(), "tum"));
  for (const std::string& path :
       {tum, folder_.path() + "/seq", folder_.path() + "/seq/mav0", folder_.path() + "/desk"}) {
    const auto file = ReadPoseFile(path, 0);
    ASSERT_TRUE(file.ok()) << file.status();
    EXPECT_TRUE(file->has_times);
    ASSERT_EQ(file->poses.size(), 301u) << path;
    EXPECT_EQ(file->poses[17].time_ns, kFirst + 17 * kTick);
    EXPECT_LT((file->poses[17].map_T_body.position - Circle()[17].map_T_body.position).norm(),
              1e-12);
  }
  const auto rows = ReadPoseFile(Write("a.kitti", Text(Circle(), "kitti")), 0);
  ASSERT_TRUE(rows.ok()) << rows.status();
  EXPECT_FALSE(rows->has_times);
  ASSERT_EQ(rows->poses.size(), 301u);
  EXPECT_LT(
      AngleBetween(rows->poses[17].map_T_body.orientation, Circle()[17].map_T_body.orientation),
      1e-12);
}

TEST_F(CompareTracksTest, SaysWhatIsWrongWithAFile) {
  const auto message = [this](const std::string& text) {
    return std::string(ReadPoseFile(Write("bad.txt", text), 0).status().message());
  };
  EXPECT_NE(message("1 0 0 0 0 0 0 1\n2 0 0 zero 0 0 0 1\n").find("bad.txt:2"), std::string::npos);
  EXPECT_NE(message("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n").find("bad.txt:2"), std::string::npos);
  EXPECT_NE(message("# nothing\n").find("no pose"), std::string::npos);
  EXPECT_NE(message("1 0 0 0 0 1 0 0 0 0 1 0\n2 0 0 0 0 2 0 0 0 0 2 0\n").find("no rotation"),
            std::string::npos);
  EXPECT_NE(message("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0\n").find("bad.txt:2"), std::string::npos);
  EXPECT_TRUE(absl::IsNotFound(ReadPoseFile(folder_.path() + "/none", 0).status()));
  EXPECT_TRUE(absl::IsNotFound(ReadPoseFile(folder_.path(), 0).status()));
}

TEST_F(CompareTracksTest, AStampThatIsRepeatedCountsOnce) {
  std::vector<StampedPose> path = Circle();
  path.insert(path.begin() + 50, path[49]);
  const auto file = ReadPoseFile(Write("twice.txt", Text(path, "tum")), 0);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->poses.size(), 301u);
  ASSERT_EQ(file->notes.size(), 1u);
  EXPECT_NE(file->notes[0].find("1 of 302 rows"), std::string::npos);
}

TEST_F(CompareTracksTest, CountsSmallStampsFromTheEpochOfTheMap) {
  const std::string small = Write("small.txt", "0.5 0 0 0 0 0 0 1\n1.5 1 0 0 0 0 0 1\n");
  EXPECT_EQ(ReadPoseFile(small, kFirst)->poses[0].time_ns, kFirst + kNsPerSecond / 2);
}

TEST_F(CompareTracksTest, ComparesTwoFiles) {
  TrackRequest request;
  request.truth = Write("truth.csv", Text(Circle(), "euroc"));
  request.estimate = Write("estimate.txt", Text(Circle(151), "tum"));
  const auto report = CompareTracks(request, nullptr, {});
  ASSERT_TRUE(report.ok()) << report.status();
  ASSERT_EQ(report->tracks.size(), 1u);
  const TrackScore& score = report->tracks[0];
  EXPECT_EQ(score.name, "file");
  EXPECT_LT(score.ate->rmse_m, 1e-9);
  EXPECT_EQ(score.pair_count, 151);
  EXPECT_NEAR(score.path_m, 4.0 * M_PI, 0.01);
  EXPECT_NEAR(*score.coverage, 0.5, 0.01);
  EXPECT_FALSE(score.nees.has_value());
  EXPECT_FALSE(report->loops.has_value());
  // 12.6 m are shorter than the last length.
  EXPECT_EQ(score.rpe.size(), 3u);
  ASSERT_EQ(report->notes.size(), 1u);
  EXPECT_NE(report->notes[0].find("less than 95 %"), std::string::npos);
}

TEST_F(CompareTracksTest, ScoresTheFirstPartOfALogLikeALogThatEndsThere) {
  std::vector<StampedPose> path = Circle();
  for (size_t i = 101; i < path.size(); ++i) path[i].map_T_body.position.z() += 1.0;
  TrackRequest request;
  request.truth = Write("truth.csv", Text(Circle(), "euroc"));
  request.estimate = Write("estimate.txt", Text(path, "tum"));
  EXPECT_GT(CompareTracks(request, nullptr, {})->tracks[0].ate->rmse_m, 0.1);
  request.options.until_ns = 10 * kNsPerSecond;
  const auto report = CompareTracks(request, nullptr, {});
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_LT(report->tracks[0].ate->rmse_m, 1e-9);
  EXPECT_EQ(report->tracks[0].pair_count, 101);
  EXPECT_DOUBLE_EQ(*report->tracks[0].coverage, 1.0);
  EXPECT_EQ(nlohmann::json::parse(TrackReportToJson(*report))["until_s"], 10.0);
  EXPECT_NE(TrackReportToText(*report).find("first 10 s"), std::string::npos);
  request.estimate = Write("estimate.kitti", Text(path, "kitti"));
  const absl::Status status = CompareTracks(request, nullptr, {}).status();
  EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid);
  EXPECT_NE(status.message().find("estimate.kitti has no times"), std::string::npos) << status;
}

TEST_F(CompareTracksTest, ComparesPosesWithoutTimesRowByRowOnly) {
  TrackRequest request;
  request.truth = Write("truth.kitti", Text(Circle(), "kitti"));
  request.estimate = Write("estimate.txt", Text(Circle(), "tum"));
  const auto report = CompareTracks(request, nullptr, {});
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->options.pairing, Pairing::kRows);
  EXPECT_LT(report->tracks[0].ate->rmse_m, 1e-9);
  EXPECT_FALSE(report->tracks[0].coverage.has_value());
  EXPECT_TRUE(report->tracks[0].rpe_time.empty());
  request.pairing = Pairing::kInterpolate;
  EXPECT_EQ(ReasonOf(CompareTracks(request, nullptr, {}).status()), Reason::kFieldInvalid);
  request.pairing = Pairing::kRows;
  request.estimate = Write("short.txt", Text(Circle(300), "tum"));
  const absl::Status status = CompareTracks(request, nullptr, {}).status();
  EXPECT_NE(status.message().find("300 poses"), std::string::npos) << status;
}

TEST_F(CompareTracksTest, TellsWhatARobotSaidFirstFromWhatIsBelieved) {
  MakeMap();
  CommitRobot(1, "spot", /*has_covariance=*/true);
  TrackRequest request;
  request.truth = Write("truth.txt", Text(Circle(), "tum"));
  const auto report = OfMap(request);
  ASSERT_TRUE(report.ok()) << report.status();
  ASSERT_EQ(report->tracks.size(), 2u);
  EXPECT_EQ(report->tracks[0].name, "causal");
  EXPECT_NEAR(report->tracks[0].ate->rmse_m, 0.3, 0.01);
  EXPECT_GT(report->tracks[0].nees->position_mean, 3.0);
  EXPECT_EQ(report->tracks[1].name, "corrected");
  EXPECT_LT(report->tracks[1].ate->rmse_m, 1e-9);
  EXPECT_LT(report->tracks[1].nees->position_mean, 1e-9);
  EXPECT_EQ(report->tracks[1].nees->pose_count, 300);
  request.revision = 1;
  EXPECT_NEAR(OfMap(request)->tracks[1].ate->rmse_m, 0.3, 0.01);
}

TEST_F(CompareTracksTest, ScoresTheRobotThatIsAskedFor) {
  MakeMap();
  TrackRequest request;
  request.truth = Write("truth.txt", Text(Circle(), "tum"));
  EXPECT_EQ(ReasonOf(OfMap(request).status()), Reason::kAgentUnknown);
  CommitRobot(1, "spot", false);
  CommitRobot(2, "ugo", false);
  const auto first = OfMap(request);
  EXPECT_NE(first->estimate.find("r1 (spot)"), std::string::npos) << first->estimate;
  EXPECT_NE(first->notes[0].find("2 robots"), std::string::npos) << first->notes[0];
  for (const char* robot : {"ugo", "r2"}) {
    request.robot = robot;
    EXPECT_NE(OfMap(request)->estimate.find("r2 (ugo)"), std::string::npos);
  }
  request.robot = "anybody";
  const absl::Status status = OfMap(request).status();
  EXPECT_EQ(ReasonOf(status), Reason::kAgentUnknown);
  EXPECT_NE(status.message().find("r1 (spot), r2 (ugo)"), std::string::npos) << status;
}

TEST_F(CompareTracksTest, ScoresTheLoopClosuresOfTheMapOrOfAFile) {
  MakeMap();
  CommitRobot(1, "spot", false);
  const auto path = Circle();
  // After 15 s the robot is where it was.
  const auto loop = [&path](const char* type, size_t from, double off_m) {
    PoseFactor factor;
    factor.type = type;
    factor.from_ns = path[from].time_ns;
    factor.to_ns = path[from + 150].time_ns;
    factor.relative_pose.position.x() = off_m;
    return factor;
  };
  GraphDelta delta;
  delta.factors = {{NodeId('r', 1),
                    {loop("loop_closure", 20, 0.1), loop("loop_closure", 60, 3.0),
                     loop("loop_closure_rejected", 100, 0.1), loop("odometry", 0, 0.0)}}};
  Commit(delta);
  TrackRequest request;
  request.truth = Write("truth.txt", Text(path, "tum"));
  const auto report = OfMap(request);
  ASSERT_TRUE(report.ok()) << report.status();
  ASSERT_TRUE(report->loops.has_value());
  EXPECT_EQ(report->loops->believed.judged_count, 2);
  EXPECT_EQ(report->loops->believed.right_count, 1);
  EXPECT_EQ(report->loops->left_out.right_count, 1);
  EXPECT_DOUBLE_EQ(*report->loops->precision, 0.5);
  EXPECT_GT(*report->loops->recall, 0.4);
  request.loops = Write("loops.jsonl", R"({"from_ns": 1600000001000000000, "to_ns": )"
                                       R"(1600000016000000000, "translation": [0, 0, 0], )"
                                       R"("rotation": [0, 0, 0, 1], "sigma_m": 1, "sigma_rad": 1})"
                                       "\n");
  EXPECT_DOUBLE_EQ(*OfMap(request)->loops->precision, 1.0);
  request.loops = Write("none.jsonl", "");
  EXPECT_FALSE(OfMap(request)->loops->precision.has_value());
  EXPECT_DOUBLE_EQ(*OfMap(request)->loops->recall, 0.0);
}

TEST_F(CompareTracksTest, PrintsWhatItFound) {
  MakeMap();
  CommitRobot(1, "spot", true);
  TrackRequest request;
  request.truth = Write("truth.txt", Text(Circle(), "tum"));
  request.options.alignment = Alignment::kSim3;
  const auto report = OfMap(request);
  ASSERT_TRUE(report.ok()) << report.status();
  const auto json = nlohmann::json::parse(TrackReportToJson(*report));
  EXPECT_EQ(json["align"], "sim3");
  EXPECT_EQ(json["associate"], "interpolate");
  EXPECT_EQ(json["tolerance_s"], 0.1);
  EXPECT_TRUE(json["loops"].is_null());
  const auto& corrected = json["tracks"]["corrected"];
  EXPECT_EQ(corrected["pair_count"], 301);
  EXPECT_EQ(corrected["coverage"], 1.0);
  EXPECT_EQ(corrected["ate"]["rmse_m"], report->tracks[1].ate->rmse_m);
  EXPECT_NEAR(corrected["truth_T_estimate"]["scale"].get<double>(), 1.0, 1e-9);
  EXPECT_EQ(corrected["rpe"].size(), 4u);
  EXPECT_EQ(corrected["rpe_time"][0]["seconds"], 1.0);
  EXPECT_EQ(corrected["nees"]["pose_count"], 300);
  const std::string text = TrackReportToText(*report);
  for (const char* words : {"robot r1 (spot)", "aligned by Sim(3)", "Trajectory, causal",
                            "Trajectory, corrected", "NEES of yaw (1 is right)"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words << "\n" << text;
  }
}

}  // namespace
}  // namespace dsg::evaluation
