// SPDX-License-Identifier: Apache-2.0
// Folders of sensors: what is read, in which order, and what is said of folders with holes.
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/topology.h"
#include "tests/unit/ingest/log/detection_lines.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

std::string CameraYaml(const std::string& baseline) {
  return absl::StrCat(
      "sensor_type: camera\nT_BS: {cols: 4, rows: 4, data: [0, 0, 1, 0, -1, 0, 0, ", baseline,
      ", 0, -1, 0, 0, 0, 0, 0, 1]}\nrate_hz: 10\nresolution: [4, 3]\ncamera_model: pinhole\n"
      "intrinsics: [3, 3, 2, 1.5]\ndistortion_model: none\n");
}

constexpr char kImuYaml[] =
    "sensor_type: imu\nrate_hz: 20\ngyroscope_noise_density: 1e-4\ngyroscope_random_walk: 1e-5\n"
    "accelerometer_noise_density: 2e-3\naccelerometer_random_walk: 3e-3\n";
constexpr char kPoseHeader[] = "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z\n";

std::string Png(int type, double value) {
  std::vector<uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(".png", cv::Mat(3, 4, type, cv::Scalar(value, value, value)), bytes));
  return {bytes.begin(), bytes.end()};
}

// A log with every channel: stamps 100, 200, 300.
class FolderLogTest : public testing::Test {
 protected:
  void SetUp() override {
    AddCamera("cam0", Png(CV_8UC1, 10));
    AddCamera("cam1", Png(CV_8UC1, 20));
    AddCamera("color0", Png(CV_8UC3, 30));
    AddCamera("depth0", Png(CV_16UC1, 1500));
    AddCamera("label0", Png(CV_16UC1, 5 << 8 | 2));
    std::string imu = "#timestamp,w_x,w_y,w_z,a_x,a_y,a_z\n";
    std::string poses = kPoseHeader;
    for (const int t : {50, 100, 150, 200, 250, 300}) {
      absl::StrAppend(&imu, t, ",0.1,0.2,0.3,0,0,9.81\n");
      if (t % 100 == 0) absl::StrAppend(&poses, t, ",", t, ",0,1,1,0,0,0\n");
    }
    Write("imu0/data.csv", imu);
    Write("imu0/sensor.yaml", kImuYaml);
    Write("state_groundtruth_estimate0/data.csv", poses);
    Write("detections0/data.jsonl", DetectionLine(100, 0) + "\n" + DetectionLine(100, 1) + "\n" +
                                        DetectionLine(300, 2) + "\n");
    folder_.Write("log.json",
                  "{\"format\": \"dsg-sensors\", \"version\": 1, "
                  "\"counts\": {\"cam0\": 3, \"imu0\": 6}}");
    folder_.Write("labels.csv", "name,red,green,blue,alpha,id\nchair,10,20,30,255,5\n");
  }

  void AddCamera(const std::string& channel, const std::string& image) {
    std::string table = "#timestamp [ns],filename\n";
    for (const int t : {100, 200, 300}) {
      absl::StrAppend(&table, t, ",", t, ".png\n");
      Write(absl::StrCat(channel, "/data/", t, ".png"), image);
    }
    Write(channel + "/data.csv", table);
    Write(channel + "/sensor.yaml", CameraYaml(channel == "cam1" ? "-0.05" : "0.05"));
  }

  void Write(const std::string& name, const std::string& bytes) {
    folder_.Write("mav0/" + name, bytes);
  }
  void Remove(const std::string& name) {
    std::filesystem::remove_all(folder_.Path("mav0/" + name));
  }
  absl::StatusOr<WholeLog> Read(const LogOptions& options = {}) {
    return ReadAll(folder_.Path(""), options);
  }
  void ExpectMalformed(const std::vector<std::string>& parts) {
    const absl::Status status = Read().status();
    EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << status;
    for (const std::string& part : parts) {
      EXPECT_NE(std::string(status.message()).find(part), std::string::npos)
          << "no \"" << part << "\" in: " << status.message();
    }
  }
  TempFolder folder_;
};

TEST_F(FolderLogTest, MergesAllChannelsByTimeThenRank) {
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.format, "euroc");
  EXPECT_TRUE(log->info.has_clock);
  EXPECT_EQ(log->info.first_ns, 50);
  EXPECT_EQ(log->info.measurement_count, 6 + 3 + 5 * 3 + 3);
  std::vector<std::string> at_100;
  for (const auto& [channel, time_ns] : log->order) {
    if (time_ns == 100) at_100.push_back(channel);
  }
  EXPECT_EQ(at_100, (std::vector<std::string>{"imu0", "poses", "cam0", "cam1", "color0", "depth0",
                                              "label0", "detections0", "detections0"}));
  EXPECT_EQ(log->info.channel_counts.at("detections0"), 3);
  EXPECT_EQ(log->info.labels, (std::vector<SemanticLabel>{{5, "chair"}}));
  EXPECT_EQ(log->detections[2].id, 2);
  EXPECT_EQ(log->imu[0].angular_velocity_rad_s, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(log->poses[0].agent_name, "body");
  EXPECT_EQ(log->poses[0].agent_kind, kinds::kRobot);
  EXPECT_EQ(log->info.rig.cameras.size(), 5u);
  EXPECT_EQ(log->info.rig.FindCamera("cam1")->body_T_camera.position.y(), -0.05);
  EXPECT_EQ(log->info.rig.imu->rate_hz, 20.0);
}

TEST_F(FolderLogTest, BeginsWithItsSensorsNotWithAStrayDetection) {
  Write("detections0/data.jsonl", DetectionLine(1, 0) + "\n");
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.first_ns, 50);
}

TEST_F(FolderLogTest, DecodesImagesWhenAsked) {
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  std::map<std::string, Image> images;
  for (const ImageMeasurement& image : log->images) images[image.channel] = *image.load();
  EXPECT_EQ(images["cam1"].bytes, std::vector<uint8_t>(12, 20));
  EXPECT_EQ(images["color0"].format, PixelFormat::kRgb8);
  EXPECT_FLOAT_EQ(DepthAt(images["depth0"], 3, 2), 1.5f);
  EXPECT_EQ(LabelAt(images["label0"], 0, 0), 5 << 8 | 2);
}

// What is committed of a part of the log would contradict the whole of it.
TEST_F(FolderLogTest, EndsWithAnErrorWhenItIsTakenAwayWhileItIsRead) {
  auto log = OpenLog(folder_.Path(""), {});
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_TRUE((*log)->Next().ok());
  Remove("depth0/data/300.png");
  absl::Status status;
  for (int i = 0; i < 100 && status.ok(); ++i) status = (*log)->Next().status();
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << status;
  EXPECT_NE(status.message().find("depth0/data/300.png has gone"), std::string::npos) << status;
}

TEST_F(FolderLogTest, IdentityCoversTablesAndNamesOfImages) {
  const std::string identity = Read()->info.content_sha256;
  EXPECT_EQ(Read()->info.content_sha256, identity);
  EXPECT_EQ(ReadAll(folder_.Path("mav0"))->info.content_sha256, identity);
  Write("imu0/sensor.yaml", std::string(kImuYaml) + "# changed\n");
  const std::string changed = Read()->info.content_sha256;
  EXPECT_NE(changed, identity);
  Write("cam0/data/200.png", Png(CV_8UC1, 11) + "more");
  EXPECT_NE(Read()->info.content_sha256, changed);
}

TEST_F(FolderLogTest, LeavesCleanImagesAndTruthAlone) {
  Write("depth0_clean/data.csv", "garbage");
  folder_.Write("truth/mesh.ply", "garbage");
  Write("leica0/data.csv", "#timestamp,x,y,z\n");
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(HasNote(log->info, "not read: leica0"));
  EXPECT_FALSE(HasNote(log->info, "clean"));
}

TEST_F(FolderLogTest, SaysThatThePairIsNoPair) {
  Remove("cam1");
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(HasNote(log->info, "cam0 but no cam1"));
}

TEST_F(FolderLogTest, NamesWhatACameraLacks) {
  Remove("cam1/sensor.yaml");
  ExpectMalformed({"cam1/sensor.yaml", "missing"});
  AddCamera("cam1", Png(CV_8UC1, 20));
  Remove("cam1/data/200.png");
  Remove("cam1/data/300.png");
  ExpectMalformed({"cam1/data/200.png", "2 of 3"});
  Remove("cam1/data");
  ExpectMalformed({"cam1/data/100.png", "3 of 3"});
  AddCamera("cam1", Png(CV_8UC1, 20));
  Write("cam1/sensor.yaml", "resolution: [4");
  ExpectMalformed({"cam1/sensor.yaml", "YAML"});
}

TEST_F(FolderLogTest, NamesLinesWhoseStampsDoNotGrow) {
  Write("imu0/data.csv", "#\n100,0,0,0,0,0,0\n200,0,0,0,0,0,0\n150,0,0,0,0,0,0\n");
  ExpectMalformed({"imu0/data.csv:4", "steps back from 200 to 150"});
  Write("imu0/data.csv", "#\n100,0,0,0,0,0,0\n100,0,0,0,0,0,0\n");
  ExpectMalformed({"imu0/data.csv:3", "repeats"});
  Write("imu0/data.csv", "#\n100,0,0,0,0,nan,0\n");
  ExpectMalformed({"imu0/data.csv:2", "a_y"});
  Write("imu0/data.csv", "#\n100,0,0,0,0,0\n");
  ExpectMalformed({"imu0/data.csv:2", "7 columns"});
  Write("imu0/data.csv", "#\n100,0,0,0,0,0,0\n");
  folder_.Write("log.json", "{\"format\": \"dsg-sensors\", \"version\": 1}");
  Write("cam0/data.csv", "#\n300,300.png\n200,200.png\n");
  ExpectMalformed({"cam0/data.csv:3", "cam0", "300", "200"});
  Write("cam0/data.csv", "#\n300,../../../log.json\n");
  ExpectMalformed({"cam0/data.csv:2", "filename"});
}

TEST_F(FolderLogTest, RefusesImagesOfAnotherSizeThanTheCalibration) {
  Write("cam0/sensor.yaml",
        "T_BS: [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]\nresolution: [8, 3]\nintrinsics: [3,3,2,1]\n"
        "distortion_model: none\n");
  ExpectMalformed({"4 x 3", "8 x 3", "cam0"});
}

TEST_F(FolderLogTest, ChecksDetections) {
  Write("detections0/data.jsonl", DetectionLine(100, 0) + "\n{}\n");
  ExpectMalformed({"data.jsonl:2", "time_ns"});
  Write("detections0/data.jsonl", DetectionLine(100, 1) + "\n" + DetectionLine(100, 1) + "\n");
  ExpectMalformed({"data.jsonl:2", "sort the lines"});
  Write("detections0/data.jsonl", DetectionLine(100, 1) + "\n" + DetectionLine(200, 1) + "\n");
  ExpectMalformed({"data.jsonl:2", "field id", "line 1"});
  Write("detections0/data.jsonl", "");
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.channel_counts.at("detections0"), 0);
}

TEST_F(FolderLogTest, ReadsTheFacesOfBodies) {
  EXPECT_EQ(Read()->info.body_topology, nullptr);
  const std::string without = Read()->info.content_sha256;
  Write("detections0/topology.json", "{\"vertex_count\":4,\"faces\":[[0,1,2],[1,2,3]]}");
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  ASSERT_NE(log->info.body_topology, nullptr);
  EXPECT_EQ(log->info.body_topology->faces.size(), 2U);
  EXPECT_NE(log->info.content_sha256, without);
  Write("detections0/topology.json", "{\"vertex_count\":2,\"faces\":[[0,1,2]]}");
  ExpectMalformed({"topology.json", "face 0"});
  // A link that a copy left behind leads nowhere: it is not as if there were none.
  const std::string topology = folder_.Path("mav0/detections0/topology.json");
  std::filesystem::remove(topology);
  std::filesystem::create_symlink("nowhere", topology);
  ExpectMalformed({"topology.json", "regular file"});
}

TEST_F(FolderLogTest, RefusesBodiesThatItsFacesDoNotFitIfStrict) {
  Write("detections0/topology.json", "{\"vertex_count\":4,\"faces\":[[0,1,2]]}");
  Write("detections0/data.jsonl",
        DetectionLine(100, 0) + "\n" +
            Changed(DetectionLine(300, 1), "\"shape\"", "\"vertices\":[1,2,3],\"shape\"") + "\n");
  const auto log = Read();
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->detections.at(1).vertices_root.size(), 3U);
  LogOptions options;
  options.is_strict = true;
  ExpectMalformedFile(OpenLog(folder_.Path("mav0"), options).status(),
                      {"data.jsonl:2", "1 vertices", "of 4"});
}

TEST_F(FolderLogTest, RefusesOtherVersionsAndUnfinishedSimulations) {
  folder_.Write("log.json", "{\"format\": \"dsg-sensors\", \"version\": 2}");
  ExpectMalformed({"log.json", "version is 2"});
  folder_.Write("log.json", "{");
  ExpectMalformed({"log.json"});
  folder_.Write("log.json",
                "{\"format\": \"dsg-sensors\", \"version\": 1, "
                "\"counts\": {\"cam0\": 4}}");
  ExpectMalformed({"log.json", "4", "cam0", "3"});
  std::filesystem::remove(folder_.Path("log.json"));
  EXPECT_TRUE(Read().ok()) << "real EuRoC folders have none";
  folder_.Write(".rendering", "");
  ExpectMalformed({"not finished", "dsg-simulate"});
  const TempFolder other;
  other.Write("log.rendering/mav0/imu0/data.csv", "#\n100,0,0,0,0,0,0\n");
  const absl::Status status = ReadAll(other.Path("log.rendering")).status();
  EXPECT_NE(std::string(status.message()).find("not finished"), std::string::npos) << status;
}

TEST_F(FolderLogTest, ChoosesPosesAsAsked) {
  LogOptions external;
  external.poses = PoseSource::kExternal;
  const absl::Status none = Read(external).status();
  EXPECT_EQ(ReasonOf(none), Reason::kFieldInvalid);
  EXPECT_NE(std::string(none.message()).find("--pose-file"), std::string::npos) << none;
  Write("state_external0/data.csv", std::string(kPoseHeader) + "100,7,0,1,1,0,0,0\n");
  EXPECT_EQ(Read(external)->poses.size(), 1u);
  const auto automatic = Read();
  EXPECT_EQ(automatic->poses.size(), 1u);
  EXPECT_TRUE(HasNote(automatic->info, "external"));
  LogOptions truth;
  truth.poses = PoseSource::kGroundTruth;
  const auto true_poses = Read(truth);
  EXPECT_EQ(true_poses->poses.size(), 3u);
  EXPECT_TRUE(HasNote(true_poses->info, "ground truth"));
  truth.pose_file = folder_.Write("poses.txt", "0.000000100 1 2 3 0 0 0 1\n");
  EXPECT_EQ(ReasonOf(Read(truth).status()), Reason::kFieldInvalid);
  truth.poses = PoseSource::kAuto;
  const auto from_file = Read(truth);
  ASSERT_TRUE(from_file.ok()) << from_file.status();
  EXPECT_EQ(from_file->poses.at(0).pose.map_T_agent.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_NE(from_file->info.content_sha256, automatic->info.content_sha256);
  Remove("state_groundtruth_estimate0");
  truth.poses = PoseSource::kGroundTruth;
  truth.pose_file.clear();
  EXPECT_EQ(ReasonOf(Read(truth).status()), Reason::kFieldInvalid);
}

TEST_F(FolderLogTest, RefusesAPoseFileOfAnotherTime) {
  // EuRoC stamps as if they were seconds.
  LogOptions options;
  options.pose_file = folder_.Write("late.txt", "100 1 2 3 0 0 0 1\n300 1 2 3 0 0 0 1\n");
  const absl::Status status = Read(options).status();
  EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid);
  for (const std::string part : {"late.txt", "1970-01-01T00:01:40Z to 1970-01-01T00:05:00Z",
                                 "100000000000 to 300000000000 ns", "(50 to 300 ns)"}) {
    EXPECT_NE(status.message().find(part), std::string::npos) << part << ": " << status;
  }
  // One stamp at the edge is enough.
  options.pose_file = folder_.Write("edge.txt",
                                    "0.000000000 1 2 3 0 0 0 1\n"
                                    "0.000000050 1 2 3 0 0 0 1\n");
  EXPECT_TRUE(Read(options).ok()) << Read(options).status();
  options.pose_file = folder_.Write("early.txt", "0.000000049 1 2 3 0 0 0 1\n");
  EXPECT_EQ(ReasonOf(Read(options).status()), Reason::kFieldInvalid);
}

TEST_F(FolderLogTest, PointsFromASimulationToItsLog) {
  const TempFolder outer;
  outer.Write("out/log/mav0/imu0/data.csv", "#\n100,0,0,0,0,0,0\n");
  const absl::Status status = ReadAll(outer.Path("out")).status();
  EXPECT_NE(std::string(status.message()).find("out/log"), std::string::npos) << status;
  EXPECT_TRUE(ReadAll(outer.Path("out/log")).ok());
}

}  // namespace
}  // namespace dsg::ingest
