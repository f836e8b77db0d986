// SPDX-License-Identifier: Apache-2.0
// MergeMaps of the service, and the verb that asks for it.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/cli/verb_merge.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/query/maintenance/two_halves.h"
#include "tests/unit/schema/merge/perceived_half.h"

namespace dsg::query {
namespace {

using test::TwoHalves;
using test::WestWithEast;

TEST(MergeMaps, FindsTheTransformAndTellsWhatBecameOfEachNode) {
  TwoHalves halves;
  const auto messages = halves.Merge(WestWithEast());
  ASSERT_TRUE(messages.ok()) << messages.status();
  const v1::MergeMapsResponse& last = messages->back();
  EXPECT_TRUE(last.done());
  EXPECT_GT(last.revision(), 1);
  EXPECT_EQ(last.progress(), 1.0);
  const Pose3d found = FromProto(last.map_t_other());
  const Eigen::Vector3d middle = halves.truth().Inverse() * Eigen::Vector3d(20, 7, 0);
  EXPECT_LT((found * middle - halves.truth() * middle).norm(), 0.1);
  EXPECT_GT(last.fused_object_count(), 10);
  EXPECT_GT(last.fused_room_count(), 3);
  int id_count = 0;
  double progress = 0.0;
  for (const auto& message : *messages) {
    id_count += static_cast<int>(message.node_ids().size());
    EXPECT_GE(message.progress(), progress);
    progress = message.progress();
  }
  EXPECT_EQ(id_count, last.added_node_count() + last.fused_object_count() +
                          last.fused_place_count() + last.fused_room_count() +
                          last.fused_structure_count() + 1);
}

TEST(MergeMaps, OnADryRunWritesNothing) {
  TwoHalves halves;
  v1::MergeMapsRequest request = WestWithEast();
  request.set_dry_run(true);
  const auto messages = halves.Merge(request);
  ASSERT_TRUE(messages.ok()) << messages.status();
  EXPECT_EQ(messages->back().revision(), 0);
  EXPECT_GT(messages->back().node_ids().size(), 0u);
  const auto store = *GraphStore::Open(halves.folder(), {});
  EXPECT_EQ(test::Newest(store.get(), "west")->revision(), 1);
}

TEST(MergeMaps, AgainSaysThatNothingIsNew) {
  TwoHalves halves;
  ASSERT_TRUE(halves.Merge(WestWithEast()).ok());
  const auto again = halves.Merge(WestWithEast());
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->back().revision(), 0);
  EXPECT_EQ(again->back().added_node_count(), 0);
}

TEST(MergeMaps, RefusesBadRequests) {
  TwoHalves halves;
  v1::MergeMapsRequest request = WestWithEast();
  request.set_other("west");
  EXPECT_EQ(ReasonOf(halves.Merge(request).status()), Reason::kFieldInvalid);
  request.set_other("nowhere");
  EXPECT_EQ(ReasonOf(halves.Merge(request).status()), Reason::kMapUnknown);
  request = WestWithEast();
  request.mutable_map_t_other()->mutable_orientation()->set_x(1.0);
  EXPECT_EQ(ReasonOf(halves.Merge(request).status()), Reason::kFieldInvalid);
}

TEST(MergeVerb, TellsInATableAndDrawsBoth) {
  TwoHalves halves;
  std::string out;
  std::string errors;
  const std::string png = halves.folder() + "/both.png";
  EXPECT_EQ(
      halves.Run({"merge", "--map", "west", "east", "--dry-run", "--png", png}, &out, &errors), 0)
      << errors;
  EXPECT_NE(out.find("nodes of east"), std::string::npos) << out;
  EXPECT_NE(out.find("objects in both"), std::string::npos) << out;
  EXPECT_NE(out.find("nothing was written"), std::string::npos) << out;
  EXPECT_GT(std::filesystem::file_size(png), 1000u);
  EXPECT_EQ(halves.Run({"merge", "--map", "west", "east"}, &out, &errors), 0) << errors;
  EXPECT_NE(out.find("\nrevision "), std::string::npos) << out;
}

TEST(MergeVerb, WarnsWhenNothingAgreesWithTheTransform) {
  TwoHalves halves;
  std::string out;
  std::string errors;
  EXPECT_EQ(halves.Run({"merge", "--map", "west", "east", "--dry-run", "--transform", "500,0,0,0"},
                       &out, &errors),
            0)
      << errors;
  EXPECT_NE(out.find("things agreeing  0\n"), std::string::npos) << out;
  EXPECT_NE(out.find("they differ by   -\n"), std::string::npos) << out;
  EXPECT_NE(out.find("warning: nothing in east agrees with west"), std::string::npos) << out;
  EXPECT_NE(out.find("--transform X,Y,Z,YAW"), std::string::npos) << out;
  EXPECT_EQ(halves.Run({"merge", "--map", "west", "east"}, &out, &errors), 0) << errors;
  EXPECT_EQ(out.find("warning"), std::string::npos) << out;
  EXPECT_EQ(halves.Run({"merge", "--map", "west", "east"}, &out, &errors), 0) << errors;
  EXPECT_EQ(out.find("warning"), std::string::npos) << out;
  EXPECT_EQ(halves.Run({"log", "--map", "west"}, &out, &errors), 0) << errors;
  EXPECT_NE(out.find("merge of east revision 1, part 1 at "), std::string::npos) << out;
}

TEST(MergeVerb, WritesNothingWithoutAWordWhenLittleSpeaksForTheTransform) {
  TwoHalves halves;
  std::string out;
  std::string errors;
  // A few metres beside the truth: here and there two chairs meet.
  const Pose3d& truth = halves.truth();
  const Eigen::Vector3d x = truth.orientation * Eigen::Vector3d::UnitX();
  const std::string beside = absl::StrCat(truth.position.x() + 5.0, ",", truth.position.y() + 5.0,
                                          ",", truth.position.z(), ",", std::atan2(x.y(), x.x()));
  const std::vector<std::string> merge = {"merge", "--map", "west", "east", "--transform", beside};
  EXPECT_NE(halves.Run(merge, &out, &errors), 0);
  EXPECT_NE(errors.find("refused without --yes"), std::string::npos) << errors;
  EXPECT_EQ(out, "");
  EXPECT_EQ(test::Newest(GraphStore::Open(halves.folder(), {})->get(), "west")->revision(), 1);
  std::vector<std::string> meant = merge;
  meant.push_back("--yes");
  EXPECT_EQ(halves.Run(meant, &out, &errors), 0) << errors;
  EXPECT_NE(errors.find("warning: "), std::string::npos) << errors;
  EXPECT_NE(out.find("\nrevision "), std::string::npos) << out;
}

TEST(MergeVerb, MeasuresWhatAgreesAgainstWhatIsMissing) {
  v1::MergeMapsResponse reply;
  reply.set_agreeing_count(20);
  reply.set_added_node_count(9);
  reply.set_missing_count(100);
  const cli::MergeAsked asked{.map = "a", .other = "b", .has_transform = true};
  EXPECT_EQ(cli::DoubtsOf(reply, asked), "");
  reply.set_missing_count(200);
  EXPECT_NE(cli::DoubtsOf(reply, asked).find("20 things of both maps agree, and 200 are missing"),
            std::string::npos);
  reply.set_missing_count(0);
  reply.set_blocked_share(0.3);
  EXPECT_NE(cli::DoubtsOf(reply, asked).find("30 % stand in them"), std::string::npos);
  // Nothing new, so nothing is there twice afterwards.
  reply.set_added_node_count(0);
  EXPECT_EQ(cli::DoubtsOf(reply, asked), "");
}

TEST(MergeVerb, WarnsWhenAnEstimateRestsOnFewThings) {
  v1::MergeMapsResponse reply;
  reply.set_agreeing_count(4);
  reply.set_fused_object_count(4);
  reply.set_added_node_count(9);
  cli::MergeAsked asked{.map = "a", .other = "b", .is_dry_run = true};
  EXPECT_NE(cli::RenderMerge(reply, asked).find("warning: the transform rests on 4 things only"),
            std::string::npos);
  asked.has_transform = true;
  EXPECT_EQ(cli::RenderMerge(reply, asked).find("warning"), std::string::npos);
  asked.has_transform = false;
  reply.set_agreeing_count(8);
  EXPECT_EQ(cli::RenderMerge(reply, asked).find("warning"), std::string::npos);
}

TEST(MergeVerb, TakesATransformOfFourOrSevenNumbersAndNoOther) {
  TwoHalves halves;
  std::string out;
  std::string errors;
  for (const char* text : {"1,2,0,1.5", "1,2,0,0,0,0,1"}) {
    EXPECT_EQ(halves.Run({"merge", "--map", "west", "east", "--dry-run", "--transform", text}, &out,
                         &errors),
              0)
        << errors;
    EXPECT_NE(out.find("1.000,2.000,0.000"), std::string::npos) << out;
  }
  for (const char* text : {"1,2", "1,2,3,nan", "1,2,3,x", "1,2,3,0,0,0,0", "1,2,3,4,5"}) {
    EXPECT_EQ(halves.Run({"merge", "--map", "west", "east", "--transform", text}, &out, &errors), 2)
        << text;
    EXPECT_NE(errors.find("--transform"), std::string::npos) << errors;
  }
}

TEST(MergeVerb, RefusesAMapWithItself) {
  TwoHalves halves;
  std::string out;
  std::string errors;
  EXPECT_EQ(halves.Run({"merge", "--map", "west", "west"}, &out, &errors), 2);
  EXPECT_NE(errors.find("itself"), std::string::npos) << errors;
}

}  // namespace
}  // namespace dsg::query
