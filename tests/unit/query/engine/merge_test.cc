// SPDX-License-Identifier: Apache-2.0
// MergeMaps of the service, and the verb that asks for it.
#include "query/engine/merge.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "dsg/v1/maintenance_service.pb.h"
#include "query/cli/run.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/schema/merge/perceived_half.h"

namespace dsg::query {
namespace {

// Maps "west" and "east" of an apartment, seen with noise in frames of their own.
class TwoHalves {
 public:
  TwoHalves() {
    const simulator::World world = test::MakeWorld(simulator::WorldKind::kWing, 1);
    auto store = *GraphStore::Open(folder_.path(), {});
    test::PerceiveOptions west;
    west.to = 0.65;
    west.seed = 5;
    test::StoreMap(store.get(), "west", test::Perceive(world, west).delta);
    test::PerceiveOptions east;
    east.from = 0.3;
    east.seed = 6;
    east.map_T_world = test::SomeTransform(6);
    truth_ = east.map_T_world.Inverse();
    test::StoreMap(store.get(), "east", test::Perceive(world, east).delta);
  }

  const std::string& folder() const { return folder_.path(); }
  const Pose3d& truth() const { return truth_; }

  absl::StatusOr<std::vector<v1::MergeMapsResponse>> Merge(const v1::MergeMapsRequest& request) {
    const auto core = test::OpenCore(folder());
    std::vector<v1::MergeMapsResponse> messages;
    DSG_RETURN_IF_ERROR(
        core->MergeMaps(CallContext(), request, [&](const v1::MergeMapsResponse& message) {
          messages.push_back(message);
          return true;
        }));
    return messages;
  }

  int Run(std::vector<std::string> arguments, std::string* out, std::string* errors) {
    arguments.insert(arguments.begin() + 1, {"--store", folder()});
    std::ostringstream text;
    std::ostringstream problems;
    const int code = cli::Run(arguments, {}, text, problems);
    *out = text.str();
    *errors = problems.str();
    return code;
  }

 private:
  test::TempFolder folder_;
  Pose3d truth_;
};

v1::MergeMapsRequest WestWithEast() {
  v1::MergeMapsRequest request;
  request.set_map("west");
  request.set_other("east");
  return request;
}

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
  EXPECT_NE(out.find("objects in both"), std::string::npos) << out;
  EXPECT_NE(out.find("nothing was written"), std::string::npos) << out;
  EXPECT_GT(std::filesystem::file_size(png), 1000u);
  EXPECT_EQ(halves.Run({"merge", "--map", "west", "east"}, &out, &errors), 0) << errors;
  EXPECT_NE(out.find("\nrevision "), std::string::npos) << out;
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
  for (const char* text : {"1,2", "1,2,3,nan", "1,2,3,x", "1,2,3,0,0,0,0"}) {
    EXPECT_EQ(halves.Run({"merge", "--map", "west", "east", "--transform", text}, &out, &errors), 2)
        << text;
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
