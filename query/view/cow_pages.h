// SPDX-License-Identifier: Apache-2.0
// The pages of a CowTree and what is done to one page alone. Refuses to know of other versions: who
// changes a page has made sure that it is his.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <utility>

namespace dsg::query {

/// `Traits` as of CowTree.
template <typename Traits>
struct CowPages {
  using Entry = typename Traits::Entry;
  using Key = typename Traits::Key;
  using Summary = typename Traits::Summary;
  static constexpr int kLeafEntries = Traits::kLeafEntries;
  static constexpr int kChildren = Traits::kChildren;

  struct Page {
    explicit Page(bool leaf) : is_leaf(leaf) {}
    Page(const Page& other) : count(other.count), is_leaf(other.is_leaf) {}
    Page& operator=(const Page&) = delete;

    std::atomic<uint32_t> owner_count{1};
    uint16_t count = 0;
    const bool is_leaf;
  };

  /// A counted pointer to a page.
  class PageRef {
   public:
    PageRef() = default;
    explicit PageRef(Page* owned) : page_(owned) {}
    PageRef(const PageRef& other) : page_(other.page_) {
      if (page_ != nullptr) page_->owner_count.fetch_add(1, std::memory_order_relaxed);
    }
    PageRef(PageRef&& other) noexcept : page_(std::exchange(other.page_, nullptr)) {}
    PageRef& operator=(PageRef other) noexcept {
      std::swap(page_, other.page_);
      return *this;
    }
    ~PageRef() {
      if (page_ == nullptr || page_->owner_count.fetch_sub(1, std::memory_order_acq_rel) != 1) {
        return;
      }
      if (page_->is_leaf) {
        delete static_cast<Leaf*>(page_);
      } else {
        delete static_cast<Inner*>(page_);
      }
    }
    Page* get() const { return page_; }
    /// No other tree can reach the page through this pointer's page.
    bool IsOnlyOwner() const { return page_->owner_count.load(std::memory_order_acquire) == 1; }

   private:
    Page* page_ = nullptr;
  };

  struct Leaf : Page {
    Leaf() : Page(true) {}
    std::array<Entry, kLeafEntries> entries;
  };
  struct Inner : Page {
    Inner() : Page(false) {}
    /// No key below child i is less than lows[i], nor any below child i - 1 equal or more.
    std::array<Key, kChildren> lows;
    std::array<PageRef, kChildren> children;
    std::array<Summary, kChildren> summaries;
  };
  static const Leaf& AsLeaf(const Page& page) { return static_cast<const Leaf&>(page); }
  static const Inner& AsInner(const Page& page) { return static_cast<const Inner&>(page); }

  static int ChildFor(const Inner& inner, const Key& key) {
    const auto begin = inner.lows.begin();
    const auto above = std::upper_bound(begin, begin + inner.count, key);
    return above == begin ? 0 : static_cast<int>(above - begin) - 1;
  }
  static int LowerBound(const Leaf& leaf, const Key& key) {
    const auto begin = leaf.entries.begin();
    return static_cast<int>(std::lower_bound(begin, begin + leaf.count, key,
                                             [](const Entry& entry, const Key& k) {
                                               return Traits::KeyOf(entry) < k;
                                             }) -
                            begin);
  }
  static Key LowOf(const Page& page) {
    return page.is_leaf ? Traits::KeyOf(AsLeaf(page).entries[0]) : AsInner(page).lows[0];
  }
  static Summary SummaryOf(const Page& page) {
    Summary summary;
    for (int i = 0; i < page.count; ++i) {
      if (page.is_leaf) {
        summary.Add(AsLeaf(page).entries[i]);
      } else {
        summary.Add(AsInner(page).summaries[i]);
      }
    }
    return summary;
  }

  static void AppendChild(PageRef child, Inner* inner) {
    InsertChild(std::move(child), inner->count, inner);
  }
  static void InsertChild(PageRef child, int at, Inner* inner) {
    for (int i = inner->count++; i > at; --i) MoveChild(i - 1, i, inner);
    inner->lows[at] = LowOf(*child.get());
    inner->summaries[at] = SummaryOf(*child.get());
    inner->children[at] = std::move(child);
  }
  static void RemoveChild(int at, Inner* inner) {
    --inner->count;
    for (int i = at; i < inner->count; ++i) MoveChild(i + 1, i, inner);
    inner->children[inner->count] = PageRef();
  }
  static void MoveChild(int from, int to, Inner* inner) {
    inner->lows[to] = inner->lows[from];
    inner->summaries[to] = inner->summaries[from];
    inner->children[to] = std::move(inner->children[from]);
  }

  // How many a full page keeps when it splits: all of them where keys come in ascending order, as
  // new ids do, so that pages stay full.
  static int KeptOf(int insert_at, int capacity) {
    return insert_at == capacity ? capacity : capacity / 2;
  }
  static void InsertEntry(Entry entry, int at, Leaf* leaf) {
    std::move_backward(leaf->entries.begin() + at, leaf->entries.begin() + leaf->count,
                       leaf->entries.begin() + leaf->count + 1);
    leaf->entries[at] = std::move(entry);
    ++leaf->count;
  }
  static void SplitInner(int kept, Inner* left, Inner* right) {
    for (int i = kept; i < left->count; ++i) {
      right->lows[right->count] = left->lows[i];
      right->summaries[right->count] = left->summaries[i];
      right->children[right->count++] = std::move(left->children[i]);
    }
    left->count = static_cast<uint16_t>(kept);
  }
};

}  // namespace dsg::query
