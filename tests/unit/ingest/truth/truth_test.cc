// SPDX-License-Identifier: Apache-2.0
// A truth folder reads back as it was written, and nothing else reads as one.
#include "ingest/truth/truth.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/support/temp_folder.h"

namespace dsg::truth {
namespace {

namespace fs = std::filesystem;

double Real(std::mt19937_64* random) {
  return static_cast<double>((*random)() >> 11) * 0x1.0p-53 * 20.0 - 10.0;
}

Eigen::Vector3d Vector(std::mt19937_64* random) {
  const double x = Real(random);
  const double y = Real(random);
  return {x, y, Real(random)};
}

Pose3d Pose(std::mt19937_64* random) {
  const Eigen::Vector3d position = Vector(random);
  const Eigen::Vector3d axis = Vector(random).normalized();
  return {position, Eigen::Quaterniond(Eigen::AngleAxisd(Real(random), axis))};
}

void FillStates(std::mt19937_64* random, Truth* truth) {
  for (int i = 0; i < 50; ++i) {
    truth->robot.push_back(
        {1000 + 5'000'000 * i, Pose(random), Vector(random), Vector(random) / 3e3, Vector(random)});
    HumanState state;
    state.time_ns = 1000 + 5'000'000 * (i / 2);
    state.human = i % 2;
    state.map_T_torso = Pose(random);
    for (auto& joint : state.joints_map) joint = Vector(random);
    truth->human_states.push_back(state);
    truth->detections.push_back({i, 1000 + 5'000'000 * i, i % 3 - 1, 0.25, 3.0 + Real(random) / 10,
                                 i % 2 == 0, Vector(random), Vector(random)});
  }
}

void FillMesh(Truth* truth) {
  truth->mesh.positions_map = {{0.1f, 0, 0}, {1, 0, 0.3f}, {0, 1, 0}, {0, 0, -1}};
  truth->mesh.instance_ids = {3 << 8 | 1, 3 << 8 | 1, 3 << 8 | 2, 0};
  truth->mesh.labels = {3, 3, 3, 0};
  truth->mesh.faces = {{0, 1, 2}, {1, 2, 3}};
  truth->face_observed = {1, 0};
  truth->free_grid = {{-1.25, 2.0}, 0.1, 5, 3, {}};
  for (int i = 0; i < 15; ++i) truth->free_grid.cells.push_back(static_cast<uint8_t>(i % 8));
}

Truth MakeTruth(uint64_t seed) {
  std::mt19937_64 random(seed);
  Truth truth;
  truth.world = "apartment";
  truth.seed = UINT64_MAX - 1;
  truth.begin_ns = 1000;
  truth.end_ns = 2'000'000'000;
  truth.labels = {{1, "wall"}, {2, "chair"}};
  ingest::CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 720;
  camera.height = 480;
  camera.rate_hz = 20.0;
  camera.fx = camera.fy = 415.692;
  camera.cx = 360;
  camera.cy = 240;
  camera.body_T_camera = Pose(&random);
  truth.rig.cameras = {camera};
  truth.rig.imu = ingest::ImuCalibration{"imu0", 200.0, 1e-4, 1e-5, 1e-2, 1e-3, Pose(&random)};
  truth.humans = {{"anna", {}, 1.7}, {"ben", {}, 1.8}};
  truth.humans[1].shape[3] = 0.1;
  truth.rooms = {{"R0", "kitchen", {{0, 0}, {4, 0}, {4, 3}, {0, 3}}, 2.7},
                 {"R1", "office", {{4, 0}, {8, 0}, {8, 3}}, 3.0}};
  truth.doors = {{0, 1, {4, 1}, {4, 1.9}, 2.1}};
  truth.objects = {{"cup 1", "cup", 9, 1, 0, Pose(&random), {0.1, 0.1, 0.12}, "", 4, 0.7},
                   {"couch", "couch", 5, 2, -1, Pose(&random), {2, 0.9, 0.8}, "couch.ply", 1, 1}};
  truth.picks = {{0, 1, 0, 500'000'000, kTimeMax, Pose(&random), true},
                 {0, 0, 1, 700'000'000, 900'000'001, Pose(&random), false}};
  FillStates(&random, &truth);
  FillMesh(&truth);
  return truth;
}

void ExpectSamePose(const Pose3d& a, const Pose3d& b) {
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.orientation.coeffs(), b.orientation.coeffs());
}

std::string ReadBytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void WriteBytes(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

const std::vector<std::string>& Files() {
  static const std::vector<std::string> files = {"world.json",     "robot.csv", "humans.csv",
                                                 "detections.csv", "mesh.ply",  "free_grid.png"};
  return files;
}

TEST(TruthFolder, ReadsBackAsItWasWritten) {
  const Truth truth = MakeTruth(1);
  const test::TempFolder folder;
  ASSERT_TRUE(WriteTruth(truth, folder.path()).ok());
  const auto read = ReadTruth(folder.path());
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->world, truth.world);
  EXPECT_EQ(read->seed, truth.seed);
  EXPECT_EQ(read->labels, truth.labels);
  EXPECT_EQ(read->rig.cameras[0].fx, truth.rig.cameras[0].fx);
  ExpectSamePose(read->rig.imu->body_T_imu, truth.rig.imu->body_T_imu);
  EXPECT_EQ(read->humans[1].shape, truth.humans[1].shape);
  EXPECT_EQ(read->rooms[1].footprint_map, truth.rooms[1].footprint_map);
  EXPECT_EQ(read->doors[0].to_map, truth.doors[0].to_map);
  EXPECT_EQ(read->objects[1].cad_file, "couch.ply");
  EXPECT_EQ(read->objects[1].room, -1);
  ExpectSamePose(read->objects[0].map_T_object, truth.objects[0].map_T_object);
  EXPECT_EQ(read->picks[0].place_ns, kTimeMax);
  EXPECT_EQ(read->picks[1].place_ns, 900'000'001);
  ExpectSamePose(read->picks[1].map_T_object_after, truth.picks[1].map_T_object_after);
  EXPECT_EQ(read->mesh.positions_map, truth.mesh.positions_map);
  EXPECT_EQ(read->mesh.instance_ids, truth.mesh.instance_ids);
  EXPECT_EQ(read->mesh.labels, truth.mesh.labels);
  EXPECT_EQ(read->mesh.faces, truth.mesh.faces);
  EXPECT_EQ(read->face_observed, truth.face_observed);
  EXPECT_EQ(read->free_grid.cells, truth.free_grid.cells);
  EXPECT_EQ(read->free_grid.origin_map, truth.free_grid.origin_map);
}

TEST(TruthFolder, KeepsStatesToTheBitAndJointsToTheMicrometre) {
  const Truth truth = MakeTruth(2);
  const test::TempFolder folder;
  ASSERT_TRUE(WriteTruth(truth, folder.path()).ok());
  const auto read = ReadTruth(folder.path());
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->robot.size(), truth.robot.size());
  for (size_t i = 0; i < truth.robot.size(); ++i) {
    ExpectSamePose(read->robot[i].map_T_body, truth.robot[i].map_T_body);
    EXPECT_EQ(read->robot[i].gyro_bias, truth.robot[i].gyro_bias);
    EXPECT_EQ(read->robot[i].time_ns, truth.robot[i].time_ns);
    ExpectSamePose(read->human_states[i].map_T_torso, truth.human_states[i].map_T_torso);
    EXPECT_LT((read->human_states[i].joints_map[7] - truth.human_states[i].joints_map[7]).norm(),
              1e-6);
    EXPECT_EQ(read->detections[i].detected_torso_map, truth.detections[i].detected_torso_map);
    EXPECT_EQ(read->detections[i].human, truth.detections[i].human);
    EXPECT_EQ(read->detections[i].touches_border, truth.detections[i].touches_border);
  }
}

TEST(TruthFolder, WritesTheSameBytesTwice) {
  const test::TempFolder a;
  const test::TempFolder b;
  ASSERT_TRUE(WriteTruth(MakeTruth(3), a.path()).ok());
  ASSERT_TRUE(WriteTruth(MakeTruth(3), b.path()).ok());
  for (const std::string& file : Files()) {
    EXPECT_EQ(ReadBytes(fs::path(a.path()) / file), ReadBytes(fs::path(b.path()) / file)) << file;
    EXPECT_FALSE(fs::exists(fs::path(a.path()) / (file + ".part"))) << file;
  }
}

TEST(TruthFolder, NamesTheFileThatIsMissing) {
  for (const std::string& file : Files()) {
    const test::TempFolder folder;
    ASSERT_TRUE(WriteTruth(MakeTruth(4), folder.path()).ok());
    fs::remove(fs::path(folder.path()) / file);
    const auto read = ReadTruth(folder.path());
    EXPECT_EQ(read.status().code(), absl::StatusCode::kNotFound) << file;
    EXPECT_NE(std::string(read.status().message()).find(file), std::string::npos) << read.status();
  }
}

TEST(TruthFolder, NamesFileLineAndFieldOfABadNumber) {
  const test::TempFolder folder;
  ASSERT_TRUE(WriteTruth(MakeTruth(5), folder.path()).ok());
  const fs::path path = fs::path(folder.path()) / "detections.csv";
  std::string text = ReadBytes(path);
  const size_t row = text.find('\n', text.find('\n') + 1) + 1;
  text.replace(row, 1, "x");
  WriteBytes(path, text);
  const auto read = ReadTruth(folder.path());
  EXPECT_EQ(ReasonOf(read.status()), Reason::kFileMalformed);
  EXPECT_NE(std::string(read.status().message()).find("detections.csv:3: field id"),
            std::string::npos)
      << read.status();
}

TEST(TruthFolder, RefusesATableThatWasCutAtALinesEnd) {
  for (const char* file : {"robot.csv", "humans.csv", "detections.csv"}) {
    const test::TempFolder folder;
    ASSERT_TRUE(WriteTruth(MakeTruth(6), folder.path()).ok());
    const fs::path path = fs::path(folder.path()) / file;
    std::string text = ReadBytes(path);
    text.resize(text.rfind('\n', text.size() - 2) + 1);
    WriteBytes(path, text);
    EXPECT_EQ(ReasonOf(ReadTruth(folder.path()).status()), Reason::kFileMalformed) << file;
  }
}

TEST(TruthFolder, RefusesEveryCut) {
  std::mt19937_64 random(test::TestSeed(7));
  const test::TempFolder folder;
  ASSERT_TRUE(WriteTruth(MakeTruth(7), folder.path()).ok());
  for (const std::string& file : Files()) {
    const fs::path path = fs::path(folder.path()) / file;
    const std::string whole = ReadBytes(path);
    for (int i = 0; i < 40; ++i) {
      // The last line end of JSON says nothing.
      const size_t length = random() % (whole.size() - 1);
      WriteBytes(path, whole.substr(0, length));
      EXPECT_FALSE(ReadTruth(folder.path()).ok()) << file << " cut to " << length;
    }
    WriteBytes(path, whole);
  }
  EXPECT_TRUE(ReadTruth(folder.path()).ok());
}

TEST(TruthFolder, SurvivesFlippedBytes) {
  std::mt19937_64 random(test::TestSeed(8));
  const test::TempFolder folder;
  ASSERT_TRUE(WriteTruth(MakeTruth(8), folder.path()).ok());
  int refused_count = 0;
  for (const std::string& file : Files()) {
    const fs::path path = fs::path(folder.path()) / file;
    const std::string whole = ReadBytes(path);
    for (int i = 0; i < 80; ++i) {
      std::string changed = whole;
      for (uint64_t k = 0; k <= random() % 3; ++k) {
        changed[random() % changed.size()] = static_cast<char>(random());
      }
      WriteBytes(path, changed);
      const auto read = ReadTruth(folder.path());
      if (read.ok()) continue;
      ++refused_count;
      EXPECT_NE(std::string(read.status().message()).find(folder.path()), std::string::npos)
          << read.status();
    }
    WriteBytes(path, whole);
  }
  EXPECT_GT(refused_count, 120);
}

TEST(TruthFolder, RefusesToWriteWhatItCouldNotReadBack) {
  const test::TempFolder folder;
  Truth truth = MakeTruth(9);
  truth.picks[0].human = 2;
  EXPECT_EQ(ReasonOf(WriteTruth(truth, folder.path())), Reason::kFieldInvalid);
  truth = MakeTruth(9);
  truth.mesh.instance_ids[0] = 1 << 16;
  EXPECT_EQ(ReasonOf(WriteTruth(truth, folder.path())), Reason::kFieldInvalid);
  truth = MakeTruth(9);
  truth.robot[4].map_T_body.position.x() = NAN;
  EXPECT_EQ(ReasonOf(WriteTruth(truth, folder.path())), Reason::kFieldInvalid);
  EXPECT_FALSE(fs::exists(fs::path(folder.path()) / "world.json"));
}

TEST(TruthFolder, ReportsAFolderThatCannotBeMade) {
  const test::TempFolder folder;
  WriteBytes(fs::path(folder.path()) / "file", "x");
  const absl::Status status = WriteTruth(MakeTruth(10), folder.path() + "/file/truth");
  EXPECT_EQ(ReasonOf(status), Reason::kFieldInvalid) << status;
}

}  // namespace
}  // namespace dsg::truth
