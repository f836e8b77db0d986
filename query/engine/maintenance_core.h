// SPDX-License-Identifier: Apache-2.0
// The part of the service that keeps maps for years: it holds the open maps, and forgets, names,
// merges and archives them. What asks questions of them stands on top.
#pragma once

#include <memory>

#include "query/engine/map_table.h"
#include "query/engine/service_core.h"

namespace dsg::query {

class MaintenanceCore : public ServiceCore {
 public:
  MaintenanceCore(std::unique_ptr<GraphStore> store, const ServiceCoreOptions& options)
      : maps_(std::move(store), options.view_cache_bytes, options.archives, options.open_maps_max) {
  }

  const std::string& store_folder() const override { return store_folder_; }
  absl::StatusOr<std::unique_ptr<PruneCursor>> OpenPrune(const v1::PruneRequest& request) override;
  absl::Status Prune(const CallContext& call, const v1::PruneRequest& request,
                     const std::function<bool(const v1::PruneResponse&)>& send) override;
  absl::StatusOr<std::unique_ptr<CompactCursor>> OpenCompact(
      const v1::CompactRequest& request) override;
  absl::Status Compact(const CallContext& call, const v1::CompactRequest& request,
                       const std::function<bool(const v1::CompactResponse&)>& send) override;
  absl::StatusOr<std::unique_ptr<RevertCursor>> OpenRevert(
      const v1::RevertRequest& request) override;
  absl::Status Revert(const CallContext& call, const v1::RevertRequest& request,
                      const std::function<bool(const v1::RevertResponse&)>& send) override;
  absl::StatusOr<std::unique_ptr<MergeCursor>> OpenMerge(
      const v1::MergeMapsRequest& request) override;
  absl::Status MergeMaps(const CallContext& call, const v1::MergeMapsRequest& request,
                         const std::function<bool(const v1::MergeMapsResponse&)>& send) override;
  absl::StatusOr<std::unique_ptr<ArchiveCursor>> OpenArchive(
      const v1::ReadArchiveRequest& request) override;
  absl::Status ReadArchive(
      const CallContext& call, const v1::ReadArchiveRequest& request,
      const std::function<bool(const v1::ReadArchiveResponse&)>& send) override;
  absl::Status SetTag(const CallContext& call, const v1::SetTagRequest& request,
                      v1::SetTagResponse* reply) override;
  absl::Status RemoveTag(const CallContext& call, const v1::RemoveTagRequest& request,
                         v1::RemoveTagResponse* reply) override;
  absl::Status ListTags(const CallContext& call, const v1::ListTagsRequest& request,
                        v1::ListTagsResponse* reply) override;

 protected:
  MapTable maps_;

 private:
  const std::string store_folder_ = maps_.store().folder();
};

}  // namespace dsg::query
