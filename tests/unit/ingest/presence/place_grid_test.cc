// SPDX-License-Identifier: Apache-2.0
// The grid against the naive scan.
#include "ingest/presence/place_grid.h"

#include <gtest/gtest.h>

#include <random>

namespace dsg::ingest {
namespace {

PlaceGrid::Found Naive(const std::vector<PlaceGrid::Item>& items, const Eigen::Vector3d& point) {
  PlaceGrid::Found best{-1, 1e300};
  for (const PlaceGrid::Item& item : items) {
    const double distance = (item.position - point).norm();
    if (distance < best.distance_m || (distance == best.distance_m && item.number < best.number)) {
      best = {item.number, distance};
    }
  }
  return best;
}

void ExpectNaive(const std::vector<PlaceGrid::Item>& items,
                 const std::vector<Eigen::Vector3d>& points) {
  const PlaceGrid grid(items);
  for (const Eigen::Vector3d& point : points) {
    const PlaceGrid::Found found = grid.Nearest(point);
    const PlaceGrid::Found expected = Naive(items, point);
    EXPECT_EQ(found.number, expected.number) << point.transpose();
    EXPECT_EQ(found.distance_m, expected.distance_m);
  }
}

TEST(PlaceGrid, EqualsANaiveScanOnRandomPoints) {
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> inside(-20.0, 20.0);
  std::uniform_real_distribution<double> outside(-90.0, 90.0);
  std::uniform_real_distribution<double> height(0.0, 9.0);
  for (const int count : {1, 2, 3, 17, 400}) {
    std::vector<PlaceGrid::Item> items;
    for (int i = 0; i < count; ++i) {
      items.push_back({i, {inside(random), 0.3 * inside(random), height(random)}});
    }
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 300; ++i) {
      points.emplace_back(inside(random), inside(random), height(random));
      points.emplace_back(outside(random), outside(random), height(random));
    }
    points.emplace_back(1.9e6, -1.9e6, 0.0);
    ExpectNaive(items, points);
  }
}

TEST(PlaceGrid, HoldsPointsOnALineAndOnTopOfEachOther) {
  std::vector<PlaceGrid::Item> line;
  std::vector<PlaceGrid::Item> stack;
  for (int i = 0; i < 100; ++i) {
    line.push_back({i, {0.25 * i, 3.0, 0.0}});
    stack.push_back({i, {1.0, 2.0, 0.5 * (i % 10)}});
  }
  const std::vector<Eigen::Vector3d> points = {{-5, 3, 0}, {0.125, 3, 0}, {12.6, 9, 0},
                                               {99, 3, 1}, {1, 2, 2.2},   {0, 0, 0}};
  ExpectNaive(line, points);
  ExpectNaive(stack, points);
}

TEST(PlaceGrid, GivesTheNearestThatIsAccepted) {
  constexpr unsigned kSeed = 9;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> inside(-20.0, 20.0);
  std::vector<PlaceGrid::Item> items;
  std::vector<PlaceGrid::Item> accepted;
  for (int i = 0; i < 200; ++i) {
    items.push_back({i, {inside(random), inside(random), 0.0}});
    if (i % 3 == 0) accepted.push_back(items.back());
  }
  const PlaceGrid grid(items);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d point(inside(random), inside(random), 1.0);
    const PlaceGrid::Found expected = Naive(accepted, point);
    const PlaceGrid::Found found = grid.Nearest(
        point, [](int32_t number) { return number % 3 == 0; }, 4.0);
    EXPECT_EQ(found.number, expected.distance_m < 4.0 ? expected.number : -1);
  }
}

}  // namespace
}  // namespace dsg::ingest
