// SPDX-License-Identifier: Apache-2.0
// Rooms of real floor plans, scored as Bormann et al. 2016 do: recall is the largest overlap of a
// room of the truth with a segment by the room, precision the largest overlap of a segment with a
// room by the segment; means over rooms and over segments. The stricter precision of this test is
// that of each room's segment, so that a segment over three rooms counts three times.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "ingest/rooms/plan_regions.h"
#include "tests/unit/ingest/rooms/rooms_test_util.h"

namespace dsg::ingest {
namespace {

constexpr double kPixelM = 0.05;
constexpr int kWhite = 250;
/// As map servers of robots write it; drawn plans have walls of any grey.
constexpr int kNeverSeen = 205;

OccupancyGrid ReadPlan(const std::string& path) {
  const cv::Mat image = cv::imread(path, cv::IMREAD_GRAYSCALE);
  OccupancyGrid grid;
  grid.frame.cell_m = kPixelM;
  grid.frame.size = {image.cols, image.rows, 1};
  grid.cells.resize(static_cast<size_t>(grid.frame.CellCount()));
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const int value = image.at<uint8_t>(image.rows - 1 - y, x);
      Occupancy state = value >= kWhite ? Occupancy::kFree : Occupancy::kOccupied;
      if (value == kNeverSeen) state = Occupancy::kUnknown;
      grid.cells[static_cast<size_t>(grid.frame.Index({x, y, 0}))] = state;
    }
  }
  return grid;
}

PlanRegions ReadTruth(const std::string& path) {
  const OccupancyGrid grid = ReadPlan(path);
  std::vector<uint8_t> is_free;
  for (const Occupancy state : grid.cells) is_free.push_back(state == Occupancy::kFree ? 1 : 0);
  return LabelRegions(grid.frame, is_free, 1.0);
}

struct PlanScore {
  double precision = 0.0;
  double recall = 0.0;
  double segment_precision = 0.0;
  int found_count = 0;
  int true_count = 0;
};

PlanScore ScorePlan(const PlanRegions& truth, const PlanRegions& found) {
  std::vector<std::vector<int64_t>> shared(static_cast<size_t>(truth.count),
                                           std::vector<int64_t>(static_cast<size_t>(found.count)));
  for (size_t i = 0; i < truth.region_of.size(); ++i) {
    if (truth.region_of[i] < 0 || found.region_of[i] < 0) continue;
    ++shared[static_cast<size_t>(truth.region_of[i])][static_cast<size_t>(found.region_of[i])];
  }
  const std::vector<int64_t> true_sizes = truth.CellCounts();
  const std::vector<int64_t> found_sizes = found.CellCounts();
  PlanScore score;
  score.true_count = truth.count;
  score.found_count = found.count;
  for (size_t room = 0; room < shared.size(); ++room) {
    const auto best = std::max_element(shared[room].begin(), shared[room].end());
    if (best == shared[room].end() || *best == 0) continue;
    const auto segment = static_cast<size_t>(best - shared[room].begin());
    score.recall += static_cast<double>(*best) / static_cast<double>(true_sizes[room]);
    score.precision += static_cast<double>(*best) / static_cast<double>(found_sizes[segment]);
  }
  score.recall /= truth.count;
  score.precision /= truth.count;
  int segment_count = 0;
  for (size_t segment = 0; segment < found_sizes.size(); ++segment) {
    // As in the source: what is hardly larger than noise is no segment.
    if (found_sizes[segment] <= 100) continue;
    int64_t best = 0;
    for (const std::vector<int64_t>& row : shared) best = std::max(best, row[segment]);
    score.segment_precision +=
        static_cast<double>(best) / static_cast<double>(found_sizes[segment]);
    ++segment_count;
  }
  score.segment_precision /= std::max(1, segment_count);
  return score;
}

// Above what was found, below the truth: a colour for each room, that of the room of the truth it
// is mostly in; walls black. Written when DSG_PICTURES names a folder.
void DrawLabels(const std::string& name, const OccupancyGrid& plan, const PlanRegions& truth,
                const PlanRegions& found) {
  const char* folder = std::getenv("DSG_PICTURES");
  if (folder == nullptr) return;
  const int width = plan.frame.size.x(), height = plan.frame.size.y();
  Eigen::AlignedBox2i box;
  for (int64_t i = 0; i < truth.frame.CellCount(); ++i) {
    if (truth.region_of[static_cast<size_t>(i)] >= 0) {
      box.extend(Eigen::Vector2i(truth.frame.Cell(i).head<2>()));
    }
  }
  const auto color = [](int room) {
    return room < 0 ? cv::Vec3b(255, 255, 255)
                    : cv::Vec3b(static_cast<uint8_t>(60 + (room * 67) % 180),
                                static_cast<uint8_t>(60 + (room * 131) % 180),
                                static_cast<uint8_t>(60 + (room * 29 + 90) % 180));
  };
  cv::Mat picture(2 * height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto cell = static_cast<size_t>(plan.frame.Index({x, y, 0}));
      const int row = height - 1 - y;
      const bool is_wall = plan.cells[cell] != Occupancy::kFree;
      const cv::Vec3b solid(0, 0, 0);
      cv::Vec3b above = found.region_of[cell] < 0 && is_wall ? solid : color(found.region_of[cell]);
      if (is_wall && found.region_of[cell] >= 0) above = above / 2;
      picture.at<cv::Vec3b>(row, x) = above;
      picture.at<cv::Vec3b>(height + row, x) =
          truth.region_of[cell] < 0 && is_wall ? solid : color(truth.region_of[cell]);
    }
  }
  const int left = box.min().x(), top = height - 1 - box.max().y();
  const cv::Size size(box.sizes().x() + 1, box.sizes().y() + 1);
  cv::Mat both;
  cv::vconcat(picture(cv::Rect(cv::Point(left, top), size)),
              picture(cv::Rect(cv::Point(left, height + top), size)), both);
  cv::imwrite(std::string(folder) + "/" + name + "_labels.png", both);
}

// Rooms as the footprints say, so that the whole way to the answer is measured.
PlanRegions RegionsOf(const RoomLabelling& labelling, const OccupancyGrid& plan) {
  PlanRegions regions{plan.frame, std::vector<int>(plan.cells.size(), -1), 0};
  regions.count = static_cast<int>(labelling.rooms.size());
  for (size_t room = 0; room < labelling.rooms.size(); ++room) {
    const Polygon2d& outline = labelling.rooms[room].footprint_map;
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& corner : outline) box.extend(corner);
    for (double y = box.min().y() + 0.5 * kPixelM; y < box.max().y(); y += kPixelM) {
      for (double x = box.min().x() + 0.5 * kPixelM; x < box.max().x(); x += kPixelM) {
        const Eigen::Vector3i cell = plan.frame.CellOf({x, y, 0.5 * kPixelM});
        if (plan.At(cell) != Occupancy::kFree || !PolygonContains(outline, {x, y})) continue;
        regions.region_of[static_cast<size_t>(plan.frame.Index(cell))] = static_cast<int>(room);
      }
    }
  }
  return regions;
}

/// Least scores that are allowed.
struct Bounds {
  struct Pair {
    double precision;
    double recall;
  };
  const char* name;
  Pair empty;
  Pair furnished;
  const char* folder = "room-floorplans/";
};

class FloorPlanTest : public testing::TestWithParam<Bounds> {
 protected:
  PlanScore Run(const std::string& suffix) {
    const std::string name = GetParam().name;
    const std::string folder = DataPath(GetParam().folder);
    const PlanRegions truth = ReadTruth(folder + name + "_gt_segmentation.png");
    const OccupancyGrid plan = ReadPlan(folder + name + suffix + ".png");
    // Furniture stands on a room's floor: it is the room's, as in the truth.
    const OccupancyGrid empty = ReadPlan(folder + name + ".png");
    const DistanceField field(plan);
    RoomInput input;
    input.field = &field;
    AddPlaces(1.0, &input);
    RoomOptions options;
    options.method = RoomMethod::kClearance;
    options.split_corridors = false;
    const auto start = std::chrono::steady_clock::now();
    const RoomResult found = FindRooms(input, options);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    const PlanScore score = ScorePlan(truth, RegionsOf(found.best, empty));
    std::printf("| %s%s | %.1f | %.1f | %.1f | %d | %d | %.2f s |\n", name.c_str(), suffix.c_str(),
                100.0 * score.precision, 100.0 * score.recall, 100.0 * score.segment_precision,
                score.found_count, score.true_count, took.count());
    DrawLabels(name + suffix, plan, truth, RegionsOf(found.best, empty));
    MaybeDraw(name + suffix, field, input, found.best);
    return score;
  }
};

TEST_P(FloorPlanTest, IsDividedIntoItsRooms) {
  if (!std::filesystem::exists(DataPath(GetParam().folder))) {
    GTEST_SKIP() << "the real floor plans are not there; set DSG_DATA";
  }
  const PlanScore empty = Run("");
  const PlanScore furnished = Run("_furnitures");
  EXPECT_GE(empty.precision, GetParam().empty.precision);
  EXPECT_GE(empty.recall, GetParam().empty.recall);
  EXPECT_GE(furnished.precision, GetParam().furnished.precision);
  EXPECT_GE(furnished.recall, GetParam().furnished.recall);
}

// Two points below what is reached: nothing here may get worse unseen. office_a to office_c and
// lab_intel are for development, and lab_c, lab_ipa and Freiburg101 were looked at; the others are
// for validation only. lab_ipa and lab_c have lounges that stand open to corridors, and a hall that
// people have divided along a row of pillars.
constexpr char kSecond[] = "room-floorplans-2/";
INSTANTIATE_TEST_SUITE_P(
    Real, FloorPlanTest,
    testing::Values(Bounds{"office_a", {0.90, 0.98}, {0.90, 0.97}},
                    Bounds{"office_b", {0.97, 0.97}, {0.97, 0.97}},
                    Bounds{"office_c", {0.97, 0.97}, {0.97, 0.94}},
                    Bounds{"office_f", {0.97, 0.95}, {0.97, 0.95}},
                    Bounds{"office_h", {0.97, 0.97}, {0.97, 0.90}},
                    Bounds{"lab_intel", {0.90, 0.94}, {0.87, 0.94}},
                    Bounds{"lab_ipa", {0.66, 0.94}, {0.66, 0.90}},
                    Bounds{"Freiburg79_scan", {0.96, 0.98}, {0.96, 0.94}},
                    Bounds{"lab_c_scan", {0.82, 0.91}, {0.84, 0.91}},
                    Bounds{"lab_d_scan", {0.90, 0.96}, {0.90, 0.95}, kSecond},
                    Bounds{"Freiburg101_scan", {0.97, 0.96}, {0.97, 0.96}, kSecond}),
    [](const auto& which) { return std::string(which.param.name); });

}  // namespace
}  // namespace dsg::ingest
