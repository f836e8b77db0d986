// SPDX-License-Identifier: Apache-2.0
#include "query/view/cow_tree.h"

#include <gtest/gtest.h>

#include <map>

#include "schema/base/random.h"
#include "tests/support/temp_folder.h"

namespace dsg::query {
namespace {

struct Item {
  int key = 0;
  int value = 0;
};

struct Sum {
  int64_t value = 0;
  void Add(const Item& item) { value += item.value; }
  void Add(const Sum& other) { value += other.value; }
};

struct ItemTraits {
  using Entry = Item;
  using Key = int;
  using Summary = Sum;
  // Small, so that few items make many levels.
  static constexpr int kLeafEntries = 4;
  static constexpr int kChildren = 8;
  static int KeyOf(const Item& item) { return item.key; }
};

using Tree = CowTree<ItemTraits>;
using Oracle = std::map<int, int>;

// Checks the order of keys, the lower bounds and the summaries below a page; counts pages.
void ExpectSound(const Tree::Page& page, size_t* page_bytes) {
  EXPECT_GT(page.count, 0);
  *page_bytes += page.is_leaf ? sizeof(Tree::Leaf) : sizeof(Tree::Inner);
  if (page.is_leaf) return;
  const auto& inner = Tree::AsInner(page);
  for (int i = 0; i < inner.count; ++i) {
    const Tree::Page& child = *inner.children[i].get();
    Sum sum;
    for (int k = 0; k < child.count; ++k) {
      const int low =
          child.is_leaf ? Tree::AsLeaf(child).entries[k].key : Tree::AsInner(child).lows[k];
      EXPECT_LE(inner.lows[i], low);
      if (i + 1 < inner.count) {
        EXPECT_LT(low, inner.lows[i + 1]);
      }
      if (child.is_leaf) {
        sum.Add(Tree::AsLeaf(child).entries[k]);
      } else {
        sum.Add(Tree::AsInner(child).summaries[k]);
      }
    }
    EXPECT_EQ(sum.value, inner.summaries[i].value);
    ExpectSound(child, page_bytes);
  }
}

void ExpectSame(const Tree& tree, const Oracle& oracle, int from) {
  EXPECT_EQ(tree.size(), oracle.size());
  auto expected = oracle.lower_bound(from);
  EXPECT_TRUE(tree.Scan(from, [&](const Item& item) {
    EXPECT_TRUE(expected != oracle.end() && item.key == expected->first &&
                item.value == expected->second);
    if (expected != oracle.end()) ++expected;
    return true;
  }));
  EXPECT_TRUE(expected == oracle.end());
  size_t page_bytes = 0;
  if (tree.root() != nullptr) ExpectSound(*tree.root(), &page_bytes);
  EXPECT_EQ(page_bytes, tree.memory_bytes());
}

Tree MakeTree(const Oracle& oracle) {
  Tree::Builder builder;
  for (const auto& [key, value] : oracle) builder.Append({key, value});
  return builder.Finish();
}

void ChangeRandomly(Random* random, int key_count, Tree* tree, Oracle* oracle) {
  const int key = random->Index(key_count);
  if (random->Chance(0.5)) {
    const int value = random->Index(1000);
    tree->Put({key, value});
    (*oracle)[key] = value;
  } else {
    EXPECT_EQ(tree->Erase(key), oracle->erase(key) == 1);
  }
}

TEST(CowTree, DoesAsAnOrderedMapDoes) {
  Random random(test::TestSeed(1), 1);
  for (int run = 0; run < 12; ++run) {
    Tree tree;
    Oracle oracle;
    const int key_count = run % 3 == 0 ? 8 : 3000;
    for (int i = 0; i < 6000; ++i) {
      ChangeRandomly(&random, key_count, &tree, &oracle);
      const int key = random.Index(key_count);
      const Item* found = tree.Find(key);
      ASSERT_EQ(found != nullptr, oracle.contains(key)) << key;
      if (found != nullptr) {
        ASSERT_EQ(found->value, oracle[key]);
      }
      if (i % 500 == 0) ExpectSame(tree, oracle, random.Index(key_count));
    }
    ExpectSame(tree, oracle, 0);
    while (!oracle.empty()) {
      auto victim = oracle.lower_bound(random.Index(key_count));
      if (victim == oracle.end()) victim = oracle.begin();
      ASSERT_TRUE(tree.Erase(victim->first));
      oracle.erase(victim);
      if (oracle.size() % 250 == 0) ExpectSame(tree, oracle, 0);
    }
    EXPECT_EQ(tree.memory_bytes(), 0U);
    EXPECT_EQ(tree.root(), nullptr);
  }
}

TEST(CowTree, IsFullWhenBuiltOrGrownInOrder) {
  Oracle oracle;
  Tree grown;
  for (int i = 0; i < 5000; ++i) {
    oracle[i] = i * 7;
    grown.Put({i, i * 7});
  }
  const Tree built = MakeTree(oracle);
  ExpectSame(built, oracle, 17);
  ExpectSame(grown, oracle, 17);
  EXPECT_LE(grown.memory_bytes(), built.memory_bytes() * 11 / 10);
}

TEST(CowTree, KeepsOldVersionsAsTheyWere) {
  Random random(test::TestSeed(2), 2);
  Oracle oracle;
  for (int i = 0; i < 2000; ++i) oracle[random.Index(10000)] = i;
  std::vector<std::pair<Tree, Oracle>> versions = {{MakeTree(oracle), oracle}};
  for (int version = 0; version < 40; ++version) {
    auto [tree, contents] = versions[static_cast<size_t>(random.Index(version + 1))];
    Tree fork = tree.Fork();
    for (int i = 0; i < 50; ++i) ChangeRandomly(&random, 10000, &fork, &contents);
    versions.emplace_back(std::move(fork), std::move(contents));
  }
  for (const auto& [tree, contents] : versions) ExpectSame(tree, contents, 0);
}

TEST(CowTree, CopiesOnlyThePathToAChange) {
  Oracle oracle;
  for (int i = 0; i < 20000; ++i) oracle[i] = i;
  const Tree tree = MakeTree(oracle);
  Tree fork = tree.Fork();
  EXPECT_EQ(fork.fresh_bytes(), 0U);
  fork.Put({777, -1});
  // 20,000 items in leaves of 4 make 5,000, and pages of 8 five levels above them.
  EXPECT_EQ(fork.fresh_bytes(), sizeof(Tree::Leaf) + 5 * sizeof(Tree::Inner));
  // What is the fork's own is changed in place.
  fork.Put({778, -1});
  EXPECT_EQ(fork.fresh_bytes(), sizeof(Tree::Leaf) + 5 * sizeof(Tree::Inner));
  EXPECT_EQ(fork.Find(15000), tree.Find(15000));
  EXPECT_EQ(tree.Find(777)->value, 777);
  EXPECT_FALSE(fork.Erase(-5));
}

}  // namespace
}  // namespace dsg::query
