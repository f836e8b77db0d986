// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "query/engine/search/query_language.h"
#include "tests/unit/query/engine/search/furnished_map.h"

namespace dsg::test {
namespace {

using query::GraphView;
using query::HitKey;

std::shared_ptr<const GraphView> Load(const Snapshot& snapshot) {
  auto view = GraphView::Load(snapshot, std::make_shared<query::SymbolTable>(), {});
  EXPECT_TRUE(view.ok()) << view.status();
  return *view;
}

ScanQuestion RandomQuestion(Random* random) {
  ScanQuestion question;
  question.pattern = RandomPattern(random, 2);
  if (random->Chance(0.6)) question.at_ns = random->Integer(0, 110);
  if (random->Chance(0.4)) {
    question.near_map =
        Eigen::Vector3d(random->Integer(0, 9), random->Uniform(0, 9), random->Integer(0, 2));
    if (random->Chance(0.4)) question.distance_m_max = random->Integer(1, 6);
  }
  if (random->Chance(0.25)) {
    const Eigen::Vector3d low(random->Integer(0, 9), random->Integer(0, 9), 0);
    question.box_map = Box3d(low, low + Eigen::Vector3d::Constant(random->Integer(0, 5)));
  }
  return question;
}

query::SearchQuestion Ask(const ScanQuestion& question, const query::Pattern& pattern) {
  query::SearchQuestion asked;
  asked.pattern = pattern;
  asked.at_ns = question.at_ns;
  asked.near_map = question.near_map;
  if (question.distance_m_max > 0.0) asked.distance_m_max = question.distance_m_max;
  asked.box_map = question.box_map;
  asked.locate = [](NodeId) { return std::optional<LocatedPose>(); };
  return asked;
}

// All pages, one after the other.
std::vector<query::Hit> SearchAll(const GraphView& view, query::SearchQuestion question,
                                  int page_size) {
  std::vector<query::Hit> hits;
  question.limit = page_size;
  for (;;) {
    auto answer = query::RunSearch(view, question, {});
    EXPECT_TRUE(answer.ok()) << answer.status();
    if (!answer.ok()) return hits;
    EXPECT_LE(answer->hits.size(), static_cast<size_t>(page_size));
    hits.insert(hits.end(), answer->hits.begin(), answer->hits.end());
    if (!answer->has_more) return hits;
    question.after = answer->hits.back().key;
  }
}

std::vector<HitKey> KeysOf(const std::vector<query::Hit>& hits) {
  std::vector<HitKey> keys;
  for (const query::Hit& hit : hits) keys.push_back(hit.key);
  return keys;
}

std::string Describe(const ScanQuestion& question) {
  std::string text = FormatQuery(question.pattern);
  if (question.at_ns.has_value()) text += " at " + std::to_string(*question.at_ns);
  if (question.near_map.has_value()) text += " near a point";
  if (question.box_map.has_value()) text += " in a box";
  return text;
}

TEST(Search, FindsWhatAScanFindsAtEveryRevisionAndPageSize) {
  constexpr int kWorldCount = 10;
  constexpr int kRevisionCount = 4;
  constexpr int kQuestionCount = 250;
  int64_t found_count = 0;
  int answered_count = 0;
  for (uint64_t seed = 1; seed <= kWorldCount; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    FurnishedMap map(seed);
    for (int i = 0; i < kRevisionCount; ++i) map.Change();
    for (Revision revision = 1; revision <= map.head(); ++revision) {
      const auto snapshot = map.At(revision);
      const Belief belief = ReadAll(*snapshot);
      const auto view = Load(*snapshot);
      for (int i = 0; i < kQuestionCount; ++i) {
        const ScanQuestion question = RandomQuestion(&map.random());
        const auto pattern = ResolvePattern(question.pattern, *view, snapshot.get(), {});
        // A kind, a class or a relation that this revision does not have.
        if (!pattern.ok()) continue;
        const std::vector<HitKey> expected = Scan(belief, question);
        ++answered_count;
        found_count += static_cast<int64_t>(expected.size());
        const int page_size = map.random().Integer(1, 8);
        ASSERT_EQ(KeysOf(SearchAll(*view, Ask(question, *pattern), page_size)), expected)
            << "revision " << revision << ": " << Describe(question);
        if (question.near_map.has_value() || question.box_map.has_value()) continue;
        auto all = FindMatches(*view, *pattern, snapshot.get(), question.at_ns, {});
        ASSERT_TRUE(all.ok());
        // Matches are of any place, so agents without a track are among them.
        if (question.at_ns.has_value()) {
          std::erase_if(*all, [&](NodeId id) {
            return IsAgentKind(view->symbols().Text(view->FindNode(id)->kind));
          });
        }
        ASSERT_EQ(all->size(), expected.size());
      }
    }
  }
  // A test of questions that find nothing would prove little.
  EXPECT_GT(answered_count, 9000);
  EXPECT_GT(found_count, 20'000);
}

TEST(Search, AnswersTheSameHoweverTheGraphWasWrittenAndHoweverItIsPaged) {
  FurnishedMap map(21);
  for (int i = 0; i < 3; ++i) map.Change();
  const auto snapshot = map.At(map.head());
  const Belief belief = ReadAll(*snapshot);
  // The same belief in one delta, backwards.
  FurnishedMap copy(22);
  GraphDelta delta;
  delta.labels = {{77, "sofa"}};
  delta.nodes.assign(belief.nodes.rbegin(), belief.nodes.rend());
  delta.edges.assign(belief.edges.rbegin(), belief.edges.rend());
  copy.Commit(std::move(delta));
  const auto view = Load(*snapshot);
  const auto copied_snapshot = copy.At(1);
  const auto copied_view = Load(*copied_snapshot);
  for (int i = 0; i < 500; ++i) {
    const ScanQuestion question = RandomQuestion(&map.random());
    const auto pattern = ResolvePattern(question.pattern, *view, snapshot.get(), {});
    const auto copied = ResolvePattern(question.pattern, *copied_view, copied_snapshot.get(), {});
    ASSERT_EQ(pattern.ok(), copied.ok());
    if (!pattern.ok()) continue;
    const auto whole = SearchAll(*view, Ask(question, *pattern), 1000);
    for (const int page_size : {1, 2, 3, 5, 1000}) {
      const auto paged = SearchAll(*copied_view, Ask(question, *copied), page_size);
      ASSERT_EQ(KeysOf(paged), KeysOf(whole)) << Describe(question);
      for (size_t k = 0; k < whole.size(); ++k) {
        ASSERT_EQ(paged[k].related, whole[k].related) << Describe(question);
      }
    }
  }
}

TEST(Search, SaysTheStepsOfItsPlanWithCounts) {
  FurnishedMap map(23);
  map.Change();
  const auto snapshot = map.At(1);
  const auto view = Load(*snapshot);
  const auto steps_of = [&](const char* text) {
    std::string operations;
    auto pattern = ResolvePattern(*query::ParseQuery(text), *view, snapshot.get(), {});
    EXPECT_TRUE(pattern.ok()) << pattern.status();
    ScanQuestion question;
    query::SearchQuestion asked = Ask(question, *pattern);
    asked.limit = 100;
    asked.explain = true;
    const auto answer = query::RunSearch(*view, asked, {});
    EXPECT_TRUE(answer.ok());
    for (const query::PlanStep& step : answer->steps) {
      operations += step.operation + ", ";
      EXPECT_GE(step.in_count, 0);
      EXPECT_GE(step.out_count, 0);
    }
    EXPECT_EQ(answer->steps.back().out_count, static_cast<int64_t>(answer->hits.size()));
    return operations;
  };
  EXPECT_EQ(steps_of("id = O3"), "id, filter, ");
  EXPECT_EQ(steps_of("cup"), "class index, filter, ");
  EXPECT_EQ(steps_of("rooms"), "layer index, filter, ");
  EXPECT_EQ(steps_of("any"), "scan, filter, ");
  EXPECT_EQ(steps_of("any SEES O3"), "id, filter, join, filter, ");
  EXPECT_EQ(steps_of("cup or room"), "class index, layer index, union, filter, ");
  EXPECT_EQ(steps_of("cup and not (red or yellow)"), "class index, filter, ");
}

TEST(Search, StopsWhenItIsTold) {
  FurnishedMap map(24);
  GraphDelta delta;
  for (uint64_t i = 1; i <= 1000; ++i) {
    Node node;
    node.id = NodeId('O', i);
    node.layer = layers::kObjects;
    node.kind = kinds::kObject;
    delta.nodes.push_back(std::move(node));
  }
  map.Commit(std::move(delta));
  const auto view = Load(*map.At(1));
  const StopCheck stop = []() -> absl::Status { return absl::CancelledError("enough"); };
  const auto pattern = ResolvePattern(*query::ParseQuery("red object"), *view, nullptr, stop);
  ASSERT_TRUE(pattern.ok()) << pattern.status();
  query::SearchQuestion asked = Ask({}, *pattern);
  asked.limit = 1000;
  EXPECT_TRUE(absl::IsCancelled(query::RunSearch(*view, asked, stop).status()));
  asked.near_map = Eigen::Vector3d::Zero();
  EXPECT_TRUE(absl::IsCancelled(query::RunSearch(*view, asked, stop).status()));
  EXPECT_TRUE(
      absl::IsCancelled(FindMatches(*view, *pattern, nullptr, std::nullopt, stop).status()));
}

}  // namespace
}  // namespace dsg::test
