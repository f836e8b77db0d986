// SPDX-License-Identifier: Apache-2.0
// A view that was derived, a view that was loaded and a scan of the store answer alike, after every
// change and in every direction of time.
#include <gtest/gtest.h>

#include "query/view/indexed_view.h"
#include "tests/unit/query/view/changing_map.h"
#include "tests/unit/query/view/naive_view.h"

namespace dsg::query {
namespace {

using test::ChangingMap;
using test::ExpectAnswersAsScan;
using ViewPtr = std::shared_ptr<const GraphView>;

ViewPtr Load(const ChangingMap& map, Revision revision) {
  auto view = GraphView::Load(*map.At(revision), std::make_shared<SymbolTable>(), {});
  EXPECT_TRUE(view.ok()) << view.status();
  return *view;
}

ViewPtr Derive(const ChangingMap& map, const ViewPtr& from, Revision revision) {
  auto view = GraphView::Derive(from, map.reader().get(), *map.At(revision), {});
  EXPECT_TRUE(view.ok()) << view.status();
  return *view;
}

class ViewProperty : public ::testing::TestWithParam<uint64_t> {};
INSTANTIATE_TEST_SUITE_P(Seeds, ViewProperty, ::testing::Range<uint64_t>(1, 4));

TEST_P(ViewProperty, AnswersAsAScanAfterEveryRevision) {
  ChangingMap map(test::TestSeed(GetParam()));
  ViewPtr derived = Load(map, 0);
  ExpectAnswersAsScan(*derived, *map.At(0), &map.random(), 1);
  for (int i = 0; i < 60; ++i) {
    const Revision revision = map.Grow();
    derived = Derive(map, derived, revision);
    ExpectAnswersAsScan(*derived, *map.At(revision), &map.random(), 12);
    ExpectAnswersAsScan(*Load(map, revision), *map.At(revision), &map.random(), 12);
    if (HasFailure()) FAIL() << "at revision " << revision;
  }
}

TEST_P(ViewProperty, AnswersAsAScanBackwardsAndAfterJumps) {
  ChangingMap map(test::TestSeed(GetParam() + 100));
  Revision head = 0;
  for (int i = 0; i < 50; ++i) head = map.Grow();
  ViewPtr view = Load(map, head);
  for (Revision revision = head; revision >= head - 10; --revision) {
    view = Derive(map, view, revision);
    ExpectAnswersAsScan(*view, *map.At(revision), &map.random(), 10);
  }
  for (int i = 0; i < 30; ++i) {
    const Revision revision = map.random().Int(0, head);
    view = Derive(map, view, revision);
    ExpectAnswersAsScan(*view, *map.At(revision), &map.random(), 10);
    if (HasFailure()) FAIL() << "at revision " << revision << ", jump " << i;
  }
}

TEST_P(ViewProperty, LeavesTheViewThatItWasDerivedFromAsItWas) {
  ChangingMap map(test::TestSeed(GetParam() + 200));
  Revision before = 0;
  for (int i = 0; i < 20; ++i) before = map.Grow();
  const ViewPtr view = Load(map, before);
  std::vector<ViewPtr> later;
  for (int i = 0; i < 10; ++i) later.push_back(Derive(map, view, map.Grow()));
  ExpectAnswersAsScan(*view, *map.At(before), &map.random(), 50);
  for (const ViewPtr& other : later) {
    ExpectAnswersAsScan(*other, *map.At(other->revision()), &map.random(), 5);
  }
}

TEST(ViewProperty, SharesEverythingWithANeighbourWhenOnlyPeopleMoved) {
  ChangingMap map(test::TestSeed(3));
  Revision revision = 0;
  for (int i = 0; i < 20; ++i) revision = map.Grow();
  const ViewPtr view = Load(map, revision);
  const ViewPtr later = Derive(map, view, map.GrowTracksOnly());
  ASSERT_GT(later->revision(), view->revision());
  EXPECT_EQ(later->FindNode(NodeId('R', 0)), view->FindNode(NodeId('R', 0)));
  EXPECT_EQ(static_cast<const IndexedView&>(*later).fresh_bytes(), 0U);
  EXPECT_EQ(*later->Places({}), *view->Places({}));
}

}  // namespace
}  // namespace dsg::query
