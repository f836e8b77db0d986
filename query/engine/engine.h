// SPDX-License-Identifier: Apache-2.0
// State that the calls share: the open maps and the caches of what was derived from them.
//
// The function that answers a call is dsg::query::NAME(Engine*, ...), NAME as in the proto; it is
// declared in query/api/generated/engine_api.h and defined in query/engine if it reads, in
// query/maintenance if it changes maps. The deadline and the cancellation of the call have been
// checked before it runs.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/statusor.h"
#include "query/api/generated/engine_api.h"
#include "query/engine/agents.h"
#include "query/engine/collision/collision_cache.h"
#include "query/engine/maps.h"
#include "query/engine/request.h"
#include "query/engine/walk_area.h"

namespace dsg::query {

/// Of query/maintenance/archives.h; questions know nothing of archives.
class ArchiveCopies;

struct EngineOptions {
  /// Bound of the graphs kept in memory, all maps and revisions together. A million nodes and 3.5
  /// million edges take half of it, and a quarter once paths are asked for.
  size_t view_cache_bytes = size_t{1} << 30;
  /// Maps kept open; those that were asked last. Each holds some file descriptors, and caches that
  /// grow up to StoreOptions::cache_bytes.
  size_t open_maps_max = 16;
};

/// Threads: safe from many threads, as each of its parts.
struct Engine {
  /// Without `archive_copies` only questions can be answered.
  explicit Engine(std::unique_ptr<GraphStore> store, const EngineOptions& options = {},
                  std::shared_ptr<ArchiveCopies> archive_copies = nullptr)
      : maps(std::move(store), options.view_cache_bytes, options.open_maps_max),
        store_folder(maps.store().folder()),
        archives(std::move(archive_copies)) {}

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
  /// Holds readers of `maps`, so it is destroyed first.
  const std::shared_ptr<ArchiveCopies> archives;
};

/// A stream of the engine: it knows its last message when it makes it, so that the server can send
/// the message and the end in one piece.
template <class Reply>
class EngineCursor : public StreamCursor<Reply> {
 public:
  absl::StatusOr<bool> Next(const CallContext& call, Reply* reply) final {
    DSG_RETURN_IF_ERROR(call.Check());
    if (has_begun_ && this->done()) return false;
    DSG_RETURN_IF_ERROR(Fill(call, reply));
    has_begun_ = true;
    return true;
  }
  /// Asked only after the first message, which always comes: it has the header.
  bool done() const override = 0;

 protected:
  /// Makes the next message.
  virtual absl::Status Fill(const CallContext& call, Reply* reply) = 0;

 private:
  bool has_begun_ = false;
};

}  // namespace dsg::query
