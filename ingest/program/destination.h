// SPDX-License-Identifier: Apache-2.0
// Where dsg-ingest writes to: a map of a local store, or of a server.
// Part of the program, not of the library, so that the library names no store.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "ingest/commit/map_view.h"
#include "ingest/commit/remote_writer.h"
#include "schema/store/graph_writer.h"

namespace dsg::ingest {

/// With those of others in between, if there are some.
struct RevisionRange {
  Revision first = 0;
  Revision last = 0;
};

/// Threads: one caller at a time.
class Destination {
 public:
  virtual ~Destination() = default;
  virtual const MapSpec& spec() const = 0;
  virtual GraphWriter& writer() = 0;
  /// The map as it is now.
  virtual absl::StatusOr<std::unique_ptr<MapView>> View() = 0;
  /// What writer() has committed since the last call.
  virtual std::optional<RevisionRange> TakeCommitted() = 0;
  /// Whether opening has made the map.
  virtual bool is_new() const = 0;
  /// Drops the map again if opening has made it, and nobody but writer() has committed to it; with
  /// `only_empty` not even that. False if it stays. Nothing may be called afterwards.
  ///
  /// Errors: what keeps it from being dropped, such as a server that does not answer.
  virtual absl::StatusOr<bool> DropIfOwn(bool only_empty) = 0;
};

/// As StoreOptions has them.
struct SpaceLimits {
  int64_t reserve_bytes = int64_t{16} << 20;
  int64_t quota_bytes = 0;
};

/// Opens a map for writing, creating folder and map from `spec` where they are missing.
///
/// Errors: UNAVAILABLE/WRITER_LOCKED naming who holds the lock; what GraphStore returns.
absl::StatusOr<std::unique_ptr<Destination>> OpenLocal(const std::string& folder,
                                                       const MapSpec& spec,
                                                       const SpaceLimits& limits = {});

/// The same on a copy of the map in memory, made of `spec` if the store has none; what is written
/// is gone with it, and the store is not touched. The map's rows must fit into memory.
absl::StatusOr<std::unique_ptr<Destination>> OpenTrial(const std::string& folder,
                                                       const MapSpec& spec);

/// OpenLocal through a server. Errors: what OpenRemoteMap returns.
absl::StatusOr<std::unique_ptr<Destination>> OpenRemote(const std::string& address,
                                                        const MapSpec& spec,
                                                        const RemoteOptions& options);

}  // namespace dsg::ingest
