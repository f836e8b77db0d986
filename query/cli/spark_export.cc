// SPDX-License-Identifier: Apache-2.0
#include "query/cli/spark_export.h"

#include <utility>

#include "query/cli/progress.h"
#include "query/cli/table.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"
#include "schema/interop/map_to_spark.h"

namespace dsg::cli {
namespace {

// Shares of the time that it all takes, roughly.
constexpr double kConverted = 0.6;

MapContents ContentsOf(MapContent content) {
  MapContents map;
  map.spec = std::move(content.spec);
  map.revision = content.revision;
  map.layers = std::move(content.layers);
  map.nodes = std::move(content.nodes);
  map.edges = std::move(content.edges);
  map.mesh = std::move(content.mesh);
  for (Track& track : content.tracks) map.tracks.push_back({track.agent, std::move(track.poses)});
  return map;
}

}  // namespace

std::optional<SparkForm> SparkFormOf(const std::string& path) {
  if (path.ends_with(".json")) return SparkForm::kJson;
  if (path.ends_with(".sparkdsg") || path.ends_with(".bin")) return SparkForm::kBinary;
  return std::nullopt;
}

absl::StatusOr<Written> WriteSparkExport(MapContent content, const ExportVerb& verb,
                                         std::ostream* progress_out) {
  Progress progress("export to Spark-DSG", progress_out);
  const SparkForm form = SparkFormOf(verb.spark).value_or(SparkForm::kJson);
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(verb.spark, verb.force));
  DSG_ASSIGN_OR_RETURN(const SparkExport made, MapToSpark(ContentsOf(std::move(content)),
                                                          {.distance_m = verb.pose_step_m}));
  progress.Update(kConverted);
  DSG_RETURN_IF_ERROR(
      WriteSpark(made.graph, form, [&file](std::string_view bytes) { return file.Write(bytes); }));
  DSG_RETURN_IF_ERROR(file.Commit());
  for (const std::string& note : made.notes) *progress_out << "note: " << Printable(note) << "\n";
  const MeshBlock mesh = made.graph.mesh.value_or(MeshBlock());
  return Written{.format = form == SparkForm::kJson ? "spark-json" : "spark-binary",
                 .path = verb.spark,
                 .byte_count = file.byte_count(),
                 .counts = {{"nodes", static_cast<int64_t>(made.graph.nodes.size())},
                            {"edges", static_cast<int64_t>(made.graph.edges.size())},
                            {"poses", made.pose_count},
                            {"vertices", static_cast<int64_t>(mesh.positions_map.size())},
                            {"faces", static_cast<int64_t>(mesh.faces.size())}}};
}

}  // namespace dsg::cli
