// SPDX-License-Identifier: Apache-2.0
#include "query/view/graph_view.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>

#include "absl/strings/ascii.h"
#include "query/view/indexed_view.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Chunk i holds kFirstChunk << i texts, so that 22 chunks hold more than 32 bits can name.
constexpr int kFirstChunkBits = 10;
constexpr uint64_t kFirstChunk = uint64_t{1} << kFirstChunkBits;
constexpr int kChunks = 23;

struct SymbolSlot {
  int chunk;
  uint64_t offset;
};

SymbolSlot SymbolSlotOf(Symbol symbol) {
  const uint64_t n = symbol + kFirstChunk;
  const int chunk = static_cast<int>(std::bit_width(n)) - 1 - kFirstChunkBits;
  return {chunk, n - (kFirstChunk << chunk)};
}

// A to Z become a to z.
std::string Folded(std::string_view text) {
  std::string folded(text);
  std::transform(folded.begin(), folded.end(), folded.begin(), absl::ascii_tolower);
  return folded;
}

}  // namespace

struct SymbolTable::Impl {
  Symbol Add(std::string_view text) {
    DSG_CHECK(count <= UINT32_MAX);
    const auto symbol = static_cast<Symbol>(count++);
    const SymbolSlot slot = SymbolSlotOf(symbol);
    if (owned[slot.chunk] == nullptr) {
      const size_t size = kFirstChunk << slot.chunk;
      owned[slot.chunk] = std::make_unique<std::string[]>(size);
      chunks[slot.chunk].store(owned[slot.chunk].get(), std::memory_order_release);
      bytes += size * sizeof(std::string);
    }
    std::string& stored = owned[slot.chunk][slot.offset];
    stored = text;
    // The entry of the map, roughly, and the text where the string does not hold it itself.
    bytes += 64 + (stored.capacity() > 15 ? stored.capacity() + 1 : 0);
    symbols.emplace(stored, symbol);
    AddFolded(stored, symbol);
    return symbol;
  }

  // Most texts are their own folded form, and `symbols` finds those.
  void AddFolded(const std::string& text, Symbol symbol) {
    if (std::none_of(text.begin(), text.end(), absl::ascii_isupper)) return;
    const auto [entry, is_new] = folded.try_emplace(Folded(text));
    entry->second.push_back(symbol);
    bytes += sizeof(Symbol) + (is_new ? 96 + text.size() : 0);
  }

  mutable std::shared_mutex mutex;
  std::unordered_map<std::string_view, Symbol> symbols;
  // Of the texts with capital letters, by the text without.
  std::unordered_map<std::string, std::vector<Symbol>> folded;
  uint64_t count = 0;
  size_t bytes = 0;
  std::array<std::unique_ptr<std::string[]>, kChunks> owned;
  // As `owned`, for readers: whoever has a symbol got it after its text was written.
  std::array<std::atomic<const std::string*>, kChunks> chunks = {};
};

SymbolTable::SymbolTable() : impl_(std::make_unique<Impl>()) { impl_->Add(""); }
SymbolTable::~SymbolTable() = default;

Symbol SymbolTable::Intern(std::string_view text) {
  if (text.empty()) return 0;
  if (const auto known = Find(text)) return *known;
  std::unique_lock lock(impl_->mutex);
  const auto found = impl_->symbols.find(text);
  return found != impl_->symbols.end() ? found->second : impl_->Add(text);
}

std::optional<Symbol> SymbolTable::Find(std::string_view text) const {
  std::shared_lock lock(impl_->mutex);
  const auto found = impl_->symbols.find(text);
  if (found == impl_->symbols.end()) return std::nullopt;
  return found->second;
}

std::vector<Symbol> SymbolTable::FindIgnoringCase(std::string_view text) const {
  const std::string folded = Folded(text);
  std::vector<Symbol> found;
  {
    std::shared_lock lock(impl_->mutex);
    const auto with_capitals = impl_->folded.find(folded);
    if (with_capitals != impl_->folded.end()) found = with_capitals->second;
    const auto without = impl_->symbols.find(folded);
    if (without != impl_->symbols.end()) found.push_back(without->second);
  }
  std::sort(found.begin(), found.end());
  return found;
}

const std::string& SymbolTable::Text(Symbol symbol) const {
  const SymbolSlot slot = SymbolSlotOf(symbol);
  return impl_->chunks[slot.chunk].load(std::memory_order_acquire)[slot.offset];
}

size_t SymbolTable::memory_bytes() const {
  std::shared_lock lock(impl_->mutex);
  return impl_->bytes;
}

absl::StatusOr<std::shared_ptr<const GraphView>> GraphView::Load(
    const Snapshot& snapshot, std::shared_ptr<SymbolTable> symbols, const StopCheck& stop) {
  return IndexedView::Load(snapshot, std::move(symbols), stop);
}

absl::StatusOr<std::shared_ptr<const GraphView>> GraphView::Derive(
    std::shared_ptr<const GraphView> from, MapReader* map, const Snapshot& snapshot,
    const StopCheck& stop) {
  // There is no other kind of view.
  const auto& indexed = static_cast<const IndexedView&>(*from);
  const Revision older = std::min(from->revision(), snapshot.revision());
  const Revision newer = std::max(from->revision(), snapshot.revision());
  DSG_ASSIGN_OR_RETURN(const Touched touched, map->TouchedBetween(older, newer, stop));
  return IndexedView::Derive(indexed, touched, snapshot, stop);
}

}  // namespace dsg::query
