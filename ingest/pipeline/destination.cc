// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/destination.h"

#include <utility>

#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::ingest {
namespace {

class LocalDestination : public Destination {
 public:
  LocalDestination(std::unique_ptr<GraphStore> store, std::shared_ptr<MapReader> map,
                   std::unique_ptr<GraphWriter> writer)
      : store_(std::move(store)), map_(std::move(map)), writer_(std::move(writer)) {}

  const MapSpec& spec() const override { return map_->spec(); }
  GraphWriter& writer() override { return *writer_; }
  absl::StatusOr<std::unique_ptr<MapView>> View() override {
    DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Snapshot> latest, map_->Latest());
    return MakeSnapshotMapView(std::move(latest), map_);
  }

 private:
  std::unique_ptr<GraphStore> store_;
  std::shared_ptr<MapReader> map_;
  std::unique_ptr<GraphWriter> writer_;
};

class RemoteDestination : public Destination {
 public:
  explicit RemoteDestination(std::unique_ptr<RemoteMap> map) : map_(std::move(map)) {}

  const MapSpec& spec() const override { return map_->spec(); }
  GraphWriter& writer() override { return map_->writer(); }
  absl::StatusOr<std::unique_ptr<MapView>> View() override { return MakeRemoteMapView(*map_); }

 private:
  std::unique_ptr<RemoteMap> map_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Destination>> OpenLocal(const std::string& folder,
                                                       const MapSpec& spec,
                                                       const SpaceLimits& limits) {
  StoreOptions options;
  options.reserve_bytes = limits.reserve_bytes;
  options.quota_bytes = limits.quota_bytes;
  options.create = true;
  options.program = "dsg-ingest";
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<GraphStore> store, OpenStore(folder, options));
  absl::StatusOr<std::unique_ptr<GraphWriter>> writer = store->OpenWriter(spec.name);
  if (ReasonOf(writer.status()) == Reason::kMapUnknown) {
    const absl::Status created = store->CreateMap(spec);
    // Another process may have been faster; its map serves as well.
    if (!created.ok() && ReasonOf(created) != Reason::kMapExists) return created;
    writer = store->OpenWriter(spec.name);
  }
  if (!writer.ok()) return writer.status();
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> map, store->OpenMap(spec.name));
  return std::make_unique<LocalDestination>(std::move(store), std::move(map), *std::move(writer));
}

absl::StatusOr<std::unique_ptr<Destination>> OpenRemote(const std::string& address,
                                                        const MapSpec& spec,
                                                        const RemoteOptions& options) {
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<RemoteMap> map, OpenRemoteMap(address, spec, options));
  return std::make_unique<RemoteDestination>(std::move(map));
}

}  // namespace dsg::ingest
