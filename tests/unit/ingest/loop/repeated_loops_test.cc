// SPDX-License-Identifier: Apache-2.0
// Which loops say again what another one said.
#include "ingest/loop/repeated_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "ingest/loop/chi_square.h"
#include "schema/base/random.h"
#include "tests/unit/ingest/loop/random_graph.h"

namespace dsg::ingest {
namespace {

// 2 cm and half a degree.
RelativePose MeasuredLoop(int from, int to, const Pose3d& from_T_to) {
  RelativePose loop;
  loop.from = from;
  loop.to = to;
  loop.from_T_to = from_T_to;
  loop.information.diagonal() << 2500.0, 2500.0, 2500.0, 13000.0, 13000.0, 13000.0;
  loop.is_loop = true;
  return loop;
}

RelativePose Turned(const RelativePose& loop) {
  return MeasuredLoop(loop.to, loop.from, loop.from_T_to.Inverse());
}

const double kGate = ChiSquareGate(0.99, false);

TEST(FindRepeated, CountsTheSameMeasurementOnceInEitherDirection) {
  const RelativePose loop = MeasuredLoop(3, 90, Planar(4.0, 1.0, 0.7));
  const std::vector<bool> wanted = {false, true, true, true};
  EXPECT_EQ(FindRepeated({loop, loop, Turned(loop), loop}, kGate), wanted);
  EXPECT_TRUE(FindRepeated({}, kGate).empty());
}

TEST(FindRepeated, OtherPosesAreOtherEvidence) {
  const Pose3d same = Planar(4.0, 1.0, 0.7);
  const std::vector<bool> none(3, false);
  EXPECT_EQ(
      FindRepeated(
          {MeasuredLoop(3, 90, same), MeasuredLoop(3, 91, same), MeasuredLoop(4, 90, same)}, kGate),
      none);
}

// One of them may be right.
TEST(FindRepeated, WhatContradictsIsNotTheSame) {
  const RelativePose one = MeasuredLoop(3, 90, Planar(4.0, 1.0, 0.7));
  const RelativePose other = MeasuredLoop(3, 90, Planar(4.5, 1.0, 0.7));
  const RelativePose turned = MeasuredLoop(3, 90, Planar(4.0, 1.0, 0.9));
  const std::vector<bool> wanted = {false, false, false, true, true, true};
  EXPECT_EQ(FindRepeated({one, other, turned, other, Turned(turned), one}, kGate), wanted);
}

// As when a matcher is run again on the same two pictures.
TEST(FindRepeated, MeasurementsWithinTheirNoiseAreTheSame) {
  Random random(4, 0);
  std::vector<RelativePose> loops;
  for (int i = 0; i < 400; ++i) {
    const Pose3d noise{
        {0.02 * random.Normal(), 0.02 * random.Normal(), 0.02 * random.Normal()},
        Eigen::Quaterniond(Eigen::AngleAxisd(0.0088 * random.Normal(), Eigen::Vector3d::UnitZ()))};
    loops.push_back(MeasuredLoop(3, 90, Planar(4.0, 1.0, 0.7) * noise));
    if (i % 2 == 1) loops.back() = Turned(loops.back());
  }
  const std::vector<bool> is_repeated = FindRepeated(loops, kGate);
  EXPECT_GE(std::count(is_repeated.begin(), is_repeated.end(), true), 390);
}

TEST(FindRepeated, EndsSoonWhereEverythingContradicts) {
  std::vector<RelativePose> loops;
  for (int i = 0; i < 2000; ++i) loops.push_back(MeasuredLoop(3, 90, Planar(i, 0.0, 0.0)));
  for (const bool is_one : FindRepeated(loops, kGate)) EXPECT_FALSE(is_one);
}

}  // namespace
}  // namespace dsg::ingest
