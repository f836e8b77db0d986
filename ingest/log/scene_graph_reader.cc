// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/scene_graph_file.h"

#include "absl/strings/str_cat.h"
#include "ingest/log/readers.h"
#include "ingest/log/track_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {

OpenedLog ReadSceneGraphLog(const LogFile& file, const LogOptions& options) {
  DSG_ASSIGN_OR_RETURN(ImportedGraph graph,
                       ReadSceneGraph(file.bytes, file.path, options.mesh_block_size_m,
                                      {.is_strict = options.is_strict}));
  if (options.format != "auto" && options.format != graph.format) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(file.path, ": is a ", graph.format, " file, not ", options.format,
                                  "; leave --format out, or name ", graph.format),
                     {{"file", file.path}, {"format", graph.format}});
  }
  for (Node& node : graph.delta.nodes) {
    if (IsAgentKind(node.kind)) node.name = options.agent_prefix + node.name;
  }
  LogInfo info = DescribeLog(graph.format, file);
  info.has_clock = graph.first_ns != 0;
  info.first_ns = graph.first_ns;
  info.clock = ClockOf(graph.first_ns);
  info.notes = std::move(graph.notes);
  for (const Skipped& skipped : graph.skipped) info.notes.push_back(ToString(skipped));
  TrackTable no_tracks;
  no_tracks.file = file.path;
  return MakeTrackLog(std::move(no_tracks), GraphMeasurement{std::move(graph.delta)},
                      std::move(info));
}

}  // namespace dsg::ingest
