// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/undone_session.h"

#include <gtest/gtest.h>

#include <map>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

// What a session has committed, and whether it was undone, is told by the sessions of the
// revisions alone: the deltas here are as small as can be.
class UndoneSessionTest : public testing::Test {
 protected:
  UndoneSessionTest() {
    store_ = *GraphStore::Open(folder_.Path("store"), {.create = true});
    MapSpec spec;
    spec.name = "test";
    EXPECT_TRUE(store_->CreateMap(spec).ok());
    writer_ = *store_->OpenWriter("test");
    reader_ = *store_->OpenMap("test");
  }

  void Commit(const std::string& session) {
    GraphDelta delta;
    delta.map = "test";
    delta.session_id = session;
    delta.sequence = ++sequences_[session];
    delta.author = "ann";
    const int32_t label = ++label_count_;
    delta.labels = {{label, absl::StrCat("label ", label)}};
    const auto result = writer_->Commit(std::move(delta));
    ASSERT_TRUE(result.ok()) << result.status();
  }
  void Revert(Revision to) { Commit(absl::StrCat(RevertSessionName(to), "-", ++revert_count_)); }

  absl::StatusOr<OpenedSession> Open(const UndoneOptions& options) {
    const auto view = MakeSnapshotMapView(*reader_->Latest(), reader_);
    return OpenSession("log", "a.csv", *view, *writer_, options);
  }
  std::string SessionOf(const UndoneOptions& options) {
    const auto opened = Open(options);
    return opened.ok() ? opened->session_id : std::string(opened.status().message());
  }

  TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<MapWriter> writer_;
  std::shared_ptr<MapReader> reader_;
  std::map<std::string, int64_t> sequences_;
  int32_t label_count_ = 0;
  int revert_count_ = 0;
};

TEST_F(UndoneSessionTest, GoesOnWhereItStopped) {
  EXPECT_EQ(SessionOf({}), "log");
  Commit("other");
  Commit("log");
  Revert(2);
  const auto opened = Open({});
  ASSERT_TRUE(opened.ok()) << opened.status();
  EXPECT_EQ(opened->session_id, "log");
  EXPECT_EQ(opened->state.last_sequence, 1);
}

TEST_F(UndoneSessionTest, IsToldAgainOnlyOnDemand) {
  Commit("other");
  Commit("log");
  Revert(1);
  EXPECT_EQ(Open({}).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(SessionOf({.is_told_again = true}), "log-after-3");
  Commit("log-after-3");
  EXPECT_EQ(SessionOf({}), "log-after-3");
  // Undone once more, and that undone.
  Revert(3);
  EXPECT_EQ(Open({}).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(SessionOf({.is_told_again = true}), "log-after-3-after-5");
  Revert(4);
  EXPECT_EQ(SessionOf({}), "log-after-3");
  // The first revert undone: all of the log is there, what was told again is not.
  Revert(2);
  EXPECT_EQ(SessionOf({}), "log");
}

TEST_F(UndoneSessionTest, WithIdsOfItsOwnOnlyIfNothingIsLeft) {
  Commit("other");
  Commit("log");
  Commit("log");
  Revert(2);
  const UndoneOptions own{.is_told_again = true, .has_own_ids = true};
  EXPECT_NE(SessionOf(own).find("go back with \"dsg revert 1\""), std::string::npos)
      << SessionOf(own);
  EXPECT_EQ(SessionOf({.is_told_again = true}), "log-after-4");
  Revert(1);
  EXPECT_EQ(SessionOf(own), "log-after-5");
}

TEST_F(UndoneSessionTest, TheEndOfALogBelongsToIt) {
  Commit("log");
  Commit(EndSessionId("log"));
  Revert(1);
  EXPECT_EQ(Open({}).status().code(), absl::StatusCode::kAborted);
}

TEST_F(UndoneSessionTest, IsFoundBehindThousandsOfRevisions) {
  Commit("log");
  Revert(0);
  for (int i = 0; i < 1'010; ++i) Commit("other");
  EXPECT_EQ(Open({}).status().code(), absl::StatusCode::kAborted);
}

}  // namespace
}  // namespace dsg::ingest
