// SPDX-License-Identifier: Apache-2.0
// The grammar of the verbs that ask about meetings, search, ways, obstacles, the future and change.
#include <gtest/gtest.h>

#include <any>
#include <string>

#include "query/cli/arguments.h"
#include "query/cli/verb_predict.h"
#include "query/cli/verbs_agents.h"
#include "query/cli/verbs_changes.h"
#include "query/cli/verbs_meetings.h"
#include "query/cli/verbs_search.h"
#include "query/cli/verbs_space.h"
#include "tests/unit/query/cli/cli_test_util.h"

namespace dsg::cli {
namespace {

using test::Arguments;
using test::ParseAs;
using test::Refusal;

TEST(MetArguments, NeedNobodyOneOrTwo) {
  EXPECT_EQ(ParseAs<MetVerb>({"met"}).agent, "");
  EXPECT_EQ(ParseAs<MetVerb>({"met", "alice"}).agent, "alice");
  const MetVerb verb = ParseAs<MetVerb>({"met", "alice", "bob", "--from", "-1s", "--to", "+9s",
                                         "--within", "1.5", "--for", "2s", "--line-of-sight"});
  EXPECT_EQ(verb.other_agent, "bob");
  EXPECT_EQ(verb.from, "-1s");
  EXPECT_EQ(verb.within_m, 1.5);
  EXPECT_EQ(verb.for_at_least, "2s");
  EXPECT_TRUE(verb.line_of_sight);
  Refusal({"met", "a", "b", "c"});
  Refusal({"met", "--within", "0"});
  EXPECT_EQ(ParseAs<MetVerb>({"met", "--line-of-sight", "--sight-gap", "5s"}).sight_gap, "5s");
  Refusal({"met", "--sight-gap", "5s"});
}

TEST(PickedArguments, MayNameObjectClassAndRoom) {
  const PickedVerb verb =
      ParseAs<PickedVerb>({"picked", "carol", "--object", "O7", "--class", "cup", "--room",
                           "kitchen", "--all", "--why", "--placed"});
  EXPECT_EQ(verb.agent, "carol");
  EXPECT_EQ(verb.object, "O7");
  EXPECT_EQ(verb.class_name, "cup");
  EXPECT_EQ(verb.room, "kitchen");
  EXPECT_TRUE(verb.all && verb.why && verb.placed);
}

TEST(FindArguments, TakeAQueryInOneWordOrMany) {
  EXPECT_EQ(ParseAs<FindVerb>({"find", "cup on table"}).words, (Arguments{"cup on table"}));
  const FindVerb verb = ParseAs<FindVerb>(
      {"find", "cup", "in", "kitchen", "--near", "-1,2,0", "--explain", "--max-distance", "3"});
  EXPECT_EQ(verb.words, (Arguments{"cup", "in", "kitchen"}));
  EXPECT_EQ(verb.near, "-1,2,0");
  EXPECT_TRUE(verb.explain);
  Refusal({"find"});
  // A distance from nowhere.
  Refusal({"find", "cup", "--max-distance", "3"});
}

TEST(FindArguments, CountStandsAlone) {
  EXPECT_TRUE(ParseAs<FindVerb>({"find", "cup", "--count", "--explain"}).count);
  EXPECT_FALSE(ParseAs<FindVerb>({"find", "cup"}).count);
  // Nothing to list, nothing to draw.
  Refusal({"find", "cup", "--count", "-k", "3"});
  Refusal({"find", "cup", "--count", "--png", "x.png"});
}

TEST(FindArguments, KIsALimit) {
  const auto command = ParseArguments({"find", "cup", "-k", "3"}, {.store = "s"});
  ASSERT_TRUE(command.ok()) << command.status();
  EXPECT_EQ(command->common.limit, 3);
  Refusal({"find", "cup", "-k", "-1"});
  Refusal({"find", "cup", "-k", "0"});
}

TEST(PathArguments, AvoidTakesOneNodeEachTime) {
  const PathVerb verb = ParseAs<PathVerb>(
      {"path", "--avoid", "R3", "-1,2,0", "nearest couch", "--avoid", "p7", "--radius", "0.3"});
  EXPECT_EQ(verb.from, "-1,2,0");
  EXPECT_EQ(verb.to, "nearest couch");
  EXPECT_EQ(verb.blocked, (Arguments{"R3", "p7"}));
  EXPECT_EQ(verb.radius_m, 0.3);
  EXPECT_FALSE(verb.flat);
  Refusal({"path", "p1"});
  Refusal({"path", "p1", "p2", "--radius", "-0.3"});
}

TEST(CollideArguments, TakeOneBodyAndItsPoses) {
  const CollideVerb verb = ParseAs<CollideVerb>(
      {"collide", "--sphere", "0.3", "--pose", "-1,0,1", "1,0,1", "--pose", "2,0,1,0,0,0,1"});
  EXPECT_EQ(verb.sphere_radius_m, 0.3);
  EXPECT_EQ(verb.poses, (Arguments{"-1,0,1", "1,0,1", "2,0,1,0,0,0,1"}));
  EXPECT_NE(Refusal({"collide", "--pose", "0,0,0"}).find("one body"), std::string::npos);
  EXPECT_NE(
      Refusal({"collide", "--sphere", "1", "--box", "1,1,1", "--pose", "0,0,0"}).find("one body"),
      std::string::npos);
  Refusal({"collide", "--sphere", "0", "--pose", "0,0,0"});
  Refusal({"collide", "--sphere", "1"});
}

TEST(PredictArguments, KnowTheModels) {
  EXPECT_EQ(ParseAs<PredictVerb>({"predict", "bob", "--model", "cv"}).model, "cv");
  EXPECT_EQ(ParseAs<PredictVerb>({"predict", "bob", "--horizon", "8s"}).horizon, "8s");
  Refusal({"predict", "bob", "--model", "oracle"});
  Refusal({"predict", "bob", "--paths", "0"});
  Refusal({"predict"});
}

TEST(AroundArguments, RelationMayBeGivenAgain) {
  const AroundVerb verb =
      ParseAs<AroundVerb>({"around", "--relation", "ON", "--relation", "IN", "O7", "--in"});
  EXPECT_EQ(verb.relations, (Arguments{"ON", "IN"}));
  EXPECT_EQ(verb.id, "O7");
  EXPECT_TRUE(verb.incoming);
  EXPECT_FALSE(verb.outgoing);
  EXPECT_EQ(ParseAs<SubgraphVerb>({"subgraph", "R1", "--depth", "2"}).depth, 2);
}

TEST(DiffArguments, TheSecondRevisionIsTheNewestUnlessGiven) {
  EXPECT_FALSE(ParseAs<DiffVerb>({"diff", "3"}).to.is_set());
  EXPECT_EQ(ParseAs<DiffVerb>({"diff", "3", "7"}).to.number, 7);
  EXPECT_EQ(ParseAs<DiffVerb>({"diff", "0"}).from.number, 0);
  Refusal({"diff"});
  Refusal({"diff", "-1"});
}

TEST(WatchArguments, CountIsN) {
  EXPECT_EQ(ParseAs<WatchVerb>({"watch", "-n", "2", "--after", "0"}).count, 2);
  EXPECT_EQ(ParseAs<WatchVerb>({"watch", "--after", "0"}).after.number, 0);
  EXPECT_FALSE(ParseAs<WatchVerb>({"watch"}).after.is_set());
}

TEST(PictureArguments, BelongToAPicture) {
  EXPECT_EQ(
      ParseAs<TrackVerb>({"track", "H1", "--png", "t.png", "--width", "800"}).picture.width_px,
      800);
  Refusal({"track", "H1", "--width", "800"});
  Refusal({"path", "p1", "p2", "--force"});
  Refusal({"path", "p1", "p2", "--png", "p.png", "--width", "3"});
}

}  // namespace
}  // namespace dsg::cli
