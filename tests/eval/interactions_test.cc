// SPDX-License-Identifier: Apache-2.0
// Who took what, and who put it where, of simulated people whom cameras in each room watch all the
// time, or look at now and then, or a robot passes by. Seeds that no weight was fitted to.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/eval/pick_score.h"
#include "tests/eval/pick_worlds.h"

namespace dsg::eval {
namespace {

struct Figures {
  PickFigures picked;
  PickFigures placed;
};

Figures Score(Tier tier) {
  Figures figures;
  const auto worlds =
      ParsePickWorlds({"apartment:3:11:15", "apartment:6:11:15", "wing:8:11:15"}, tier);
  EXPECT_TRUE(worlds.ok()) << worlds.status();
  for (const PickWorldOptions& options : *worlds) {
    auto world = MakePickWorld(options);
    EXPECT_TRUE(world.ok()) << world.status();
    const auto score = ScorePicks(*std::move(world));
    EXPECT_TRUE(score.ok()) << score.status();
    figures.picked.Add(score->picked);
    figures.placed.Add(score->placed);
  }
  std::printf("taken:\n%sput:\n%s", figures.picked.Text().c_str(), figures.placed.Text().c_str());
  return figures;
}

TEST(Interactions, AreToldWhereEverythingIsSeen) {
  const Figures figures = Score(Tier::kCameras);
  EXPECT_GT(figures.picked.answerable_count, 50);
  EXPECT_GE(figures.picked.precision(), 0.9);
  EXPECT_GE(figures.picked.recall_of_answerable(), 0.75);
  EXPECT_LE(figures.picked.brier(), 0.15);
  EXPECT_GE(figures.placed.precision(), 0.9);
  EXPECT_GE(figures.placed.recall_of_answerable(), 0.6);
}

TEST(Interactions, AreToldFromGlances) {
  const Figures figures = Score(Tier::kGlances);
  EXPECT_GT(figures.picked.answerable_count, 50);
  EXPECT_GE(figures.picked.precision(), 0.9);
  EXPECT_GE(figures.picked.recall_of_answerable(), 0.6);
  EXPECT_LE(figures.picked.brier(), 0.15);
  EXPECT_GE(figures.placed.precision(), 0.9);
  EXPECT_GE(figures.placed.recall_of_answerable(), 0.6);
}

// Hardly anything is seen being taken, and the intervals are minutes long: few are named, and
// probabilities are rough.
TEST(Interactions, AreMostlyAbstainedFromAfterARobotPassedBy) {
  const Figures figures = Score(Tier::kRobot);
  EXPECT_GT(figures.picked.change_count, 20);
  EXPECT_LE(figures.picked.answer_count, figures.picked.change_count / 4);
  EXPECT_LE(figures.placed.answer_count, figures.placed.change_count / 4);
  EXPECT_LE(figures.picked.answer_count - figures.picked.right_count, 3);
  EXPECT_LE(figures.picked.brier(), 0.3);
  EXPECT_LE(figures.placed.brier(), 0.25);
}

}  // namespace
}  // namespace dsg::eval
