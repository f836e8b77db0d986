// SPDX-License-Identifier: Apache-2.0
// What the calls share: the open maps, and what was made of them and would be made again.
//
// The function that answers a call is dsg::query::NAME(Engine*, ...), NAME as in the proto; it is
// declared in query/api/generated/engine_api.h and defined in one of the files of this folder.
// Before it is called, the call's deadline and cancellation have been checked.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "query/api/generated/engine_api.h"
#include "query/engine/agent_names.h"
#include "query/engine/ancestry.h"
#include "query/engine/collision/collision_cache.h"
#include "query/engine/map_table.h"
#include "query/engine/page_token.h"
#include "query/engine/read_view.h"
#include "query/engine/service_core.h"
#include "query/engine/walk_area_cache.h"

namespace dsg::query {

/// Threads: safe from many threads, as each of its parts.
struct Engine {
  explicit Engine(std::unique_ptr<GraphStore> store, const ServiceCoreOptions& options = {})
      : maps(std::move(store), options.view_cache_bytes, options.archives, options.open_maps_max),
        store_folder(maps.store().folder()) {}

  /// The belief that a request asks. Errors: as ReadView::Open.
  template <typename Request>
  absl::StatusOr<ReadView> Read(const Request& request) {
    return ReadView::Open(&maps, request.map(), request.read_at());
  }
  /// The page that a request for a list asks; `method` names the list. Errors: as OpenPage.
  template <typename Request>
  absl::StatusOr<Page> ReadPage(std::string_view method, const Request& request) {
    return OpenPage(&maps, method, request);
  }

  MapTable maps;
  /// Absolute, without links.
  const std::string store_folder;
  AgentNames names;
  AncestryCache ancestries;
  WalkAreaCache walk_areas;
  CollisionCache collisions;
};

}  // namespace dsg::query
