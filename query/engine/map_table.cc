// SPDX-License-Identifier: Apache-2.0
#include "query/engine/map_table.h"

#include "schema/base/status.h"
#include "schema/model/ids.h"

namespace dsg::query {

absl::StatusOr<std::shared_ptr<MapReader>> MapTable::Reader(const std::string& name) {
  {
    std::shared_lock lock(readers_mutex_);
    const auto found = readers_.find(name);
    if (found != readers_.end() && found->second->IsCurrent()) return found->second;
  }
  DSG_RETURN_IF_ERROR(CheckMapName(name));
  // Opened without the lock, so that a slow disk delays only those who ask for this map. When two
  // open it at once, the first stays and the second is dropped.
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> opened, store_->OpenMap(name));
  std::unique_lock lock(readers_mutex_);
  std::shared_ptr<MapReader>& kept = readers_[name];
  if (kept == nullptr || !kept->IsCurrent()) kept = std::move(opened);
  return kept;
}

MapTable::WriterSlot* MapTable::FindSlot(const std::string& name) {
  std::lock_guard lock(slots_mutex_);
  std::unique_ptr<WriterSlot>& slot = slots_[name];
  if (slot == nullptr) slot = std::make_unique<WriterSlot>();
  return slot.get();
}

absl::Status MapTable::WithWriter(const std::string& name, const StopCheck& stop,
                                  const std::function<absl::Status(MapWriter&)>& work) {
  // Only maps that exist get a slot; otherwise callers could grow the table with invented names.
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, Reader(name));
  WriterSlot* slot = FindSlot(name);
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

absl::StatusOr<CommitResult> MapTable::Commit(GraphDelta delta, const StopCheck& stop) {
  CommitResult result;
  const std::string name = delta.map;
  DSG_RETURN_IF_ERROR(WithWriter(name, stop, [&](MapWriter& writer) -> absl::Status {
    DSG_ASSIGN_OR_RETURN(result, writer.Commit(std::move(delta)));
    return absl::OkStatus();
  }));
  return result;
}

}  // namespace dsg::query
