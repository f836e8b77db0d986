// SPDX-License-Identifier: Apache-2.0
// The record of a revision: who committed what, the sums over all rows that it shows, and the
// digest that seals both to the revision before.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "schema/model/graph_delta.h"
#include "schema/model/revision.h"
#include "schema/store/content_rows.h"
#include "schema/store/snapshot.h"

namespace dsg {

/// Revision 0, the empty map, is a record that says nothing.
struct RevisionRecord {
  /// Its counts are those of `sums` as of the last Seal.
  RevisionInfo info;
  RowSums sums;
  /// Of all tracks.
  std::optional<TimeNs> first_pose_ns;
  std::optional<TimeNs> last_pose_ns;
};

/// Copies the counts of `sums` into `info`.
void FillCounts(RevisionRecord* record);

/// "layer:count" separated by spaces, without those that are 0: as digests and rows have it.
std::string FormatLayerCounts(const std::map<LayerId, int64_t>& counts);
/// False if the text is not what FormatLayerCounts writes.
bool ParseLayerCounts(std::string_view text, std::map<LayerId, int64_t>* counts);

/// What a revision's digest must be. Times of commits are left out, so that the same log gives the
/// same digests everywhere. Requires: counts are filled.
Sha256 DigestOf(const Sha256& parent, const RevisionRecord& record);

/// Fills the counts and the digest, once all rows are counted. `parent` is the digest of the
/// revision before; zeros for the first.
void Seal(const Sha256& parent, RevisionRecord* record);

/// The record that a commit of `delta` on top of `head` begins with, its rows not yet counted.
RevisionRecord NextRecord(const RevisionRecord& head, const GraphDelta& delta, TimeNs now_ns);

/// What a record says of its map, but for layers and bytes.
MapStats StatsOf(const RevisionRecord& record, const std::vector<Layer>& layers);

}  // namespace dsg
