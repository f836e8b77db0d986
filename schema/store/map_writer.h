// SPDX-License-Identifier: Apache-2.0
// Keeping a map for years: names for revisions, and forgetting what nobody will ask for again.
// Only the process that writes the map may do this.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/stop_check.h"
#include "schema/model/graph_delta.h"
#include "schema/store/graph_writer.h"

namespace dsg {

/// A revision that has a name, and stays readable when its neighbours are compacted.
struct Tag {
  std::string name;
  Revision revision = 0;
  /// Wall clock at which it was set.
  TimeNs created_ns = 0;
  std::string note;
};

struct CompactReport {
  Revision oldest = 0;
  int64_t revision_count = 0;
  /// Rows that no readable revision shows, now gone.
  int64_t row_count = 0;
  /// To which nothing referred any more.
  int64_t asset_count = 0;
  int64_t bytes_before = 0;
  int64_t bytes_after = 0;
  /// False when a reader kept space from being given back: the map shrinks at a later time.
  bool is_shrunk = true;
};

/// Whose past is to be wiped out. What is believed now stays: retire or correct it first, by an
/// ordinary commit.
struct Erasure {
  /// All past versions of these nodes, and of edges at them. Of those that are gone also tracks,
  /// shapes, factors, and stays of them or in them.
  std::vector<NodeId> nodes;
  std::vector<EdgeKey> edges;
  std::vector<BlockIndex> mesh_blocks;
  /// Past poses, shapes and factors within, and past stays that touch them.
  std::vector<TrackSpan> tracks;
  /// Also assets that only such versions referred to.
  bool assets = false;
};

struct EraseReport {
  int64_t row_count = 0;
  int64_t pose_count = 0;
  int64_t asset_count = 0;
  int64_t bytes_before = 0;
  int64_t bytes_after = 0;
  /// False when a reader kept the backend from giving up all bytes: some may be left until the same
  /// call is made again.
  bool is_clean = true;
  /// An earlier erasure was cut off, and this call has ended it, or went on with it.
  bool was_pending = false;
  /// Of an earlier erasure something is believed still that its commits were to retire.
  bool is_pending = false;
  /// Agents that such an erasure named and that are there again: nothing more of them was erased.
  std::vector<NodeId> left_agents;
  /// Paths in the store that this program does not write any more, such as copies that an upgrade
  /// kept: they may hold the bytes, and are left alone.
  std::vector<std::string> other_files;
};

/// Gets a fraction from 0 to 1; may be empty.
using Progress = std::function<void(double)>;

/// Threads: one caller at a time.
class MapWriter : public GraphWriter {
 public:
  /// Names a revision; a name that is there already moves to it.
  /// Errors: OUT_OF_RANGE as MapReader::At; INVALID_ARGUMENT/FIELD_INVALID for a name that is not
  /// 1 to 64 letters, digits, '.', '_' or '-', or looks like a number; or a note above 1000 bytes.
  virtual absl::StatusOr<Tag> SetTag(const std::string& name, Revision revision,
                                     const std::string& note) = 0;
  /// Errors: NOT_FOUND/TAG_UNKNOWN naming those there are.
  virtual absl::Status RemoveTag(const std::string& name) = 0;

  /// Makes the revisions before `keep_from` unreadable, but for those with tags, drops the rows
  /// that only they show, and gives the space back to the file system. What is kept reads as
  /// before. Done in steps: when stopped or killed, the next call goes on. The report of a call
  /// that goes on after a stop, by the same writer to the same revision, speaks of both.
  ///
  /// Errors: OUT_OF_RANGE/REVISION_IN_FUTURE or REVISION_COMPACTED; what `stop` returned.
  virtual absl::StatusOr<CompactReport> Compact(Revision keep_from, const StopCheck& stop,
                                                const Progress& progress) = 0;

  /// Remembers that an erasure was begun, before the commits that retire what it names: the map
  /// says so, and each Erase wipes what is retired of it, until nothing is left. What is written
  /// anew of the named nodes, edges and mesh blocks after `planned_at` is kept.
  virtual absl::Status NoteErasure(const Erasure& erasure, Revision planned_at) = 0;

  /// Wipes the past of what is named out of all revisions, so that nothing that the store keeps
  /// holds the bytes, and counts and digests of the revisions are of what is left. Readers find
  /// the map replaced. Done in steps: when stopped or killed, the map is sound and remembers what
  /// is left, and the next call does that too, whatever it names. Messages of revisions stay.
  ///
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID for an agent that is still there (name spans of its
  /// track); what `stop` returned.
  virtual absl::StatusOr<EraseReport> Erase(const Erasure& erasure, const StopCheck& stop,
                                            const Progress& progress) = 0;
};

}  // namespace dsg
