// SPDX-License-Identifier: Apache-2.0
// The difference of two revisions, applied to what the one held, gives what the other held.
#include <gtest/gtest.h>

#include <map>
#include <tuple>

#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/service/service_core.h"
#include "schema/store/graph_store.h"
#include "tests/support/random_world.h"
#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

using test::NaiveMap;
using test::RandomWorld;

constexpr Revision kDiffRevisionCount = 30;
constexpr char kMap[] = "world";

/// What a map holds at a revision, as text.
struct Content {
  std::map<std::string, std::string> nodes;
  std::map<std::tuple<std::string, std::string, std::string>, std::string> edges;
  /// Number of poses and time of the last.
  std::map<std::string, std::pair<int64_t, TimeNs>> tracks;
  bool operator==(const Content&) const = default;
};

// The revision that wrote a thing is not what it says.
template <typename Message>
std::string Text(Message message) {
  message.clear_revision();
  return message.SerializeAsString();
}

std::tuple<std::string, std::string, std::string> KeyOf(const v1::Edge& edge) {
  return {edge.source(), edge.relation(), edge.target()};
}

template <typename Map, typename Key, typename Message>
void Apply(v1::ChangeType type, const Key& key, const Message& before, const Message& after,
           Map* content) {
  const auto found = content->find(key);
  ASSERT_EQ(found != content->end(), type != v1::ADDED);
  if (type != v1::ADDED) {
    EXPECT_EQ(found->second, Text(before));
  }
  if (type == v1::CHANGED) {
    EXPECT_NE(Text(before), Text(after));
  }
  if (type == v1::REMOVED) {
    content->erase(found);
  } else {
    (*content)[key] = Text(after);
  }
}

class DiffModelTest : public testing::Test {
 protected:
  void SetUp() override {
    auto store = GraphStore::Open(folder_.path(), {});
    ASSERT_TRUE(store.ok()) << store.status();
    MapSpec spec;
    spec.name = kMap;
    ASSERT_TRUE((*store)->CreateMap(spec).ok());
    RandomWorld world(test::TestSeed(41));
    auto writer = (*store)->OpenWriter(kMap);
    ASSERT_TRUE(writer.ok()) << writer.status();
    NaiveMap naive;
    for (Revision r = 1; r <= kDiffRevisionCount; ++r) {
      const GraphDelta delta = r == 1 ? world.First() : world.Next(naive);
      ASSERT_TRUE((*writer)->Commit(delta).ok());
      naive.Apply(delta);
    }
    auto map = (*store)->OpenMap(kMap);
    ASSERT_TRUE(map.ok()) << map.status();
    map_ = *map;
    core_ = query::MakeServiceCore(*std::move(store));
    for (Revision r = 0; r <= kDiffRevisionCount; ++r) contents_.push_back(Read(r));
  }

  Content Read(Revision revision) {
    Content content;
    v1::ListNodesRequest nodes;
    nodes.set_map(kMap);
    nodes.set_page_size(1000);
    nodes.mutable_read_at()->set_exact_revision(revision);
    v1::ListNodesResponse node_page;
    EXPECT_TRUE(core_->ListNodes(call_, nodes, &node_page).ok());
    EXPECT_EQ(node_page.next_page_token(), "");
    for (const v1::Node& node : node_page.nodes()) content.nodes[node.id()] = Text(node);
    v1::ListEdgesRequest edges;
    edges.set_map(kMap);
    edges.set_page_size(1000);
    *edges.mutable_read_at() = nodes.read_at();
    v1::ListEdgesResponse edge_page;
    EXPECT_TRUE(core_->ListEdges(call_, edges, &edge_page).ok());
    EXPECT_EQ(edge_page.next_page_token(), "");
    for (const v1::Edge& edge : edge_page.edges()) content.edges[KeyOf(edge)] = Text(edge);
    const auto tracks = (*map_->At(revision))->Tracks();
    EXPECT_TRUE(tracks.ok()) << tracks.status();
    if (!tracks.ok()) return content;
    for (const TrackInfo& track : *tracks) {
      if (track.pose_count == 0) continue;
      content.tracks[ToString(track.agent)] = {track.pose_count, track.last_ns};
    }
    return content;
  }

  // All pages as one answer.
  v1::DiffRevisionsResponse Diff(Revision from, Revision to, int page_size) {
    v1::DiffRevisionsRequest request;
    request.set_map(kMap);
    request.set_from_revision(from);
    request.set_to_revision(to);
    request.set_page_size(page_size);
    v1::DiffRevisionsResponse all;
    do {
      v1::DiffRevisionsResponse page;
      const absl::Status status = core_->DiffRevisions(call_, request, &page);
      EXPECT_TRUE(status.ok()) << status;
      EXPECT_EQ(page.from_revision(), from);
      EXPECT_EQ(page.to_revision(), to);
      EXPECT_EQ(page.header().read_revision(), std::max(from, to));
      EXPECT_LE(page.nodes_size() + page.edges_size() + page.tracks_size(), page_size);
      request.set_page_token(page.next_page_token());
      page.clear_next_page_token();
      page.clear_header();
      all.clear_from_revision();
      all.clear_to_revision();
      all.MergeFrom(page);
    } while (!request.page_token().empty());
    return all;
  }

  void Apply(const v1::DiffRevisionsResponse& diff, Content* content) {
    for (const v1::NodeChange& change : diff.nodes()) {
      const std::string& id = change.has_after() ? change.after().id() : change.before().id();
      dsg::Apply(change.type(), id, change.before(), change.after(), &content->nodes);
    }
    for (const v1::EdgeChange& change : diff.edges()) {
      const auto key = KeyOf(change.has_after() ? change.after() : change.before());
      dsg::Apply(change.type(), key, change.before(), change.after(), &content->edges);
    }
    for (const v1::TrackChange& change : diff.tracks()) {
      auto& track = content->tracks[change.agent_id()];
      EXPECT_EQ(track.first, change.pose_count_before());
      EXPECT_EQ(track.second, change.last_pose_ns_before());
      track = {change.pose_count_after(), change.last_pose_ns_after()};
      if (track.first == 0) content->tracks.erase(change.agent_id());
    }
  }

  test::TempFolder folder_;
  std::shared_ptr<MapReader> map_;
  std::unique_ptr<query::ServiceCore> core_;
  query::CallContext call_;
  std::vector<Content> contents_;
};

TEST_F(DiffModelTest, LeadsFromAnyRevisionToAnyOther) {
  for (Revision from = 0; from <= kDiffRevisionCount && !HasFailure(); ++from) {
    // 0 would stand for the newest.
    for (Revision to = 1; to <= kDiffRevisionCount && !HasFailure(); ++to) {
      SCOPED_TRACE(std::to_string(from) + " to " + std::to_string(to));
      Content content = contents_[static_cast<size_t>(from)];
      Apply(Diff(from, to, 1000), &content);
      EXPECT_EQ(content, contents_[static_cast<size_t>(to)]);
    }
  }
}

TEST_F(DiffModelTest, IsTheSameInPagesOfAnySize) {
  for (const auto& [from, to] : {std::pair<Revision, Revision>{0, kDiffRevisionCount}, {20, 9}}) {
    const std::string whole = Diff(from, to, 1000).SerializeAsString();
    for (const int size : {1, 2, 7, 64}) {
      EXPECT_EQ(Diff(from, to, size).SerializeAsString(), whole) << "pages of " << size;
    }
  }
}

}  // namespace
}  // namespace dsg
