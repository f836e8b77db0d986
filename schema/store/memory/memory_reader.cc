// SPDX-License-Identifier: Apache-2.0
#include "schema/store/memory/memory_reader.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/store/memory/map_stream.h"

namespace dsg::memory {

MemoryReader::MemoryReader(std::shared_ptr<const MapRows> rows) : rows_(std::move(rows)) {
  const std::lock_guard lock(rows_->mutex);
  generation_ = rows_->generation;
}

bool MemoryReader::IsCurrent() const {
  const std::lock_guard lock(rows_->mutex);
  return rows_->generation == generation_;
}

absl::StatusOr<RevisionInfo> MemoryReader::Head() {
  const std::lock_guard lock(rows_->mutex);
  return rows_->Head().info;
}

absl::StatusOr<std::shared_ptr<const Snapshot>> MemoryReader::Latest() {
  const std::lock_guard lock(rows_->mutex);
  return MakeSnapshot(rows_, rows_->Head(), generation_, opening());
}

absl::StatusOr<std::shared_ptr<const Snapshot>> MemoryReader::At(Revision revision) {
  const std::lock_guard lock(rows_->mutex);
  DSG_RETURN_IF_ERROR(
      CheckReadable(rows_->spec.name, revision, rows_->newest(), rows_->ReadableNow()));
  RevisionRecord record;
  if (revision > 0) record = rows_->commits.at(revision).record;
  return MakeSnapshot(rows_, std::move(record), generation_, opening());
}

absl::StatusOr<Revision> MemoryReader::OldestRevision() {
  const std::lock_guard lock(rows_->mutex);
  return rows_->oldest;
}

absl::StatusOr<std::optional<PendingErasure>> MemoryReader::GetPendingErasure() {
  const std::lock_guard lock(rows_->mutex);
  if (!rows_->is_erasing) return std::optional<PendingErasure>();
  return std::optional<PendingErasure>(rows_->CountPending());
}

absl::StatusOr<std::vector<Tag>> MemoryReader::Tags() {
  const std::lock_guard lock(rows_->mutex);
  std::vector<Tag> tags;
  for (const auto& [name, tag] : rows_->tags) tags.push_back(tag);
  return tags;
}

absl::StatusOr<std::vector<RevisionInfo>> MemoryReader::ListRevisions(Revision before, int limit) {
  const std::lock_guard lock(rows_->mutex);
  std::vector<RevisionInfo> revisions;
  for (auto it = rows_->commits.rbegin(); it != rows_->commits.rend(); ++it) {
    if (std::ssize(revisions) >= limit) break;
    if (before <= 0 || it->first < before) revisions.push_back(it->second.record.info);
  }
  return revisions;
}

absl::StatusOr<std::vector<NodeVersion>> MemoryReader::NodeVersions(NodeId id, Revision before,
                                                                    int limit) {
  const std::lock_guard lock(rows_->mutex);
  std::vector<NodeVersion> versions;
  rows_->nodes.ForEachOf(id, [&](const auto& version) {
    if (before > 0 && version.from >= before) return;
    versions.push_back({version.from, version.to, version.value.node});
  });
  std::reverse(versions.begin(), versions.end());
  versions.resize(std::min(versions.size(), static_cast<size_t>(std::max(limit, 0))));
  return versions;
}

absl::StatusOr<Touched> MemoryReader::TouchedBetween(Revision after, Revision until,
                                                     const StopCheck& stop) {
  const std::lock_guard lock(rows_->mutex);
  const Readable readable = rows_->ReadableNow();
  for (const Revision end : {after, until}) {
    DSG_RETURN_IF_ERROR(CheckReadable(rows_->spec.name, end, rows_->newest(), readable));
  }
  Touched touched;
  if (after >= until) return touched;
  if (rows_->generation != generation_) return RewrittenError(rows_->spec.name);
  TouchedKeys keys;
  for (const auto& [revision, commit] : rows_->commits) {
    if (revision <= after || revision > until) continue;
    DSG_RETURN_IF_ERROR(AskStop(stop));
    // Only the first one that is left has no list, and nothing readable is before it.
    keys.Add(*commit.touched);
  }
  keys.Normalize();
  std::map<int64_t, std::string> name_of;
  for (const auto& [name, number] : rows_->relations) name_of[number] = name;
  for (const EdgeRowKey& edge : keys.edges) {
    touched.edges.push_back({edge.source, name_of.at(edge.relation), edge.target});
  }
  std::sort(touched.edges.begin(), touched.edges.end());
  for (const NodeId agent : keys.tracks) {
    const auto track = rows_->tracks.find(agent);
    bool is_corrected = false;
    if (track != rows_->tracks.end()) {
      track->second.ForEach([&](TimeNs, const Track::Version& pose) {
        is_corrected |= pose.from <= after && after < pose.to && pose.to <= until;
      });
    }
    if (is_corrected) touched.corrected_tracks.push_back(agent);
  }
  touched.nodes = std::move(keys.nodes);
  touched.tracks = std::move(keys.tracks);
  touched.mesh_blocks = std::move(keys.mesh_blocks);
  touched.layers_or_labels = keys.layers_or_labels;
  return touched;
}

absl::StatusOr<SessionState> MemoryReader::GetSession(const std::string& session_id) {
  const std::lock_guard lock(rows_->mutex);
  const auto found = rows_->sessions.find(session_id);
  return found == rows_->sessions.end() ? SessionState() : found->second.state;
}

// Memory is not damaged, so what is found is a fault of the program.
absl::StatusOr<VerifyReport> MemoryReader::Verify(const StopCheck& stop,
                                                  const std::function<void(double)>& progress) {
  const std::lock_guard lock(rows_->mutex);
  DSG_RETURN_IF_ERROR(AskStop(stop));
  VerifyReport report;
  report.revision_count = std::ssize(rows_->commits);
  rows_->nodes.ForEach([&](NodeId, const auto&) { ++report.row_count; });
  rows_->edges.ForEach([&](const EdgeKey& key, const auto& edge) {
    ++report.row_count;
    const bool has_ends = rows_->nodes.Current(key.source) && rows_->nodes.Current(key.target);
    if (edge.is_current() && !has_ends) {
      report.problems.push_back(absl::StrCat("edge ", ToString(key.source), " ",
                                             ToString(key.target), ": an end does not exist"));
    }
  });
  for (const auto& [agent, track] : rows_->tracks) {
    track.ForEach([&](TimeNs, const Track::Version&) { ++report.pose_count; });
  }
  if (rows_->is_erasing) report.notes.push_back(PendingErasureNote(rows_->CountPending()));
  const std::map<Revision, RowSums> changes = rows_->SumChanges();
  auto change = changes.begin();
  RowSums sums;
  for (const auto& [revision, commit] : rows_->commits) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    for (; change != changes.end() && change->first <= revision; ++change) sums += change->second;
    RevisionRecord record = commit.record;
    record.sums = sums;
    Seal(commit.parent, &record);
    // The stored record has counts of its own.
    const Sha256& digest = commit.record.info.digest;
    if (record.info.digest != digest || DigestOf(commit.parent, commit.record) != digest) {
      report.problems.push_back(
          absl::StrCat("revision ", revision, ": its digest does not follow from its rows"));
    }
  }
  if (change != changes.end()) {
    report.problems.push_back(
        absl::StrCat("rows name revision ", change->first, ", which does not exist"));
  }
  if (progress) progress(1.0);
  return report;
}

absl::Status MemoryReader::CopyTo(const std::string& path, const StopCheck& /*stop*/,
                                  const Progress& /*progress*/) {
  return absl::UnimplementedError(
      absl::StrCat("cannot copy map \"", rows_->spec.name, "\" to ", path,
                   ": it is in memory and has no file; ingest into a store folder instead"));
}

absl::Status MemoryReader::ReadRows(const RowSink& sink, const StopCheck& stop) {
  const std::lock_guard lock(rows_->mutex);
  return StreamRows(*rows_, stop, sink);
}

}  // namespace dsg::memory
