// SPDX-License-Identifier: Apache-2.0
#include "schema/store/commit_protocol.h"

#include "absl/strings/str_cat.h"
#include "schema/codec/delta_checksum.h"
#include "schema/codec/patch.h"

namespace dsg {
namespace {

// A missing number means that a delta was lost on its way: what follows may build on it.
absl::Status CheckSequence(const CommitSource& source, const DeltaIdentity& delta) {
  DSG_ASSIGN_OR_RETURN(const SessionState session, source.ReadSession(delta.session_id));
  if (delta.sequence <= session.last_sequence + 1) return absl::OkStatus();
  const std::string& map = source.spec().name;
  return MakeError(
      Reason::kSequenceGap,
      absl::StrCat("session ", delta.session_id, " of map \"", map, "\" is at sequence ",
                   session.last_sequence, ", so the next is ", session.last_sequence + 1, ", not ",
                   delta.sequence, "; send the missing deltas first"),
      {{"map", map},
       {"session_id", delta.session_id},
       {"last_sequence", absl::StrCat(session.last_sequence)}});
}

absl::Status CheckParent(const std::string& map, Revision head, const GraphDelta& delta) {
  if (!delta.parent_revision.has_value() || *delta.parent_revision == head) {
    return absl::OkStatus();
  }
  return MakeError(
      Reason::kParentRevisionStale,
      absl::StrCat("map \"", map, "\" is at revision ", head, ", not at the delta's parent ",
                   *delta.parent_revision, "; read the head again and rebuild the delta"),
      {{"map", map}, {"head", absl::StrCat(head)}});
}

absl::Status CheckAddressee(const std::string& map, const GraphDelta& delta) {
  if (delta.map.empty() || delta.map == map) return absl::OkStatus();
  return MakeError(Reason::kDeltaInvalid,
                   absl::StrCat("delta refused: it is for map \"", delta.map,
                                "\" and was sent to map \"", map, "\""),
                   {{"map", map}});
}

// Patches change what is believed now.
absl::Status MakeWhole(const CommitSource& source, GraphDelta* delta) {
  if (delta->node_patches.empty() && delta->edge_patches.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(std::vector<Layer> layers, source.ReadLayers());
  const PatchSource stored = {
      [&](NodeId id) { return source.ReadNode(id); },
      [&](const EdgeKey& key) { return source.ReadEdge(key); },
  };
  return ApplyPatches(LayerTable(std::move(layers)), stored, delta);
}

// Of all poses that a delta brings. Requires: those of an agent ascend in time.
absl::Status CheckPosesInMap(const GraphDelta& delta, const MapSpec& spec) {
  const auto check = [&](const auto& items) -> absl::Status {
    for (const auto& item : items) {
      if (item.poses.empty()) continue;
      DSG_RETURN_IF_ERROR(CheckTimeInMap(item.poses.front().time_ns, spec));
      DSG_RETURN_IF_ERROR(CheckTimeInMap(item.poses.back().time_ns, spec));
    }
    return absl::OkStatus();
  };
  DSG_RETURN_IF_ERROR(check(delta.corrections));
  return check(delta.appends);
}

}  // namespace

absl::Status CheckTimeInMap(TimeNs time_ns, const MapSpec& spec) {
  __extension__ using Int128 = __int128;
  constexpr Int128 kMaxNs = kFromEpochYearsMax * 365 * 24 * 3600 * Int128{kNsPerSecond};
  const Int128 from_epoch_ns = static_cast<Int128>(time_ns) - spec.epoch_ns;
  if (from_epoch_ns >= -kMaxNs && from_epoch_ns <= kMaxNs) return absl::OkStatus();
  return MakeError(Reason::kTimeOutsideMap,
                   absl::StrCat("time ", time_ns, " ns is more than ", kFromEpochYearsMax,
                                " years from the epoch ", spec.epoch_ns, " ns of map \"", spec.name,
                                "\"; check the clock, or use a map with another epoch"),
                   {{"map", spec.name}, {"time_ns", absl::StrCat(time_ns)}});
}

DeltaIdentity IdentityOfDelta(const GraphDelta& delta) {
  return {delta.session_id, delta.sequence, DeltaChecksum(delta)};
}

absl::Status CheckForgetting(const GraphDelta& delta) {
  const bool brings_nothing = delta.layers.empty() && delta.labels.empty() && delta.nodes.empty() &&
                              delta.node_patches.empty() && delta.edge_patches.empty() &&
                              delta.edges.empty() && delta.appends.empty() &&
                              delta.factors.empty() && delta.shapes.empty() && delta.assets.empty();
  if (!delta.is_forgetting || brings_nothing) return absl::OkStatus();
  return MakeError(Reason::kDeltaInvalid,
                   "delta refused: it says that it forgets, and brings layers, labels, nodes, "
                   "edges, poses, factors, shapes or assets; commit these apart");
}

absl::StatusOr<std::optional<CommitResult>> FindReplay(const CommitSource& source,
                                                       const DeltaIdentity& delta) {
  DSG_ASSIGN_OR_RETURN(const auto known, source.FindCommitted(delta.session_id, delta.sequence));
  if (!known.has_value()) return std::optional<CommitResult>();
  if (!known->checksum.has_value() || *known->checksum == delta.checksum) {
    return std::optional<CommitResult>(CommitResult{known->revision, true});
  }
  const std::string& map = source.spec().name;
  return MakeError(
      Reason::kSequenceReused,
      absl::StrCat("sequence ", delta.sequence, " of session ", delta.session_id, " of map \"", map,
                   "\" was committed with other content, as revision ", known->revision,
                   ", and nothing was written now; send what is new under the session's next "
                   "sequence, or begin a session of another name"),
      {{"map", map},
       {"session_id", delta.session_id},
       {"sequence", absl::StrCat(delta.sequence)},
       {"revision", absl::StrCat(known->revision)}});
}

absl::StatusOr<std::optional<CommitResult>> PrepareCommit(const CommitSource& source,
                                                          const DeltaIdentity& identity,
                                                          Revision head, GraphDelta* delta) {
  DSG_ASSIGN_OR_RETURN(const auto replay, FindReplay(source, identity));
  if (replay.has_value()) return replay;
  const std::string& map = source.spec().name;
  DSG_RETURN_IF_ERROR(CheckSequence(source, identity));
  DSG_RETURN_IF_ERROR(CheckParent(map, head, *delta));
  DSG_RETURN_IF_ERROR(CheckAddressee(map, *delta));
  DSG_RETURN_IF_ERROR(MakeWhole(source, delta));
  Coalesce(delta);
  DSG_RETURN_IF_ERROR(CheckDelta(*delta, source));
  DSG_RETURN_IF_ERROR(CheckPosesInMap(*delta, source.spec()));
  return std::optional<CommitResult>();
}

}  // namespace dsg
