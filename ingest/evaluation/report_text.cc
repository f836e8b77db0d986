// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ingest/evaluation/report.h"

namespace dsg::evaluation {
namespace {

// "-" for what was not built.
std::string Cell(const std::optional<double>& value, double scale = 1.0, int decimals = 3) {
  if (!value.has_value()) return "-";
  return absl::StrFormat("%.*f", decimals, scale * *value);
}

std::string Percent(const std::optional<double>& value) { return Cell(value, 100.0, 1); }

std::optional<double> RmseOf(const std::optional<AteResult>& ate) {
  return ate.has_value() ? std::optional(ate->rmse_m) : std::nullopt;
}

void Row(std::string* out, const std::string& name, const std::string& value,
         const std::string& remark = "") {
  absl::StrAppend(out, absl::StrFormat("  %-34s %10s", name, value),
                  remark.empty() ? "" : "   " + remark, "\n");
}

void AppendTrajectory(const TrajectoryResult& result, std::string* out) {
  absl::StrAppend(out, "Trajectory (Table I; cm)\n");
  const auto ate = [out](const char* name, const std::optional<AteResult>& value,
                         const std::string& alignment) {
    Row(out, name, Cell(RmseOf(value), 100.0, 1), alignment);
  };
  ate("ATE causal", result.causal, "aligned by SE(3)");
  ate("ATE causal, 4-DoF", result.causal_4dof, "aligned by yaw and translation");
  ate("ATE causal, unaligned", result.causal_unaligned, "");
  ate("ATE smoothed", result.smoothed, "aligned by SE(3)");
  ate("ATE smoothed, 4-DoF", result.smoothed_4dof, "aligned by yaw and translation");
  const bool is_failed = result.coverage.has_value() && *result.coverage < kCoverageMin;
  Row(out, "coverage (%)", Percent(result.coverage), is_failed ? "FAILED: below 95 %" : "");
  for (const RpeResult& rpe : result.rpe) {
    Row(out, absl::StrFormat("RPE over %.0f m (%%)", rpe.length_m),
        absl::StrFormat("%.2f", rpe.translation_percent),
        absl::StrFormat("%.3f deg/m, %d segments", rpe.rotation_deg_per_m, rpe.segment_count));
  }
}

void AppendMesh(const MeshResult& result, std::string* out) {
  absl::StrAppend(out, "Mesh (Table II; m)\n");
  Row(out, "RMSE after ICP, gate 1.5 m", Cell(result.rmse_m),
      result.rmse_m.has_value()
          ? absl::StrFormat("%.1f %% of the vertices", 100.0 * result.icp_inlier_share)
          : "");
  Row(out, "RMSE after ICP, to samples", Cell(result.rmse_samples_m));
  Row(out, "RMSE without ICP or gate", Cell(result.rmse_no_icp_m));
  Row(out, "completeness within 0.1 m (%)", Percent(result.completeness));
  Row(out, "ghost surface (m^2)", Cell(result.ghost_m2, 1.0, 2));
  Row(out, "mean class IoU (%)", Percent(result.miou));
}

void AppendHumans(const HumanResult& result, std::string* out) {
  absl::StrAppend(out, "People (Table III; m)\n");
  Row(out, "raw detections, mean over people", Cell(result.raw_m, 1.0, 2));
  Row(out, "filtered detections", Cell(result.filtered_m, 1.0, 2),
      absl::StrFormat("%d of %d detections", result.filtered_count, result.detection_count));
  Row(out, "tracked", Cell(result.tracked_m, 1.0, 2),
      absl::StrFormat("%d poses, %d unexplained", result.scored_pose_count,
                      result.unexplained_pose_count));
  Row(out, "IDF1 (%)", Percent(result.idf1));
  Row(out, "MOTA (%)", Percent(result.mota),
      result.mota.has_value() ? absl::StrFormat("%d id switches", result.id_switch_count) : "");
  Row(out, "tracks per person", Cell(result.tracks_per_human, 1.0, 2));
  const auto body = [out](const char* name, const std::optional<double>& root_m,
                          const std::optional<double>& map_m, int64_t count) {
    Row(out, absl::StrCat(name, ", against the pelvis"), Cell(root_m),
        absl::StrCat(count, " bodies"));
    Row(out, absl::StrCat(name, ", in the map"), Cell(map_m));
  };
  body("joints", result.joint_root_m, result.joint_m, result.joint_body_count);
  if (result.vertex_body_count > 0) {
    body("vertices", result.vertex_root_m, result.vertex_m, result.vertex_body_count);
  }
}

void AppendObjects(const ObjectResult& result, std::string* out) {
  absl::StrAppend(out, "Objects (Table III; m)\n");
  const auto kind = [out](const std::string& name, const ObjectScore& score) {
    Row(out, name + " shape, error", Cell(score.mean_error_m, 1.0, 2),
        absl::StrFormat("%d of %d", score.match_count, score.truth_count));
    Row(out, name + " shape, error, no gate", Cell(score.mean_ungated_m, 1.0, 2),
        absl::StrCat("found ", Percent(score.found_ratio_ungated), " %"));
    Row(out, name + " shape, found (%)", Percent(score.found_ratio));
    Row(out, name + " shape, precision (%)", Percent(score.precision));
    Row(out, name + " shape, F1 (%)", Percent(score.f1));
  };
  kind("unknown", result.unknown);
  kind("known", result.known);
  Row(out, "known shape, yaw (deg)", Cell(result.known.mean_yaw_deg, 1.0, 1));
  Row(out, "merged (%)", Percent(result.merge_rate));
  Row(out, "split (%)", Percent(result.split_rate));
}

void AppendRelations(const RelationResult& result, std::string* out) {
  if (result.empty()) return;
  absl::StrAppend(out, "Relations (%; precision / recall / recall between things found)\n");
  for (const auto& [relation, score] : result) {
    Row(out, relation,
        absl::StrCat(Percent(score.precision), " / ", Percent(score.recall), " / ",
                     Percent(score.recall_between_found)),
        absl::StrFormat("%d told, %d there", score.estimate_count, score.truth_count));
  }
}

void AppendPlaces(const PlaceResult& result, std::string* out) {
  absl::StrAppend(out, "Places\n");
  Row(out, "collision-free edges (%)", Percent(result.collision_free_ratio),
      absl::StrFormat("%d edges", result.edge_count));
  Row(out, "coverage (%)", Percent(result.coverage));
  Row(out, "stretch, median", Cell(result.stretch_median));
  Row(out, "connected pairs (%)", Percent(result.connectivity),
      absl::StrFormat("%d pairs", result.pair_count));
  Row(out, "places per 100 m^2", Cell(result.per_100_m2, 1.0, 1));
}

void AppendRooms(const RoomResult& result, std::string* out) {
  absl::StrAppend(out, "Rooms (%; precision / recall)\n");
  const auto pair = [out](const char* name, const PrecisionRecall& score) {
    Row(out, name,
        absl::StrCat(Cell(score.precision, 100.0, 2), " / ", Cell(score.recall, 100.0, 2)));
  };
  pair("places", result.of_places);
  pair("places outside door bands", result.outside_doors);
  pair("volumetric", result.volumetric);
  pair("places, one to one", result.one_to_one);
  Row(out, "rooms found / there",
      absl::StrCat(result.count.has_value() ? absl::StrCat(*result.count) : "-", " / ",
                   result.count_truth));
  Row(out, "adjacency F1", Percent(result.adjacency_f1));
}

void AppendPicks(const PickResult& result, std::string* out) {
  absl::StrAppend(out, "Picks\n");
  Row(out, "precision (%)", Percent(result.precision),
      absl::StrFormat("%d predictions", result.prediction_count));
  Row(out, "recall (%)", Percent(result.recall), absl::StrFormat("%d picks", result.truth_count));
  Row(out, "objects in the map / gone / named",
      absl::StrFormat("%d / %d / %d", result.mapped_count, result.noticed_count,
                      result.right_count));
  Row(out, "Brier score", Cell(result.brier));
}

}  // namespace

std::string ReportToText(const Report& report) {
  std::string out = absl::StrFormat("map %s at revision %d, against world %s of seed %d\n\n",
                                    report.map, report.revision, report.world, report.seed);
  AppendTrajectory(report.trajectory, &out);
  AppendMesh(report.mesh, &out);
  AppendHumans(report.humans, &out);
  AppendObjects(report.objects, &out);
  AppendRelations(report.relations, &out);
  AppendPlaces(report.places, &out);
  AppendRooms(report.rooms, &out);
  AppendPicks(report.picks, &out);
  for (const std::string& note : report.notes) absl::StrAppend(&out, "note: ", note, "\n");
  return out;
}

}  // namespace dsg::evaluation
