// SPDX-License-Identifier: Apache-2.0
// The Api in this process: questions of query/engine and changes of query/maintenance behind one
// interface, without a network.
#pragma once

#include <memory>
#include <string>

#include "query/api/api.h"
#include "query/maintenance/archives.h"
#include "schema/store/graph_store.h"

namespace dsg::query {

/// An Api in this process.
class ServiceCore : public Api {
 public:
  /// Absolute, without links; stands in errors about files.
  virtual const std::string& store_folder() const = 0;
};

struct ServiceCoreOptions {
  /// Bound of the graphs kept in memory, all maps and revisions together. A million nodes and 3.5
  /// million edges take half of it, and a quarter once paths are asked for.
  size_t view_cache_bytes = size_t{512} << 20;
  ArchiveLimits archives;
  /// Maps kept open; those that were asked last. Each holds some file descriptors, and caches that
  /// grow up to StoreOptions::cache_bytes.
  size_t open_maps_max = 16;
};

/// Makes an Api that answers from `store`. Writers are opened at the first Commit to a map and kept
/// (with their lock) as long as the map.
std::unique_ptr<ServiceCore> MakeServiceCore(std::unique_ptr<GraphStore> store,
                                             const ServiceCoreOptions& options = {});

}  // namespace dsg::query
