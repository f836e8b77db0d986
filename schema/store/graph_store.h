// SPDX-License-Identifier: Apache-2.0
// A store: maps, each with its history. Start reading here.
//
//   auto store  = *OpenStore("/var/lib/dsg", {.create = true});
//   store->CreateMap({.name = "office"});                  // once
//   auto writer = *store->OpenWriter("office");            // takes the writer lock
//   writer->Commit(delta);                                 // acknowledged = safe
//   auto map    = *store->OpenMap("office");               // any number of readers, no lock
//   auto now    = *map->Latest();                          // a Snapshot at the newest revision
//   auto then   = *map->At(17);                            // ... and as believed at revision 17
//
// Every call returns a Status or StatusOr; `*` above stands for a caller that has checked it.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/store/map_writer.h"
#include "schema/store/row_stream.h"
#include "schema/store/snapshot.h"

namespace dsg {

/// Result of checking a whole map.
struct VerifyReport {
  int64_t row_count = 0;
  int64_t pose_count = 0;
  int64_t revision_count = 0;
  /// One sentence a problem, naming table and key; empty = every byte is what was written.
  std::vector<std::string> problems;
  /// What is no damage, and still to be done: one sentence each.
  std::vector<std::string> notes;
};

/// Entities with a row that begins or ends in a span of revisions: all that may differ between its
/// ends. Each list ascends.
struct Touched {
  std::vector<NodeId> nodes;
  std::vector<EdgeKey> edges;
  /// Agents whose poses were appended or corrected.
  std::vector<NodeId> tracks;
  /// Those of `tracks` of which poses that were known before the span were rewritten. They may be
  /// what they were.
  std::vector<NodeId> corrected_tracks;
  std::vector<BlockIndex> mesh_blocks;
  bool layers_or_labels = false;
};

/// What was believed of a node during [from, to).
struct NodeVersion {
  Revision from = 0;
  /// kRevisionMax = it is believed still.
  Revision to = kRevisionMax;
  Node node;
};

/// What an erasure that was begun and cut off has still to wipe out, by what it is.
struct PendingErasure {
  int64_t node_count = 0;
  int64_t edge_count = 0;
  int64_t mesh_block_count = 0;
  /// Stretches of tracks.
  int64_t span_count = 0;
};

/// One map, open for reading.
///
/// Threads: safe from many threads. Sees commits of other processes as they happen.
class MapReader {
 public:
  virtual ~MapReader() = default;

  virtual const MapSpec& spec() const = 0;
  /// Tells this map from others of its name, before it and after it: those that it was restored
  /// over or that were restored over it. Another one in each store.
  virtual const std::string& incarnation() const = 0;
  /// Tells what was opened: no other reader of this process has the same, nor will have. What is
  /// kept of a map is kept under it.
  uint64_t opening() const { return opening_; }
  /// False once the map was removed or replaced under it (a restore), or its past was rewritten
  /// (erased from): open it again.
  virtual bool IsCurrent() const = 0;
  /// The newest revision; costs a few microseconds when nothing has changed.
  virtual absl::StatusOr<RevisionInfo> Head() = 0;
  virtual absl::StatusOr<std::shared_ptr<const Snapshot>> Latest() = 0;
  /// Errors: OUT_OF_RANGE/REVISION_IN_FUTURE or REVISION_COMPACTED, both with oldest and newest.
  virtual absl::StatusOr<std::shared_ptr<const Snapshot>> At(Revision revision) = 0;
  /// From this revision on all can be read; of older ones those with a tag.
  virtual absl::StatusOr<Revision> OldestRevision() = 0;
  /// Set from MapWriter::NoteErasure or Erase on until an Erase has wiped all of it; all zero when
  /// only bytes that the backend has given up are left to wipe.
  virtual absl::StatusOr<std::optional<PendingErasure>> GetPendingErasure() = 0;
  /// Order: by name.
  virtual absl::StatusOr<std::vector<Tag>> Tags() = 0;
  /// Newest first, below `before` (0 = from the newest), at most `limit`.
  virtual absl::StatusOr<std::vector<RevisionInfo>> ListRevisions(Revision before, int limit) = 0;
  /// Versions of a node that began before the revision `before` (0 = all), at most `limit`. Those
  /// that no readable revision shows may be missing. Order: newest first.
  virtual absl::StatusOr<std::vector<NodeVersion>> NodeVersions(NodeId id, Revision before,
                                                                int limit) = 0;
  /// What was touched by the revisions after `after`, up to and with `until`.
  /// Nothing unless `after` is below `until`.
  /// Cost: that of what was touched; of the whole map where it was made before commits listed it.
  /// Errors: as At, for both; what `stop` returned.
  virtual absl::StatusOr<Touched> TouchedBetween(Revision after, Revision until,
                                                 const StopCheck& stop) = 0;
  virtual absl::StatusOr<SessionState> GetSession(const std::string& session_id) = 0;
  /// Reads everything: what the backend keeps of its own, payload checksums, the digest of every
  /// revision, the ends of edges. The other invariants are proven at each commit (CheckDelta).
  /// `progress` (may be empty) gets a fraction from 0 to 1.
  /// Errors: what `stop` returned.
  virtual absl::StatusOr<VerifyReport> Verify(const StopCheck& stop,
                                              const std::function<void(double)>& progress) = 0;
  /// Writes the newest revision with all its history as one file that the same backend can install
  /// (InstallMap), while others read and write. The bytes depend on the content of the map alone.
  /// Nobody sees half a copy: it gets its name when it is whole and on the disk.
  ///
  /// Cost:   reads and writes the whole map.
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID if `path` exists; RESOURCE_EXHAUSTED/DISK_FULL, with
  /// nothing left behind; DATA_LOSS/STORE_CORRUPT; UNIMPLEMENTED by a store without files; what
  /// `stop` returned.
  virtual absl::Status CopyTo(const std::string& path, const StopCheck& stop,
                              const Progress& progress) = 0;
  /// Shows the newest revision with all its history as rows that any backend can install
  /// (InstallRows), of one state, while others read and write. The rows and their order depend on
  /// the content of the map alone.
  ///
  /// Memory: some rows, and what is kept of the segments of one track.
  /// Errors: FAILED_PRECONDITION while something is to be erased still (GetPendingErasure);
  /// DATA_LOSS/STORE_CORRUPT; what `sink` and `stop` returned.
  virtual absl::Status ReadRows(const RowSink& sink, const StopCheck& stop) = 0;

 private:
  static inline std::atomic<uint64_t> opening_count_{0};
  const uint64_t opening_ = ++opening_count_;
};

/// Result of bringing a map to the newest format.
struct UpgradeReport {
  int64_t from_format = 0;
  int64_t to_format = 0;
  /// The map as it was, in a file beside it; empty if nothing was to do. Delete it when content.
  std::string copy;
};

struct StoreOptions {
  /// Make the store if it is missing.
  bool create = false;
  /// Upper bound on the memory of decoded tracks and segments, per open map.
  size_t cache_bytes = size_t{256} << 20;
  /// How writers name this process to others: "dsg-ingest", "dsg-server", ...
  std::string program = "dsg";
  /// Each map keeps so much space while there is some, which is given up when the disk is full, so
  /// that forgetting can go on; 0 = none. Of no meaning without files, as the quota.
  int64_t reserve_bytes = int64_t{16} << 20;
  /// Commits that would make a map larger are refused; 0 = no limit. What the backend uses for the
  /// moment may stand above it.
  int64_t quota_bytes = 0;
};

/// What a map must be for it to be dropped; what is not set may be anything.
struct MapCondition {
  /// Its newest revision.
  std::optional<Revision> head{};
  /// As MapReader::incarnation has it; empty = any.
  std::string incarnation{};

  bool is_set() const { return head.has_value() || !incarnation.empty(); }
  /// Whether a map is so. Errors: ABORTED/MAP_REPLACED or PARENT_REVISION_STALE.
  absl::Status Check(const std::string& map, const std::string& incarnation_now,
                     Revision head_now) const;
};

/// A map that is gone.
struct DropReport {
  /// Its newest revision; unset if it could not be read.
  std::optional<Revision> head;
  /// Space that is free again; 0 for a store without files.
  int64_t bytes_on_disk = 0;
};

/// Threads: safe from many threads.
class GraphStore {
 public:
  virtual ~GraphStore() = default;

  /// As OpenStore.
  static absl::StatusOr<std::unique_ptr<GraphStore>> Open(const std::string& uri,
                                                          const StoreOptions& options);

  /// Absolute, without links; empty for a store that keeps no files.
  virtual const std::string& folder() const = 0;

  /// Maps that this program can read or upgrade; the others are logged and left out. Order: by
  /// name.
  virtual absl::StatusOr<std::vector<MapSpec>> ListMaps() = 0;
  /// Names of all maps, also of those that this program cannot open. Order: ascending.
  /// Errors: UNAVAILABLE if they cannot be listed.
  virtual absl::StatusOr<std::vector<std::string>> MapNames() = 0;
  /// Of MapStats::bytes_on_disk of a map, what the backend uses again and says nothing about the
  /// map, such as a log, now; 0 when there is none.
  virtual int64_t ReusedBytesOnDisk(const std::string& map) const = 0;
  /// Errors: ALREADY_EXISTS/MAP_EXISTS; what MapSpec::Validate returns, of the name too.
  virtual absl::Status CreateMap(const MapSpec& spec) = 0;
  /// Errors: INVALID_ARGUMENT/MAP_NAME_INVALID (CheckMapName); NOT_FOUND/MAP_UNKNOWN;
  /// FAILED_PRECONDITION/FORMAT_TOO_NEW or NOT_A_STORE.
  virtual absl::StatusOr<std::shared_ptr<MapReader>> OpenMap(const std::string& name) = 0;
  /// Brings a map to the newest format, in one transaction, after keeping a copy. Opening never
  /// does it.
  /// Errors: NOT_FOUND/MAP_UNKNOWN; UNAVAILABLE/WRITER_LOCKED; FAILED_PRECONDITION/FORMAT_TOO_NEW;
  /// RESOURCE_EXHAUSTED/DISK_FULL, nothing changed.
  virtual absl::StatusOr<UpgradeReport> UpgradeMap(const std::string& name) = 0;
  /// Makes a file that CopyTo wrote the map `name`, after reading it whole; the file is gone then.
  /// It may bear another name inside. It must be on the store's file system.
  /// Readers of a map that is replaced notice (IsCurrent).
  ///
  /// Errors: ALREADY_EXISTS/MAP_EXISTS unless `replace`; UNAVAILABLE/WRITER_LOCKED;
  /// FAILED_PRECONDITION/FORMAT_TOO_NEW, FORMAT_TOO_OLD or NOT_A_STORE; DATA_LOSS/STORE_CORRUPT;
  /// UNIMPLEMENTED by a store without files. After an error the store is as it was, and the file
  /// still there.
  virtual absl::Status InstallMap(const std::string& name, const std::string& file,
                                  bool replace) = 0;
  /// Makes the rows that ReadRows showed a map of that spec, in which each revision is proven to
  /// have its digest. The map appears whole, or not at all. `scratch` is an empty folder on the
  /// store's file system for what is under way, which the caller removes; a store without files
  /// ignores it. Readers of a map that is replaced notice (IsCurrent).
  ///
  /// Errors: as InstallMap, without UNIMPLEMENTED; what `rows` and `stop` returned.
  virtual absl::Status InstallRows(const MapSpec& spec, const RowSource& rows,
                                   const std::string& scratch, bool replace,
                                   const StopCheck& stop) = 0;
  /// Removes a map with its history and all its files. Killed at any point, it has left the map
  /// as it was, or none; what is left of the files then goes when the store is opened next.
  /// Readers of the map notice (IsCurrent). A map that cannot be read is removed as well, unless
  /// `condition` asks for something.
  ///
  /// Errors: as OpenWriter, but for those of formats; FAILED_PRECONDITION/NOT_A_STORE for files
  /// that are no map; as MapCondition::Check, which sees the map with its lock held. After an
  /// error the map is as it was.
  virtual absl::StatusOr<DropReport> DropMap(const std::string& name,
                                             const MapCondition& condition) = 0;
  /// Gives a map another name; history and incarnation stay. Killed at any point, it has left the
  /// map under one of the two names. Readers under the old name notice (IsCurrent).
  ///
  /// Errors: as OpenWriter; INVALID_ARGUMENT/MAP_NAME_INVALID; ALREADY_EXISTS/MAP_EXISTS. After an
  /// error the map is as it was.
  virtual absl::Status RenameMap(const std::string& from, const std::string& to) = 0;
  /// Errors: as OpenMap; UNAVAILABLE/WRITER_LOCKED naming who holds the lock.
  virtual absl::StatusOr<std::unique_ptr<MapWriter>> OpenWriter(const std::string& name) = 0;
};

/// Opens a store by where it is: "file:PATH" or a bare path is a folder, "memory:NAME" a store in
/// the memory of this process, gone with the last who has it open. All who open one URI share its
/// maps. Link dsg::stores, which knows the backends.
/// Errors: NOT_FOUND/MAP_UNKNOWN naming the store if it is not there and not to be made;
/// FAILED_PRECONDITION/NETWORK_FILE_SYSTEM.
absl::StatusOr<std::unique_ptr<GraphStore>> OpenStore(const std::string& uri,
                                                      const StoreOptions& options);

/// Where a store in a folder keeps the file of a map: a file of MapReader::CopyTo that stands there
/// is a map of that store.
std::string MapFilePath(const std::string& store_folder, const std::string& map);

inline absl::StatusOr<std::unique_ptr<GraphStore>> GraphStore::Open(const std::string& uri,
                                                                    const StoreOptions& options) {
  return OpenStore(uri, options);
}

/// ALREADY_EXISTS/MAP_EXISTS and NOT_FOUND/MAP_UNKNOWN, for backends.
absl::Status MapExistsError(const std::string& map);
absl::Status UnknownMapError(const std::string& map, const std::string& store);

/// The format of what is on disk; opening never upgrades it silently.
inline constexpr int kStoreFormatVersion = 3;

}  // namespace dsg
