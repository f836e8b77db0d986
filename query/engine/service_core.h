// SPDX-License-Identifier: Apache-2.0
// The service without the network: checks requests, opens maps, asks the engine, fills replies.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "query/engine/api.h"
#include "query/engine/archive_copies.h"
#include "schema/store/graph_store.h"

namespace dsg::query {

/// A stream read one message at a time, for whoever cannot wait inside a callback.
///
/// Threads: one caller at a time. Holds no lock and no thread between two messages.
template <class Reply>
class StreamCursor {
 public:
  virtual ~StreamCursor() = default;

  /// Fills `reply`, which must be clear, with the next message of the stream: the first has the
  /// header, also when there is nothing else to tell.
  virtual absl::Status Next(const CallContext& call, Reply* reply) = 0;
  /// No message follows. May only be asked after Next.
  virtual bool done() const = 0;
  /// How long to wait before this is asked again, because there is nothing to tell yet; zero once
  /// Next has a message, or an error, to give at once. May be asked before the first Next.
  virtual std::chrono::nanoseconds Wait() { return std::chrono::nanoseconds::zero(); }
};

using TrajectoryCursor = StreamCursor<v1::GetTrajectoryResponse>;
using MeshCursor = StreamCursor<v1::GetMeshResponse>;
using AgentShapeCursor = StreamCursor<v1::GetAgentShapeResponse>;
using SubgraphCursor = StreamCursor<v1::GetSubgraphResponse>;
using WatchCursor = StreamCursor<v1::WatchMapResponse>;
using PruneCursor = StreamCursor<v1::PruneResponse>;
using CompactCursor = StreamCursor<v1::CompactResponse>;
using RevertCursor = StreamCursor<v1::RevertResponse>;
using MergeCursor = StreamCursor<v1::MergeMapsResponse>;
using ArchiveCursor = StreamCursor<v1::ReadArchiveResponse>;

/// An Api in this process.
class ServiceCore : public Api {
 public:
  /// Absolute, without links; stands in errors about files.
  virtual const std::string& store_folder() const = 0;
  /// GetTrajectory by pulling. Errors: those of GetTrajectory.
  virtual absl::StatusOr<std::unique_ptr<TrajectoryCursor>> OpenTrajectory(
      const v1::GetTrajectoryRequest& request) = 0;
  /// GetMesh by pulling. Errors: those of GetMesh.
  virtual absl::StatusOr<std::unique_ptr<MeshCursor>> OpenMesh(
      const v1::GetMeshRequest& request) = 0;
  /// GetAgentShape by pulling. Errors: those of GetAgentShape.
  virtual absl::StatusOr<std::unique_ptr<AgentShapeCursor>> OpenAgentShape(
      const v1::GetAgentShapeRequest& request) = 0;
  /// GetSubgraph by pulling. Errors: those of GetSubgraph.
  virtual absl::StatusOr<std::unique_ptr<SubgraphCursor>> OpenSubgraph(
      const v1::GetSubgraphRequest& request) = 0;
  /// WatchMap by pulling; never done. Errors: those of WatchMap.
  virtual absl::StatusOr<std::unique_ptr<WatchCursor>> OpenWatch(
      const v1::WatchMapRequest& request) = 0;

  // Work by pulling: each Next does a piece of it, after which others may write. Errors: those of
  // the calls that they are named after.
  virtual absl::StatusOr<std::unique_ptr<PruneCursor>> OpenPrune(
      const v1::PruneRequest& request) = 0;
  virtual absl::StatusOr<std::unique_ptr<CompactCursor>> OpenCompact(
      const v1::CompactRequest& request) = 0;
  virtual absl::StatusOr<std::unique_ptr<RevertCursor>> OpenRevert(
      const v1::RevertRequest& request) = 0;
  virtual absl::StatusOr<std::unique_ptr<MergeCursor>> OpenMerge(
      const v1::MergeMapsRequest& request) = 0;
  /// ReadArchive by pulling.
  virtual absl::StatusOr<std::unique_ptr<ArchiveCursor>> OpenArchive(
      const v1::ReadArchiveRequest& request) = 0;
};

struct ServiceCoreOptions {
  /// Bound of the graphs kept in memory, all maps and revisions together. A million nodes and 3.5
  /// million edges take half of it, and a quarter once paths are asked for.
  size_t view_cache_bytes = size_t{1} << 30;
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
