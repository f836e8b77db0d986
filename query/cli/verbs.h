// SPDX-License-Identifier: Apache-2.0
// One function a verb: asks, then writes the answer to `out`, as text or JSON.
// A verb's error is its status; nothing is written to `out` then.
#pragma once

#include <ostream>

#include "absl/status/status.h"
#include "query/cli/arguments.h"
#include "query/cli/session.h"

namespace dsg::cli {

// Agents: verbs_agents.cc. Requires: the session's map is chosen.
absl::Status RunWhere(Session* session, const WhereVerb& verb, std::ostream& out);
absl::Status RunTrack(Session* session, const TrackVerb& verb, std::ostream& out);
absl::Status RunWho(Session* session, const WhoVerb& verb, std::ostream& out);

/// Lists the body shapes of an agent, or writes them as mesh files (verb_shape.cc).
///
/// Errors: FIELD_INVALID for a file that is there already; NOT_FOUND when there is no body to
/// write; RESOURCE_EXHAUSTED/DISK_FULL, and then the last file is not there.
absl::Status RunShape(Session* session, const ShapeVerb& verb, std::ostream& out);

// Of one RPC each: verb_met.cc, verb_picked.cc, verb_predict.cc, verb_find.cc, verb_path.cc.
// With --png they also draw the answer. Errors: of the RPC; FIELD_INVALID for a picture that is
// there already; RESOURCE_EXHAUSTED/DISK_FULL. Requires: the session's map is chosen.
absl::Status RunMet(Session* session, const MetVerb& verb, std::ostream& out);
absl::Status RunPicked(Session* session, const PickedVerb& verb, std::ostream& out);
absl::Status RunPredict(Session* session, const PredictVerb& verb, std::ostream& out);
absl::Status RunFind(Session* session, const FindVerb& verb, std::ostream& out);
absl::Status RunPath(Session* session, const PathVerb& verb, std::ostream& out);
/// `is_hit`: the body touches something (verb_collide.cc).
absl::Status RunCollide(Session* session, const CollideVerb& verb, std::ostream& out, bool* is_hit);

// Nodes and edges: verbs_graph.cc, verbs_around.cc. Requires: the session's map is chosen.
absl::Status RunList(Session* session, const ListVerb& verb, std::ostream& out);
absl::Status RunEdges(Session* session, const EdgesVerb& verb, std::ostream& out);
absl::Status RunShow(Session* session, const ShowVerb& verb, std::ostream& out);
absl::Status RunNear(Session* session, const NearVerb& verb, std::ostream& out);
absl::Status RunAround(Session* session, const AroundVerb& verb, std::ostream& out);
absl::Status RunSubgraph(Session* session, const SubgraphVerb& verb, std::ostream& out);

/// What differs between two revisions (verb_diff.cc).
absl::Status RunDiff(Session* session, const DiffVerb& verb, std::ostream& out);
/// Prints revisions as they come, until SIGINT, SIGTERM or the count (verb_watch.cc). Goes on over
/// a restart of the server, and says so on `notes`. Errors: of WatchMap, UNAVAILABLE after a minute
/// without the server; DEADLINE_EXCEEDED after --timeout.
absl::Status RunWatch(Session* session, const WatchVerb& verb, std::ostream& out,
                      std::ostream& notes);

/// Takes another map into the session's (verb_merge.cc).
///
/// Errors: of MergeMaps; FIELD_INVALID for a transform that is none, or a picture that is there
/// already; RESOURCE_EXHAUSTED/DISK_FULL.
absl::Status RunMerge(Session* session, const MergeVerb& verb, std::ostream& out,
                      std::ostream& progress_out);
/// Forgets what the policies name (verb_prune.cc). Errors: of Prune; FILE_MALFORMED for a file of
/// policies; POLICY_MATCHES_ALL when nobody could be asked, or said no.
absl::Status RunPrune(Session* session, const PruneVerb& verb, std::ostream& out,
                      std::ostream& progress);

// Maps: verbs_maps.cc. RunLog and RunStats require that the session's map is chosen.
absl::Status RunLog(Session* session, std::ostream& out);
absl::Status RunStats(Session* session, std::ostream& out);
absl::Status RunMaps(Session* session, std::ostream& out);
/// Opens a session only if a server is named.
absl::Status RunVersion(const CommonOptions& common, const Environment& environment,
                        std::ostream& out);

// Files to look at: verbs_export.cc. Require that the session's map is chosen.

/// Writes all of the map as an archive, or mesh and graph as PLY or glTF.
///
/// Errors: FIELD_INVALID for a file that is there already; RESOURCE_EXHAUSTED/DISK_FULL, and then
/// nothing stands under the file's name.
absl::Status RunExport(Session* session, const ExportVerb& verb, std::ostream& out,
                       std::ostream& progress);
/// The part of RunExport that writes an archive (verb_export_archive.cc).
absl::Status RunExportArchive(Session* session, const ExportVerb& verb, std::ostream& out,
                              std::ostream& progress);
/// Draws the map from above. Errors: as RunExport; NOT_FOUND/NODE_UNKNOWN for the floor.
absl::Status RunMap(Session* session, const MapVerb& verb, std::ostream& out);

/// Commits a scene-graph file to a map of a store, both made if missing. The same file again adds
/// nothing; an interrupted import goes on where it stopped.
///
/// Errors: NOT_FOUND without the file; INVALID_ARGUMENT/FILE_MALFORMED; as GraphWriter::Commit.
absl::Status RunImport(const CommonOptions& common, const ImportVerb& verb, std::ostream& out,
                       std::ostream& progress);

/// Checks a whole map of a store, an archive or a backup, the problems listed on `out`.
///
/// Errors: DATA_LOSS/STORE_CORRUPT if there is any problem.
absl::Status RunVerify(const CommonOptions& common, const VerifyVerb& verb, std::ostream& out,
                       std::ostream& progress);

/// Brings maps of a store to the newest format, a copy of the old file beside each.
///
/// Errors: as GraphStore::UpgradeMap; the maps before the failing one are upgraded.
absl::Status RunUpgrade(const CommonOptions& common, std::ostream& out);

// Keeping maps for years: verbs_keep.cc. Require that the session's map is chosen. Errors: of the
// RPCs. Ctrl-C ends the work; what was told to `progress` is done, and the same verb does the rest.
absl::Status RunTag(Session* session, const TagVerb& verb, std::ostream& out);
absl::Status RunCompact(Session* session, const CompactVerb& verb, std::ostream& out,
                        std::ostream& progress);
absl::Status RunRevert(Session* session, const RevertVerb& verb, std::ostream& out,
                       std::ostream& progress);

/// Writes archives of maps to a folder (verb_backup.cc). Until it returns OK the folder is the
/// backup that it was. The session needs no map.
///
/// Errors: as BackupFolder::Open, of ReadArchive; RESOURCE_EXHAUSTED/DISK_FULL.
absl::Status RunBackup(Session* session, const BackupVerb& verb, std::ostream& out,
                       std::ostream& progress);
/// Puts the maps of a backup, or one archive, into a store (verb_restore.cc).
///
/// Errors: as RestoreArchive, and then the map is as it was.
absl::Status RunRestore(const CommonOptions& common, const RestoreVerb& verb, std::ostream& out,
                        std::ostream& progress);

}  // namespace dsg::cli
