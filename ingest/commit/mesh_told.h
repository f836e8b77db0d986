// SPDX-License-Identifier: Apache-2.0
// Which mesh blocks are due for a commit. A block in view changes with every frame, and each
// version of it stays in the history: it is told soon when it is new, and ever more rarely while
// it goes on changing.
// It knows indices and times only; the blocks are StaticLayers'.
#pragma once

#include <map>
#include <vector>

#include "schema/model/mesh.h"

namespace dsg::ingest {

/// Threads: one caller at a time.
class MeshTold {
 public:
  /// `wait_max_ns`: how long any change may wait, in log time, at least `wait_min_ns`, which is for
  /// changes of a new block. The map is never further behind than that and one commit period.
  explicit MeshTold(TimeNs wait_max_ns, TimeNs wait_min_ns = 2 * kNsPerSecond);

  /// The block has changed; `is_there`: it has a surface now. Times ascend.
  void Note(const BlockIndex& index, bool is_there, TimeNs now_ns);

  /// Each ascending.
  struct Due {
    std::vector<BlockIndex> written;
    /// Told before, and without a surface now.
    std::vector<BlockIndex> removed;
  };
  /// Blocks whose oldest untold change has waited long enough; with `is_last` all that have one.
  /// They count as told, and the next change of each may wait twice as long.
  Due TakeDue(TimeNs now_ns, bool is_last);

 private:
  struct Entry {
    TimeNs wait_ns = 0;
    /// kTimeMax when all has been told.
    TimeNs changed_ns = kTimeMax;
    bool is_there = false;
    bool is_told_there = false;
  };

  TimeNs wait_min_ns_;
  TimeNs wait_max_ns_;
  std::map<BlockIndex, Entry> entries_;
};

}  // namespace dsg::ingest
