// SPDX-License-Identifier: Apache-2.0
#include "query/engine/maps.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
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
  absl::StatusOr<std::shared_ptr<MapReader>> found = store_->OpenMap(name);
  if (!found.ok()) {
    // Another process may have dropped it: files that are open take space until they are closed.
    TakeGone(name);
    return found.status();
  }
  std::shared_ptr<MapReader> opened = *std::move(found);
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

absl::Status MapTable::TakeAway(const std::string& name, const StopCheck& stop,
                                const std::function<absl::Status()>& work) {
  DSG_RETURN_IF_ERROR(CheckMapName(name));
  SlotUse slot = UseSlot(name);
  // Closed last, without any lock.
  std::shared_ptr<MapReader> gone;
  absl::Status status;
  {
    const std::lock_guard lock(slot->mutex);
    status = AskStop(stop);
    if (status.ok()) {
      slot->writer.reset();
      slot->reader.reset();
      status = work();
    }
    gone = TakeGone(name);
  }
  RemoveSlot(name, std::move(slot));
  return status;
}

std::shared_ptr<MapReader> MapTable::TakeGone(const std::string& name) {
  const std::unique_lock lock(readers_mutex_);
  const auto found = readers_.find(name);
  if (found == readers_.end() || found->second.reader->IsCurrent()) return nullptr;
  std::shared_ptr<MapReader> gone = std::move(found->second.reader);
  readers_.erase(found);
  return gone;
}

void MapTable::RemoveSlot(const std::string& name, SlotUse slot) {
  const std::lock_guard lock(slots_mutex_);
  const auto found = slots_.find(name);
  // The next call makes another one, and opens the writer again.
  if (found->second->user_count > 1) return;
  slot.Release();
  slots_.erase(found);
}

absl::Status ListMaps(Engine* engine, const CallContext&, const v1::ListMapsRequest&,
                      v1::ListMapsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const std::vector<MapSpec> specs, engine->maps.store().ListMaps());
  std::set<std::string> readable;
  for (const MapSpec& spec : specs) {
    ToProto(spec, reply->add_maps());
    readable.insert(spec.name);
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, engine->maps.store().MapNames());
  for (const std::string& name : names) {
    if (!readable.contains(name)) reply->add_unreadable_maps(name);
  }
  return absl::OkStatus();
}

namespace {

absl::Status FillReadable(MapReader* map, Revision head, v1::GetMapStatsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Revision oldest, map->OldestRevision());
  DSG_ASSIGN_OR_RETURN(const std::vector<Tag> tags, map->Tags());
  std::set<Revision> kept;
  for (const Tag& tag : tags) {
    if (tag.revision < oldest) kept.insert(tag.revision);
  }
  const auto add = [&](Revision first, Revision last) {
    const int count = reply->readable_revisions_size();
    v1::RevisionRange* before = count > 0 ? reply->mutable_readable_revisions(count - 1) : nullptr;
    if (before != nullptr && before->last() + 1 == first) {
      before->set_last(last);
      return;
    }
    v1::RevisionRange* range = reply->add_readable_revisions();
    range->set_first(first);
    range->set_last(last);
  };
  for (const Revision revision : kept) add(revision, revision);
  add(oldest, std::max(head, oldest));
  return absl::OkStatus();
}

}  // namespace

absl::Status GetMapStats(Engine* engine, const CallContext&, const v1::GetMapStatsRequest& request,
                         v1::GetMapStatsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(const MapStats stats, view.snapshot().Stats());
  view.FillHeader(reply->mutable_header());
  ToProto(view.snapshot().spec(), reply->mutable_map());
  reply->set_head_revision(view.head_revision());
  for (const LayerCount& count : stats.layers) {
    v1::LayerStats* layer = reply->add_layers();
    layer->set_name(count.layer.name);
    layer->set_rank(count.layer.rank);
    layer->set_node_count(count.node_count);
  }
  reply->set_node_count(stats.at.node_count);
  reply->set_edge_count(stats.at.edge_count);
  reply->set_agent_count(stats.at.agent_count);
  reply->set_pose_count(stats.at.pose_count);
  reply->set_stay_count(stats.at.stay_count);
  reply->set_mesh_block_count(stats.at.mesh_block_count);
  reply->set_bytes_on_disk(stats.bytes_on_disk);
  if (stats.first_pose_ns.has_value()) reply->set_first_pose_ns(*stats.first_pose_ns);
  if (stats.last_pose_ns.has_value()) reply->set_last_pose_ns(*stats.last_pose_ns);
  reply->set_format_version(kStoreFormatVersion);
  DSG_RETURN_IF_ERROR(FillReadable(&view.map(), view.head_revision(), reply));
  DSG_ASSIGN_OR_RETURN(const auto pending, view.map().GetPendingErasure());
  if (pending.has_value()) {
    v1::PendingErasure* out = reply->mutable_pending_erasure();
    out->set_node_count(pending->node_count);
    out->set_edge_count(pending->edge_count);
    out->set_mesh_block_count(pending->mesh_block_count);
    out->set_span_count(pending->span_count);
  }
  return absl::OkStatus();
}

namespace {

// So many revisions at even steps, newest first; the log may lack some in between.
absl::StatusOr<std::vector<RevisionInfo>> SampleRevisions(const ReadView& view, Revision before,
                                                          int count) {
  const Revision newest =
      before > 0 ? std::min(before - 1, view.head_revision()) : view.head_revision();
  // One alone is the newest.
  if (count == 1) return view.map().ListRevisions(newest + 1, 1);
  const Revision steps = std::max(std::min<Revision>(count, newest) - 1, Revision{1});
  std::vector<RevisionInfo> sampled;
  for (Revision step = steps; step >= 0; --step) {
    const Revision wanted = 1 + (newest - 1) * step / steps;
    if (!sampled.empty() && sampled.back().revision <= wanted) continue;
    DSG_ASSIGN_OR_RETURN(const auto found, view.map().ListRevisions(wanted + 1, 1));
    if (found.empty()) break;
    sampled.push_back(found.front());
  }
  return sampled;
}

}  // namespace

absl::Status ListRevisions(Engine* engine, const CallContext&,
                           const v1::ListRevisionsRequest& request,
                           v1::ListRevisionsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, ReadView::Newest(&engine->maps, request.map()));
  DSG_ASSIGN_OR_RETURN(const int page_size, CheckPageSize(request.page_size()));
  if (request.before_revision() < 0) {
    return FieldError("before_revision", absl::StrCat(request.before_revision()),
                      "give a revision, or 0 to begin with the newest");
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<RevisionInfo> revisions,
                       request.sampled()
                           ? SampleRevisions(view, request.before_revision(), page_size)
                           : view.map().ListRevisions(request.before_revision(), page_size));
  view.FillHeader(reply->mutable_header());
  size_t bytes = 0;
  for (const RevisionInfo& revision : revisions) {
    v1::Revision* out = reply->add_revisions();
    ToProto(revision, out);
    bytes += out->ByteSizeLong();
    // The caller goes on below the last one anyway, so a short page needs no mark.
    if (bytes > kPageBytesSoftMax) break;
  }
  return absl::OkStatus();
}

absl::Status GetServerInfo(Engine*, const CallContext&, const v1::GetServerInfoRequest&,
                           v1::GetServerInfoResponse* reply) {
  reply->set_version(DSG_VERSION);
  reply->set_store_format_version(kStoreFormatVersion);
  return absl::OkStatus();
}

}  // namespace dsg::query
