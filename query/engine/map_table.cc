// SPDX-License-Identifier: Apache-2.0
#include "query/engine/map_table.h"

#include <algorithm>
#include <utility>

#include "schema/base/status.h"
#include "schema/model/ids.h"

namespace dsg::query {

absl::StatusOr<std::shared_ptr<MapReader>> MapTable::Reader(const std::string& name) {
  {
    std::shared_lock lock(readers_mutex_);
    const auto found = readers_.find(name);
    if (found != readers_.end() && found->second.reader->IsCurrent()) {
      found->second.last_use = ++use_count_;
      return found->second.reader;
    }
  }
  DSG_RETURN_IF_ERROR(CheckMapName(name));
  // Opened without the lock, so that a slow disk delays only those who ask for this map. When two
  // open it at once, the first stays and the second is dropped.
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> opened, store_->OpenMap(name));
  std::unique_lock lock(readers_mutex_);
  OpenMap& kept = readers_[name];
  if (kept.reader == nullptr || !kept.reader->IsCurrent()) std::swap(kept.reader, opened);
  kept.last_use = ++use_count_;
  std::shared_ptr<MapReader> reader = kept.reader;
  const std::vector<ClosingMap> closing = TakeTooMany();
  lock.unlock();
  for (const ClosingMap& map : closing) {
    // Whoever came first since has opened the map anew.
    const std::unique_lock slot_lock(map.slot->mutex, std::try_to_lock);
    if (!slot_lock.owns_lock() || map.slot->reader != map.reader) continue;
    map.slot->writer.reset();
    map.slot->reader.reset();
  }
  return reader;
}

std::vector<MapTable::ClosingMap> MapTable::TakeTooMany() {
  std::vector<ClosingMap> taken;
  if (readers_.size() <= open_maps_max_) return taken;
  std::vector<std::pair<uint64_t, std::string>> by_use;
  for (const auto& [name, map] : readers_) by_use.emplace_back(map.last_use.load(), name);
  std::sort(by_use.begin(), by_use.end());
  // The one that was just asked for stays.
  for (size_t i = 0; i + 1 < by_use.size() && readers_.size() > open_maps_max_; ++i) {
    std::optional<SlotUse> slot = UseIdleSlot(by_use[i].second);
    if (!slot.has_value()) continue;
    const auto found = readers_.find(by_use[i].second);
    taken.push_back({std::move(found->second.reader), *std::move(slot)});
    readers_.erase(found);
  }
  return taken;
}

MapTable::SlotUse::~SlotUse() {
  if (slot_ == nullptr) return;
  const std::lock_guard lock(table_->slots_mutex_);
  --slot_->user_count;
}

MapTable::SlotUse MapTable::UseSlot(const std::string& name) {
  const std::lock_guard lock(slots_mutex_);
  std::unique_ptr<WriterSlot>& slot = slots_[name];
  if (slot == nullptr) slot = std::make_unique<WriterSlot>();
  ++slot->user_count;
  return SlotUse(this, slot.get());
}

std::optional<MapTable::SlotUse> MapTable::UseIdleSlot(const std::string& name) {
  SlotUse use = UseSlot(name);
  const std::lock_guard lock(slots_mutex_);
  if (use->user_count > 1) return std::nullopt;
  return use;
}

absl::Status MapTable::WithWriter(const std::string& name, const StopCheck& stop,
                                  const std::function<absl::Status(MapWriter&)>& work) {
  // Only maps that exist get a slot; otherwise callers could grow the table with invented names.
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, Reader(name));
  const SlotUse slot = UseSlot(name);
  std::lock_guard lock(slot->mutex);
  DSG_RETURN_IF_ERROR(AskStop(stop));
  // Another reader means another file: what the old writer wrote would be in no folder.
  if (slot->reader != reader) slot->writer.reset();
  slot->reader = reader;
  if (slot->writer == nullptr) {
    DSG_ASSIGN_OR_RETURN(slot->writer, store_->OpenWriter(name));
  }
  absl::Status status = work(*slot->writer);
  // A look by which the reader sees that the past was erased from, if it was; who asks next then
  // gets a new one.
  reader->Head().status().IgnoreError();
  // After a failed commit the writer's connection is of no more use; the next caller, who will ask
  // with the same session and sequence, gets a fresh one.
  if (ReasonOf(status) == Reason::kCommitOutcomeUnknown) slot->writer.reset();
  return status;
}

}  // namespace dsg::query
