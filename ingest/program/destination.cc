// SPDX-License-Identifier: Apache-2.0
#include "ingest/program/destination.h"

#include <filesystem>
#include <utility>
#include <vector>

#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "schema/store/row_stream.h"

namespace dsg::ingest {
namespace {

// Remembers how far a map that was empty has come by commits of its own.
class CountingWriter : public GraphWriter {
 public:
  explicit CountingWriter(GraphWriter* writer) : writer_(*writer) {}

  absl::StatusOr<CommitResult> Commit(GraphDelta delta) override {
    absl::StatusOr<CommitResult> result = writer_.Commit(std::move(delta));
    if (!result.ok()) return result;
    // Others that commit in between leave the count behind for good.
    if (result->revision == own_head_ + 1) own_head_ = result->revision;
    if (result->replayed) return result;
    if (!committed_.has_value()) committed_ = {result->revision, result->revision};
    committed_->last = result->revision;
    return result;
  }
  absl::StatusOr<SessionState> GetSession(const std::string& session_id) override {
    return writer_.GetSession(session_id);
  }

  /// All revisions up to this one are its own.
  Revision own_head() const { return own_head_; }
  std::optional<RevisionRange> TakeCommitted() { return std::exchange(committed_, std::nullopt); }

 private:
  GraphWriter& writer_;
  Revision own_head_ = 0;
  std::optional<RevisionRange> committed_;
};

// Of a drop that checks what the map is: false if it is something else by now.
absl::StatusOr<bool> Dropped(const absl::Status& status) {
  const Reason reason = ReasonOf(status);
  const bool is_another = reason == Reason::kParentRevisionStale ||
                          reason == Reason::kMapReplaced || reason == Reason::kMapUnknown;
  if (is_another) return false;
  if (!status.ok()) return status;
  return true;
}

class LocalDestination : public Destination {
 public:
  LocalDestination(std::unique_ptr<GraphStore> store, std::shared_ptr<MapReader> map,
                   std::unique_ptr<GraphWriter> writer, bool is_new)
      : store_(std::move(store)),
        map_(std::move(map)),
        writer_(std::move(writer)),
        counting_(writer_.get()),
        is_new_(is_new) {}

  const MapSpec& spec() const override { return map_->spec(); }
  GraphWriter& writer() override { return counting_; }
  std::optional<RevisionRange> TakeCommitted() override { return counting_.TakeCommitted(); }
  bool is_new() const override { return is_new_; }
  absl::StatusOr<bool> DropIfOwn(bool only_empty) override {
    if (!is_new_) return false;
    const MapCondition condition{only_empty ? 0 : counting_.own_head(), map_->incarnation()};
    const std::string name = map_->spec().name;
    // The drop takes the lock itself.
    map_.reset();
    writer_.reset();
    return Dropped(store_->DropMap(name, condition).status());
  }
  absl::StatusOr<std::unique_ptr<MapView>> View() override {
    DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Snapshot> latest, map_->Latest());
    return MakeSnapshotMapView(std::move(latest), map_);
  }

 private:
  std::unique_ptr<GraphStore> store_;
  std::shared_ptr<MapReader> map_;
  std::unique_ptr<GraphWriter> writer_;
  CountingWriter counting_;
  bool is_new_;
};

class RemoteDestination : public Destination {
 public:
  explicit RemoteDestination(std::unique_ptr<RemoteMap> map)
      : map_(std::move(map)), counting_(&map_->writer()) {}

  const MapSpec& spec() const override { return map_->spec(); }
  GraphWriter& writer() override { return counting_; }
  std::optional<RevisionRange> TakeCommitted() override { return counting_.TakeCommitted(); }
  bool is_new() const override { return map_->is_new(); }
  absl::StatusOr<bool> DropIfOwn(bool only_empty) override {
    if (!map_->is_new()) return false;
    return Dropped(map_->Drop(only_empty ? 0 : counting_.own_head()));
  }
  absl::StatusOr<std::unique_ptr<MapView>> View() override { return MakeRemoteMapView(*map_); }

 private:
  std::unique_ptr<RemoteMap> map_;
  CountingWriter counting_;
};

// Copies a map, if there is one, between two stores of any backend.
absl::Status CopyMap(const std::string& folder, const std::string& name, GraphStore* to) {
  std::error_code error;
  if (!std::filesystem::exists(folder, error)) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const auto from, OpenStore(folder, {.program = "dsg-ingest"}));
  const auto map = from->OpenMap(name);
  if (ReasonOf(map.status()) == Reason::kMapUnknown) return absl::OkStatus();
  if (!map.ok()) return map.status();
  std::vector<StreamRow> rows;
  const auto keep = [&rows](const StreamRow& row) {
    rows.push_back(row);
    return absl::OkStatus();
  };
  DSG_RETURN_IF_ERROR((*map)->ReadRows(keep, {}));
  size_t taken = 0;
  const auto take = [&](StreamRow* row) -> absl::StatusOr<bool> {
    if (taken == rows.size()) return false;
    *row = std::move(rows[taken++]);
    return true;
  };
  return to->InstallRows((*map)->spec(), take, /*scratch=*/"", /*replace=*/false, {});
}

// Makes the map from `spec` if `store` has none.
absl::StatusOr<std::unique_ptr<Destination>> OpenIn(std::unique_ptr<GraphStore> store,
                                                    const MapSpec& spec) {
  absl::StatusOr<std::unique_ptr<GraphWriter>> writer = store->OpenWriter(spec.name);
  bool is_new = false;
  if (ReasonOf(writer.status()) == Reason::kMapUnknown) {
    const absl::Status created = store->CreateMap(spec);
    is_new = created.ok();
    // Another process may have been faster; its map serves as well.
    if (!created.ok() && ReasonOf(created) != Reason::kMapExists) return created;
    writer = store->OpenWriter(spec.name);
  }
  if (!writer.ok()) return writer.status();
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> map, store->OpenMap(spec.name));
  return std::make_unique<LocalDestination>(std::move(store), std::move(map), *std::move(writer),
                                            is_new);
}

}  // namespace

absl::StatusOr<std::unique_ptr<Destination>> OpenTrial(const std::string& folder,
                                                       const MapSpec& spec) {
  DSG_ASSIGN_OR_RETURN(auto store,
                       OpenStore("memory:dry-run", {.create = true, .program = "dsg-ingest"}));
  DSG_RETURN_IF_ERROR(CopyMap(folder, spec.name, store.get()));
  return OpenIn(std::move(store), spec);
}

absl::StatusOr<std::unique_ptr<Destination>> OpenLocal(const std::string& folder,
                                                       const MapSpec& spec,
                                                       const SpaceLimits& limits) {
  StoreOptions options;
  options.reserve_bytes = limits.reserve_bytes;
  options.quota_bytes = limits.quota_bytes;
  options.create = true;
  options.program = "dsg-ingest";
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<GraphStore> store, OpenStore(folder, options));
  return OpenIn(std::move(store), spec);
}

absl::StatusOr<std::unique_ptr<Destination>> OpenRemote(const std::string& address,
                                                        const MapSpec& spec,
                                                        const RemoteOptions& options) {
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<RemoteMap> map, OpenRemoteMap(address, spec, options));
  return std::make_unique<RemoteDestination>(std::move(map));
}

}  // namespace dsg::ingest
