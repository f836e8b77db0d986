// SPDX-License-Identifier: Apache-2.0
// Classes for logs that have none: label pictures beside them, and a network that makes them.
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "absl/strings/str_cat.h"
#include "ingest/pipeline/ingest_log.h"
#include "ingest/pipeline/segmented_log.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/support/full_disk.h"
#include "tests/unit/ingest/agents/detector/tiny_segmenter.h"
#include "tests/unit/ingest/depth/made_scan.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr double kFocal = 120.0;
// The classes of the pictures: a cabinet stands where the made room has its pillar.
constexpr int kCabinet = 1;
constexpr int kFloorOfRoom = 2;
constexpr int kWallOfRoom = 3;
constexpr char kClasses[] = "id,name\n0,unknown\n1,cabinet\n2,floor\n3,wall\n";

int ClassAt(const Eigen::Vector3d& point) {
  if (MadePillar().exteriorDistance(point) < 1e-6) return kCabinet;
  return point.z() < 1e-6 ? kFloorOfRoom : kWallOfRoom;
}

// A camera goes around the cabinet and looks at it. Of TUM's form, in which colours tell classes:
// red, green and blue.
class LabelledLog : public testing::Test {
 protected:
  static constexpr int kFrameCount = 40;

  void SetUp() override {
    for (const char* const name : {"log/rgb", "log/depth", "labels"}) {
      std::filesystem::create_directories(folder_.Path(name));
    }
    std::string color, depth, poses;
    for (int i = 0; i < kFrameCount; ++i) {
      const std::string stamp = absl::StrCat(1'600'000'000 + i / 10, ".", i % 10, "0");
      const double turn = 2.0 * std::numbers::pi * i / kFrameCount;
      Pose3d map_T_camera;
      map_T_camera.position = {1.7 + 1.8 * std::cos(turn), 0.7 + 1.8 * std::sin(turn), 1.3};
      Eigen::Matrix3d axes;
      axes.col(2) = Eigen::Vector3d(-std::cos(turn), -std::sin(turn), 0.0);
      axes.col(1) = -Eigen::Vector3d::UnitZ();
      axes.col(0) = axes.col(1).cross(axes.col(2));
      map_T_camera.orientation = Eigen::Quaterniond(axes);
      WritePictures(stamp, map_T_camera);
      absl::StrAppend(&color, stamp, " rgb/", stamp, ".png\n");
      absl::StrAppend(&depth, stamp, " depth/", stamp, ".png\n");
      const Eigen::Vector3d& p = map_T_camera.position;
      const Eigen::Quaterniond& q = map_T_camera.orientation;
      absl::StrAppend(&poses, stamp, " ", p.x(), " ", p.y(), " ", p.z(), " ", q.x(), " ", q.y(),
                      " ", q.z(), " ", q.w(), "\n");
    }
    folder_.Write("log/rgb.txt", color);
    folder_.Write("log/depth.txt", depth);
    folder_.Write("log/groundtruth.txt", poses);
    folder_.Write("log/camera-intrinsics.txt", absl::StrCat(kFocal, " 0 ", kWidth / 2, "\n0 ",
                                                            kFocal, " ", kHeight / 2, "\n0 0 1\n"));
    folder_.Write("labels/labels.csv", kClasses);
    store_ = *OpenStore("memory:labelled", {.create = true});
  }

  void WritePictures(const std::string& stamp, const Pose3d& map_T_camera) const {
    cv::Mat depth(kHeight, kWidth, CV_16UC1);
    cv::Mat color(kHeight, kWidth, CV_8UC3, cv::Scalar(0, 0, 0));
    cv::Mat label(kHeight, kWidth, CV_8UC1);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const Eigen::Vector3d way =
            map_T_camera.orientation *
            Eigen::Vector3d((u - kWidth / 2) / kFocal, (v - kHeight / 2) / kFocal, 1.0);
        const double z = HitOf(map_T_camera.position, way);
        const int class_id = ClassAt(map_T_camera.position + z * way);
        depth.at<uint16_t>(v, u) = static_cast<uint16_t>(std::lround(5000.0 * z));
        label.at<uint8_t>(v, u) = static_cast<uint8_t>(class_id);
        // OpenCV's order is blue, green, red.
        color.at<cv::Vec3b>(v, u)[3 - class_id] = 250;
      }
    }
    ASSERT_TRUE(cv::imwrite(folder_.Path("log/rgb/" + stamp + ".png"), color));
    ASSERT_TRUE(cv::imwrite(folder_.Path("log/depth/" + stamp + ".png"), depth));
    ASSERT_TRUE(cv::imwrite(folder_.Path("labels/" + stamp + ".png"), label));
  }

  Segmentation MakeNetwork() const {
    SegmenterOptions options;
    options.input_width_px = kWidth;
    options.input_height_px = kHeight;
    options.model_file =
        folder_.Write("model.onnx", MakeTinySegmenter({.width_px = kWidth, .height_px = kHeight}));
    options.classes_file = folder_.Write("classes.csv", kClasses);
    const auto made = MakeSegmentation(options);
    EXPECT_TRUE(made.ok()) << made.status();
    return *made;
  }

  // Of the log with its labels, with so many voxel blocks in memory.
  absl::StatusOr<IngestSummary> IngestWith(const std::string& map, double resident_block_count) {
    MapSpec spec;
    spec.name = map;
    spec.epoch_ns = 1'600'000'000 * kNsPerSecond;
    const absl::Status made = store_->CreateMap(spec);
    EXPECT_TRUE(made.ok() || absl::IsAlreadyExists(made)) << made;
    LogOptions log_options;
    log_options.label_folder = folder_.Path("labels");
    IngestOptions options;
    options.spill_folder = folder_.Path("labels");
    options.mapping.volume.spill.resident_block_count = resident_block_count;
    const auto log = OpenLog(folder_.Path("log"), log_options);
    EXPECT_TRUE(log.ok()) << log.status();
    const std::shared_ptr<MapReader> reader = *store_->OpenMap(map);
    const auto writer = *store_->OpenWriter(map);
    return IngestLog(**log, log_options, options, *MakeSnapshotMapView(*reader->Latest(), reader),
                     *writer, {});
  }

  RevisionInfo HeadOf(const std::string& map) { return *(*store_->OpenMap(map))->Head(); }

  // The objects of the map, without those that only the session tells apart.
  std::vector<Node> Ingest(const std::string& map, const LogOptions& options,
                           const std::optional<Segmentation>& segmentation = {}) {
    MapSpec spec;
    spec.name = map;
    spec.epoch_ns = 1'600'000'000 * kNsPerSecond;
    EXPECT_TRUE(store_->CreateMap(spec).ok());
    auto log = OpenLog(folder_.Path("log"), options);
    EXPECT_TRUE(log.ok()) << log.status();
    if (segmentation.has_value()) log = SegmentLog(*std::move(log), *segmentation);
    EXPECT_TRUE(log.ok()) << log.status();
    const std::shared_ptr<MapReader> reader = *store_->OpenMap(map);
    const auto writer = *store_->OpenWriter(map);
    const auto summary =
        IngestLog(**log, options, {}, *MakeSnapshotMapView(*reader->Latest(), reader), *writer, {});
    EXPECT_TRUE(summary.ok()) << summary.status();
    EXPECT_TRUE(summary->mapping.has_value());
    return *MakeSnapshotMapView(*reader->Latest(), reader)->NodesOfLayer(layers::kObjects);
  }

  static void ExpectTheCabinet(const std::vector<Node>& objects) {
    ASSERT_EQ(objects.size(), 1u);
    EXPECT_EQ(objects[0].class_name, "cabinet");
    const Box3d box = objects[0].BoxMap();
    EXPECT_LT((box.center() - MadePillar().center()).head<2>().norm(), 0.05);
    EXPECT_NEAR(box.sizes().x(), 0.4, 0.1);
    EXPECT_NEAR(box.sizes().y(), 0.4, 0.1);
  }

  TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
};

TEST_F(LabelledLog, GetsItsClassesFromAFolderOfPictures) {
  for (const Node& node : Ingest("plain", {})) EXPECT_NE(node.class_name, "cabinet");
  LogOptions options;
  options.label_folder = folder_.Path("labels");
  ExpectTheCabinet(Ingest("labelled", options));
}

TEST_F(LabelledLog, GetsItsClassesFromANetwork) {
  const std::vector<Node> found = Ingest("network", {}, MakeNetwork());
  ExpectTheCabinet(found);
  LogOptions options;
  options.label_folder = folder_.Path("labels");
  const std::vector<Node> labelled = Ingest("labelled", options);
  ASSERT_EQ(labelled.size(), found.size());
  // The colours are exact, so the classes of the network are those of the label pictures.
  EXPECT_EQ(found[0].BoxMap().min(), labelled[0].BoxMap().min());
  EXPECT_EQ(found[0].BoxMap().max(), labelled[0].BoxMap().max());
}

TEST_F(LabelledLog, KeepsItsOwnLabels) {
  LogOptions options;
  options.label_folder = folder_.Path("labels");
  const auto own = OpenLog(folder_.Path("log"), options);
  ASSERT_TRUE(own.ok()) << own.status();
  const std::string identity = (*own)->info().content_sha256;
  auto again = OpenLog(folder_.Path("log"), options);
  const auto log = SegmentLog(*std::move(again), MakeNetwork());
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ((*log)->info().content_sha256, identity);
  EXPECT_TRUE(HasNote((*log)->info(), "label images of its own"));
}

TEST_F(LabelledLog, IsAnotherLogWithAnotherNetwork) {
  Segmentation network = MakeNetwork();
  const auto identity = [&] {
    auto log = OpenLog(folder_.Path("log"), {});
    const auto segmented = SegmentLog(*std::move(log), network);
    EXPECT_TRUE(segmented.ok()) << segmented.status();
    EXPECT_EQ((*segmented)->info().channel_counts.at("label0"), kFrameCount);
    EXPECT_NE((*segmented)->info().rig.FindCamera("label0"), nullptr);
    return (*segmented)->info().content_sha256;
  };
  const std::string first = identity();
  EXPECT_EQ(identity(), first);
  EXPECT_NE((*OpenLog(folder_.Path("log"), {}))->info().content_sha256, first);
  SegmenterOptions options = network.options;
  options.mean = {1.0, 0.0, 0.0};
  const auto other = MakeSegmentation(options);
  ASSERT_TRUE(other.ok()) << other.status();
  network = *other;
  EXPECT_NE(identity(), first);
}

TEST_F(LabelledLog, IsTheSameMapWithTheVolumeOnDisk) {
  const auto all = IngestWith("memory", 1e8);
  const auto least = IngestWith("disk", 1);
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_TRUE(least.ok()) << least.status();
  EXPECT_EQ(all->mapping->volume.resident_block_count, all->mapping->volume.block_count);
  EXPECT_EQ(least->mapping->volume.block_count, all->mapping->volume.block_count);
  EXPECT_EQ(least->mapping->volume.resident_block_count, 1);
  EXPECT_GT(HeadOf("disk").revision, 3);
  EXPECT_EQ(HeadOf("disk").revision, HeadOf("memory").revision);
  EXPECT_EQ(HeadOf("disk").digest, HeadOf("memory").digest);
}

// What is committed by then are whole revisions of the same log.
TEST_F(LabelledLog, EndsWithAnErrorWhereTheVolumesDiskIsFull) {
  ASSERT_TRUE(IngestWith("memory", 1e8).ok());
  absl::Status status;
  {
    const test::FullDisk full(3'000'000);
    status = IngestWith("disk", 1).status();
  }
  EXPECT_EQ(ReasonOf(status), Reason::kDiskFull) << status;
  EXPECT_NE(status.message().find(folder_.Path("labels")), std::string::npos) << status;
  EXPECT_LT(HeadOf("disk").revision, HeadOf("memory").revision);
  // Once there is room, the same run goes on.
  const auto rest = IngestWith("disk", 1);
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_EQ(HeadOf("disk").digest, HeadOf("memory").digest);
}

TEST_F(LabelledLog, NeedsImagesToLookAt) {
  auto log = OpenLog(folder_.Write("poses.txt", "1.5 1 2 3 0 0 0 1\n"), {});
  ASSERT_TRUE(log.ok()) << log.status();
  const absl::Status refused = SegmentLog(*std::move(log), MakeNetwork()).status();
  EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid) << refused;
  EXPECT_NE(refused.message().find("neither color0 nor cam0"), std::string::npos) << refused;
}

}  // namespace
}  // namespace dsg::ingest
