// SPDX-License-Identifier: Apache-2.0
// An ordered container whose copies share what they have in common: a B+ tree of counted pages,
// where a change copies the pages between the root and itself. Iterators must not outlive it.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <utility>
#include <vector>

namespace dsg::query {

/// The pages of a CowTree and the operations on one page. Callers must own a page exclusively
/// before they change it.
///
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

/// For trees that summarize nothing.
struct NoSummary {
  template <typename Entry>
  void Add(const Entry&) {}
};

/// `Traits` has:
///   Entry, Key (ordered, copied freely), static Key KeyOf(const Entry&);
///   Summary: default-constructed = of nothing, Add(const Entry&), Add(const Summary&);
///   static constexpr int kLeafEntries, kChildren: how much a leaf and an inner page hold.
///
/// Threads: copies that share pages may be used from different threads, also while one of them is
/// changed; one tree as a standard container.
/// Cost: lookup and change O(log n); a copy O(1); Fork as a copy.
template <typename Traits>
class CowTree {
 public:
  using Entry = typename Traits::Entry;
  using Key = typename Traits::Key;
  using Summary = typename Traits::Summary;
  using Pages = CowPages<Traits>;
  using Page = typename Pages::Page;
  using PageRef = typename Pages::PageRef;
  using Leaf = typename Pages::Leaf;
  using Inner = typename Pages::Inner;
  static constexpr int kLeafEntries = Traits::kLeafEntries;
  static constexpr int kChildren = Traits::kChildren;

  static const Leaf& AsLeaf(const Page& page) { return Pages::AsLeaf(page); }
  static const Inner& AsInner(const Page& page) { return Pages::AsInner(page); }

  /// Makes a tree of full pages. Requires: entries ascend, each key once.
  class Builder {
   public:
    void Append(Entry entry) {
      if (level_.empty() || level_.back().get()->count == kLeafEntries) {
        level_.push_back(PageRef(new Leaf()));
        ++tree_.leaf_count_;
      }
      Leaf& leaf = static_cast<Leaf&>(*level_.back().get());
      leaf.entries[leaf.count++] = std::move(entry);
      ++tree_.size_;
    }
    CowTree Finish() {
      while (level_.size() > 1) level_ = tree_.LevelAbove(std::move(level_));
      if (!level_.empty()) tree_.root_ = std::move(level_.front());
      tree_.fresh_bytes_ = tree_.memory_bytes();
      return std::move(tree_);
    }

   private:
    CowTree tree_;
    std::vector<PageRef> level_;
  };

  size_t size() const { return size_; }
  size_t memory_bytes() const { return leaf_count_ * sizeof(Leaf) + inner_count_ * sizeof(Inner); }
  /// Of pages made since the tree was forked or built: all that it does not share with its origin.
  size_t fresh_bytes() const { return fresh_bytes_; }
  /// Null when empty. For searches that the summaries guide.
  const Page* root() const { return root_.get(); }

  CowTree Fork() const {
    CowTree fork = *this;
    fork.fresh_bytes_ = 0;
    return fork;
  }

  /// Null if there is none. Valid until the tree is changed or gone.
  const Entry* Find(const Key& key) const {
    const Page* page = root_.get();
    if (page == nullptr) return nullptr;
    while (!page->is_leaf) {
      const Inner& inner = AsInner(*page);
      page = inner.children[Pages::ChildFor(inner, key)].get();
    }
    const Leaf& leaf = AsLeaf(*page);
    const int at = Pages::LowerBound(leaf, key);
    return at < leaf.count && Traits::KeyOf(leaf.entries[at]) == key ? &leaf.entries[at] : nullptr;
  }

  /// Calls `visit` for each entry with a key of at least `from`, until it returns false.
  /// Order: ascending. Returns whether it came to the end.
  template <typename Visit>
  bool Scan(const Key& from, const Visit& visit) const {
    return root_.get() == nullptr || ScanPage(*root_.get(), from, visit);
  }

  /// Inserts, or replaces the entry of the same key.
  void Put(Entry entry) {
    if (root_.get() == nullptr) root_ = PageRef(NewLeaf());
    PageRef right = PutInto(&root_, std::move(entry));
    if (right.get() == nullptr) return;
    std::vector<PageRef> halves;
    halves.push_back(std::move(root_));
    halves.push_back(std::move(right));
    root_ = std::move(LevelAbove(std::move(halves)).front());
    fresh_bytes_ += sizeof(Inner);
  }

  /// False if there is none.
  bool Erase(const Key& key) {
    if (Find(key) == nullptr) return false;
    EraseFrom(&root_, key);
    --size_;
    while (root_.get() != nullptr && !root_.get()->is_leaf && root_.get()->count == 1) {
      PageRef only = AsInner(*root_.get()).children[0];
      root_ = std::move(only);
      --inner_count_;
    }
    if (root_.get()->count == 0) {
      root_ = PageRef();
      leaf_count_ = 0;
    }
    return true;
  }

 private:
  template <typename Visit>
  static bool ScanPage(const Page& page, const Key& from, const Visit& visit) {
    if (page.is_leaf) {
      const Leaf& leaf = AsLeaf(page);
      for (int i = Pages::LowerBound(leaf, from); i < leaf.count; ++i) {
        if (!visit(leaf.entries[i])) return false;
      }
      return true;
    }
    const Inner& inner = AsInner(page);
    for (int i = Pages::ChildFor(inner, from); i < inner.count; ++i) {
      if (!ScanPage(*inner.children[i].get(), from, visit)) return false;
    }
    return true;
  }

  Leaf* NewLeaf() {
    ++leaf_count_;
    fresh_bytes_ += sizeof(Leaf);
    return new Leaf();
  }
  Inner* NewInner() {
    ++inner_count_;
    fresh_bytes_ += sizeof(Inner);
    return new Inner();
  }

  std::vector<PageRef> LevelAbove(std::vector<PageRef> below) {
    std::vector<PageRef> level;
    for (PageRef& child : below) {
      if (level.empty() || level.back().get()->count == kChildren) {
        level.push_back(PageRef(new Inner()));
        ++inner_count_;
      }
      Pages::AppendChild(std::move(child), &static_cast<Inner&>(*level.back().get()));
    }
    return level;
  }
  // Requires: all pages between the root and this one are this tree's alone.
  void MakeOwn(PageRef* page) {
    if (page->IsOnlyOwner()) return;
    if (page->get()->is_leaf) {
      *page = PageRef(new Leaf(AsLeaf(*page->get())));
      fresh_bytes_ += sizeof(Leaf);
    } else {
      *page = PageRef(new Inner(AsInner(*page->get())));
      fresh_bytes_ += sizeof(Inner);
    }
  }

  // Returns what was split off to the right of the page, if anything.
  PageRef PutInto(PageRef* page, Entry entry) {
    MakeOwn(page);
    if (page->get()->is_leaf) return PutIntoLeaf(std::move(entry), static_cast<Leaf*>(page->get()));
    Inner* inner = static_cast<Inner*>(page->get());
    const Key key = Traits::KeyOf(entry);
    const int at = Pages::ChildFor(*inner, key);
    if (key < inner->lows[at]) inner->lows[at] = key;
    PageRef split = PutInto(&inner->children[at], std::move(entry));
    inner->summaries[at] = Pages::SummaryOf(*inner->children[at].get());
    if (split.get() == nullptr) return PageRef();
    if (inner->count < kChildren) {
      Pages::InsertChild(std::move(split), at + 1, inner);
      return PageRef();
    }
    PageRef right(NewInner());
    Inner* right_inner = static_cast<Inner*>(right.get());
    Pages::SplitInner(Pages::KeptOf(at + 1, kChildren), inner, right_inner);
    if (at + 1 <= inner->count && inner->count < kChildren) {
      Pages::InsertChild(std::move(split), at + 1, inner);
    } else {
      Pages::InsertChild(std::move(split), at + 1 - inner->count, right_inner);
    }
    return right;
  }

  PageRef PutIntoLeaf(Entry entry, Leaf* leaf) {
    const Key key = Traits::KeyOf(entry);
    const int at = Pages::LowerBound(*leaf, key);
    if (at < leaf->count && Traits::KeyOf(leaf->entries[at]) == key) {
      leaf->entries[at] = std::move(entry);
      return PageRef();
    }
    ++size_;
    if (leaf->count < kLeafEntries) {
      Pages::InsertEntry(std::move(entry), at, leaf);
      return PageRef();
    }
    PageRef right(NewLeaf());
    Leaf* right_leaf = static_cast<Leaf*>(right.get());
    const int kept = Pages::KeptOf(at, kLeafEntries);
    for (int i = kept; i < kLeafEntries; ++i) {
      right_leaf->entries[right_leaf->count++] = std::move(leaf->entries[i]);
      leaf->entries[i] = Entry();
    }
    leaf->count = static_cast<uint16_t>(kept);
    if (at <= kept && kept < kLeafEntries) {
      Pages::InsertEntry(std::move(entry), at, leaf);
    } else {
      Pages::InsertEntry(std::move(entry), at - kept, right_leaf);
    }
    return right;
  }

  // Requires: the key is below the page.
  void EraseFrom(PageRef* page, const Key& key) {
    MakeOwn(page);
    if (page->get()->is_leaf) {
      Leaf* leaf = static_cast<Leaf*>(page->get());
      const auto begin = leaf->entries.begin();
      std::move(begin + Pages::LowerBound(*leaf, key) + 1, begin + leaf->count,
                begin + Pages::LowerBound(*leaf, key));
      leaf->entries[--leaf->count] = Entry();
      return;
    }
    Inner* inner = static_cast<Inner*>(page->get());
    const int at = Pages::ChildFor(*inner, key);
    EraseFrom(&inner->children[at], key);
    const Page& child = *inner->children[at].get();
    if (child.count == 0) {
      ForgetPage(child);
      Pages::RemoveChild(at, inner);
      return;
    }
    inner->summaries[at] = Pages::SummaryOf(child);
    if (at + 1 < inner->count) MergeChildren(at, inner);
    if (at > 0) MergeChildren(at - 1, inner);
  }

  void ForgetPage(const Page& page) { --(page.is_leaf ? leaf_count_ : inner_count_); }

  // Joins child `at` and the next where both together fill half a page.
  void MergeChildren(int at, Inner* inner) {
    if (at + 1 >= inner->count) return;
    const Page& right = *inner->children[at + 1].get();
    const int capacity = right.is_leaf ? kLeafEntries : kChildren;
    if (inner->children[at].get()->count + right.count > capacity / 2) return;
    MakeOwn(&inner->children[at]);
    Page* left = inner->children[at].get();
    for (int i = 0; i < right.count; ++i) {
      if (right.is_leaf) {
        static_cast<Leaf*>(left)->entries[left->count++] = AsLeaf(right).entries[i];
      } else {
        Inner* left_inner = static_cast<Inner*>(left);
        left_inner->lows[left->count] = AsInner(right).lows[i];
        left_inner->summaries[left->count] = AsInner(right).summaries[i];
        left_inner->children[left->count++] = AsInner(right).children[i];
      }
    }
    inner->summaries[at] = Pages::SummaryOf(*left);
    ForgetPage(right);
    Pages::RemoveChild(at + 1, inner);
  }

  PageRef root_;
  size_t size_ = 0;
  size_t leaf_count_ = 0;
  size_t inner_count_ = 0;
  size_t fresh_bytes_ = 0;
};

}  // namespace dsg::query
