// SPDX-License-Identifier: Apache-2.0
// What was believed when: versions of a node, readable revisions, revisions by the time of their
// commit; and the words of a revision.
#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

using query::CallContext;

class Belief : public testing::Test {
 protected:
  Belief() {
    MakeOffice(folder_.path());
    for (const char* name : {"mug", "glass", "bowl"}) {
      GraphDelta delta;
      delta.nodes = {Cup(name)};
      CommitToOffice(folder_.path(), std::move(delta));
    }
    core_ = OpenCore(folder_.path());
    request_.set_map(kMap);
    request_.set_id("O1");
  }

  static Node Cup(const std::string& name) {
    Node cup = OfficeDelta().nodes[6];
    cup.name = name;
    return cup;
  }

  absl::StatusOr<v1::ListNodeVersionsResponse> List() {
    v1::ListNodeVersionsResponse reply;
    const absl::Status status = core_->ListNodeVersions(CallContext(), request_, &reply);
    if (!status.ok()) return status;
    return reply;
  }

  static std::vector<std::string> NamesOf(const v1::ListNodeVersionsResponse& reply) {
    std::vector<std::string> names;
    for (const v1::NodeVersion& version : reply.versions()) names.push_back(version.node().name());
    return names;
  }

  TempFolder folder_;
  std::unique_ptr<query::ServiceCore> core_;
  v1::ListNodeVersionsRequest request_;
};

TEST_F(Belief, OfANodeIsListedNewestFirst) {
  const auto reply = List();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(NamesOf(*reply), (std::vector<std::string>{"bowl", "glass", "mug", "cup"}));
  EXPECT_EQ(reply->versions(0).from_revision(), 4);
  EXPECT_FALSE(reply->versions(0).has_to_revision());
  EXPECT_EQ(reply->versions(1).from_revision(), 3);
  EXPECT_EQ(reply->versions(1).to_revision(), 4);
}

TEST_F(Belief, OfANodeComesInPages) {
  request_.set_page_size(3);
  auto reply = List();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(NamesOf(*reply), (std::vector<std::string>{"bowl", "glass", "mug"}));
  request_.set_page_token(reply->next_page_token());
  reply = List();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(NamesOf(*reply), (std::vector<std::string>{"cup"}));
  EXPECT_EQ(reply->next_page_token(), "");
}

TEST_F(Belief, OfANodeIsThatOfReadableRevisions) {
  v1::SetTagRequest tag;
  tag.set_map(kMap);
  tag.set_name("first");
  tag.set_revision(1);
  v1::SetTagResponse tagged;
  ASSERT_TRUE(core_->SetTag(CallContext(), tag, &tagged).ok());
  v1::CompactRequest compact;
  compact.set_map(kMap);
  ASSERT_TRUE(
      query::ReadStream(CallContext(), core_->Compact(CallContext(), compact), [](const auto&) {
        return true;
      }).ok());
  const auto reply = List();
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(NamesOf(*reply), (std::vector<std::string>{"bowl", "cup"}));
  v1::GetMapStatsRequest ask;
  ask.set_map(kMap);
  v1::GetMapStatsResponse stats;
  ASSERT_TRUE(core_->GetMapStats(CallContext(), ask, &stats).ok());
  ASSERT_EQ(stats.readable_revisions_size(), 2);
  EXPECT_EQ(stats.readable_revisions(0).first(), 1);
  EXPECT_EQ(stats.readable_revisions(0).last(), 1);
  EXPECT_EQ(stats.readable_revisions(1).first(), 4);
  EXPECT_EQ(stats.readable_revisions(1).last(), 4);
}

TEST_F(Belief, OfAnUnknownNodeIsAnError) {
  request_.set_id("O99");
  EXPECT_EQ(ReasonOf(List().status()), Reason::kNodeUnknown);
  request_.set_id("the cup");
  EXPECT_FALSE(List().ok());
}

TEST_F(Belief, IsReadByTheTimeOfItsCommit) {
  v1::ListRevisionsRequest list;
  list.set_map(kMap);
  v1::ListRevisionsResponse revisions;
  ASSERT_TRUE(core_->ListRevisions(CallContext(), list, &revisions).ok());
  v1::GetNodeRequest ask;
  ask.set_map(kMap);
  ask.set_id("O1");
  v1::GetNodeResponse reply;
  // Newest first: the third is revision 2.
  ask.mutable_read_at()->set_committed_at_ns(revisions.revisions(2).committed_ns());
  ASSERT_TRUE(core_->GetNode(CallContext(), ask, &reply).ok());
  EXPECT_EQ(reply.node().name(), "mug");
  ask.mutable_read_at()->set_committed_at_ns(revisions.revisions(3).committed_ns() - 1);
  const absl::Status before = core_->GetNode(CallContext(), ask, &reply);
  EXPECT_EQ(ReasonOf(before), Reason::kRevisionCompacted) << before;
}

TEST_F(Belief, IsSampledAtEvenSteps) {
  for (int i = 0; i < 17; ++i) {
    GraphDelta delta;
    delta.nodes = {Cup(absl::StrCat("cup ", i))};
    CommitToOffice(folder_.path(), std::move(delta));
  }
  v1::ListRevisionsRequest list;
  list.set_map(kMap);
  list.set_page_size(5);
  list.set_sampled(true);
  v1::ListRevisionsResponse reply;
  ASSERT_TRUE(core_->ListRevisions(CallContext(), list, &reply).ok());
  std::vector<int64_t> numbers;
  for (const v1::Revision& one : reply.revisions()) numbers.push_back(one.revision());
  EXPECT_EQ(numbers, (std::vector<int64_t>{21, 16, 11, 6, 1}));
  list.set_page_size(1);
  reply.Clear();
  ASSERT_TRUE(core_->ListRevisions(CallContext(), list, &reply).ok());
  ASSERT_EQ(reply.revisions_size(), 1);
  EXPECT_EQ(reply.revisions(0).revision(), 21);
}

TEST_F(Belief, DiffersByIdsAlone) {
  v1::DiffRevisionsRequest ask;
  ask.set_map(kMap);
  ask.set_from_revision(0);
  ask.set_to_revision(1);
  ask.set_view(v1::NODE_VIEW_ID);
  v1::DiffRevisionsResponse reply;
  ASSERT_TRUE(core_->DiffRevisions(CallContext(), ask, &reply).ok());
  ASSERT_EQ(reply.nodes_size(), 11);
  v1::Node bare;
  bare.set_id(reply.nodes(0).after().id());
  EXPECT_EQ(reply.nodes(0).after().SerializeAsString(), bare.SerializeAsString());
  EXPECT_EQ(reply.edges(0).after().weight(), 0.0);
  EXPECT_NE(reply.edges(0).after().source(), "");
}

TEST_F(Belief, HasWords) {
  v1::ListVocabularyRequest ask;
  ask.set_map(kMap);
  ask.set_page_size(2);
  std::map<std::string, int64_t> words;
  do {
    v1::ListVocabularyResponse reply;
    ASSERT_TRUE(core_->ListVocabulary(CallContext(), ask, &reply).ok());
    for (const v1::Word& word : reply.words()) {
      EXPECT_TRUE(words
                      .emplace(absl::StrCat(v1::WordType_Name(word.type()), " ", word.layer(), " ",
                                            word.text()),
                               word.count())
                      .second);
    }
    ask.set_page_token(reply.next_page_token());
  } while (!ask.page_token().empty());
  EXPECT_EQ(words.at("WORD_TYPE_KIND agents human"), 2);
  EXPECT_EQ(words.at("WORD_TYPE_KIND places place"), 3);
  EXPECT_EQ(words.at("WORD_TYPE_RELATION  CONTAINS"), 7);
  EXPECT_EQ(words.at("WORD_TYPE_RELATION  TRAVERSABLE"), 2);
  EXPECT_EQ(words.size(), 8u);
}

}  // namespace
}  // namespace dsg::test
