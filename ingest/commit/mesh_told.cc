// SPDX-License-Identifier: Apache-2.0
#include "ingest/commit/mesh_told.h"

#include <algorithm>

namespace dsg::ingest {

MeshTold::MeshTold(TimeNs wait_max_ns, TimeNs wait_min_ns)
    : wait_min_ns_(wait_min_ns), wait_max_ns_(std::max(wait_max_ns, wait_min_ns)) {}

void MeshTold::Note(const BlockIndex& index, bool is_there, TimeNs now_ns) {
  Entry& entry = entries_.try_emplace(index, Entry{wait_min_ns_}).first->second;
  entry.is_there = is_there;
  if (entry.changed_ns == kTimeMax) entry.changed_ns = now_ns;
}

MeshTold::Due MeshTold::TakeDue(TimeNs now_ns, bool is_last) {
  Due due;
  for (auto& [index, entry] : entries_) {
    if (entry.changed_ns == kTimeMax) continue;
    if (!is_last && now_ns - entry.changed_ns < entry.wait_ns) continue;
    entry.changed_ns = kTimeMax;
    // It came and went: the block may be another log's.
    if (!entry.is_there && !entry.is_told_there) continue;
    (entry.is_there ? due.written : due.removed).push_back(index);
    entry.is_told_there = entry.is_there;
    entry.wait_ns = std::min(2 * entry.wait_ns, wait_max_ns_);
  }
  return due;
}

}  // namespace dsg::ingest
