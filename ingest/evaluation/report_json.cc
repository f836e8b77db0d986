// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "ingest/evaluation/report.h"

namespace dsg::evaluation {
namespace {

using Json = nlohmann::ordered_json;

template <typename T>
Json OrNull(const std::optional<T>& value) {
  return value.has_value() ? Json(*value) : Json(nullptr);
}

Json Rmse(const std::optional<AteResult>& ate) {
  return ate.has_value() ? Json(ate->rmse_m) : Json(nullptr);
}

Json TrajectoryJson(const TrajectoryResult& result) {
  Json out = {{"ate_m", Rmse(result.causal)},
              {"ate_4dof_m", Rmse(result.causal_4dof)},
              {"coverage", OrNull(result.coverage)},
              {"ate_smoothed_m", Rmse(result.smoothed)},
              {"ate_smoothed_4dof_m", Rmse(result.smoothed_4dof)},
              {"ate_unaligned_m", Rmse(result.causal_unaligned)},
              {"ate_median_m", nullptr},
              {"ate_max_m", nullptr},
              {"rpe", Json::array()}};
  if (result.causal.has_value()) {
    out["ate_median_m"] = result.causal->median_m;
    out["ate_max_m"] = result.causal->max_m;
  }
  for (const RpeResult& rpe : result.rpe) {
    out["rpe"].push_back({{"length_m", rpe.length_m},
                          {"translation_percent", rpe.translation_percent},
                          {"rotation_deg_per_m", rpe.rotation_deg_per_m},
                          {"segment_count", rpe.segment_count}});
  }
  return out;
}

Json ClassesJson(const Report& report) {
  Json out = Json::array();
  for (const auto& [label, score] : report.mesh.class_iou) {
    const auto name = report.class_names.find(label);
    out.push_back(
        {{"class", name == report.class_names.end() ? std::to_string(label) : name->second},
         {"iou", score.iou},
         {"truth_m2", score.truth_m2}});
  }
  return out;
}

Json MeshJson(const Report& report) {
  const MeshResult& result = report.mesh;
  return {{"rmse_m", OrNull(result.rmse_m)},
          {"rmse_no_icp_m", OrNull(result.rmse_no_icp_m)},
          {"completeness", OrNull(result.completeness)},
          {"ghost_m2", OrNull(result.ghost_m2)},
          {"miou", OrNull(result.miou)},
          {"class_iou", result.miou.has_value() ? ClassesJson(report) : Json()},
          {"rmse_samples_m", OrNull(result.rmse_samples_m)},
          {"icp_inlier_share", result.rmse_m.has_value() ? Json(result.icp_inlier_share) : Json()},
          {"stray_m2", OrNull(result.stray_m2)},
          {"area_m2", result.ghost_m2.has_value() ? Json(result.area_m2) : Json()}};
}

Json HumansJson(const HumanResult& result) {
  const bool is_tracked = result.idf1.has_value();
  return {{"raw_m", OrNull(result.raw_m)},
          {"filtered_m", OrNull(result.filtered_m)},
          {"tracked_m", OrNull(result.tracked_m)},
          {"idf1", OrNull(result.idf1)},
          {"mota", OrNull(result.mota)},
          {"id_switches", is_tracked ? Json(result.id_switch_count) : Json()},
          {"tracks_per_human", OrNull(result.tracks_per_human)},
          {"joint_root_m", OrNull(result.joint_root_m)},
          {"joint_m", OrNull(result.joint_m)},
          {"joint_body_count", result.joint_body_count},
          {"vertex_root_m", OrNull(result.vertex_root_m)},
          {"vertex_m", OrNull(result.vertex_m)},
          {"vertex_body_count", result.vertex_body_count},
          {"detection_count", result.detection_count},
          {"filtered_count", result.filtered_count},
          {"scored_pose_count", result.scored_pose_count},
          {"unexplained_pose_count", result.unexplained_pose_count}};
}

Json ScoreJson(const ObjectScore& score, bool is_known) {
  Json out = {{"mean_error_m", OrNull(score.mean_error_m)}};
  if (is_known) out["mean_yaw_deg"] = OrNull(score.mean_yaw_deg);
  out["mean_ungated_m"] = OrNull(score.mean_ungated_m);
  out["found_ratio_ungated"] = OrNull(score.found_ratio_ungated);
  out["found_ratio"] = OrNull(score.found_ratio);
  out["f1"] = OrNull(score.f1);
  out["precision"] = OrNull(score.precision);
  out["match_count"] = score.match_count;
  out["truth_count"] = score.truth_count;
  return out;
}

Json RelationsJson(const RelationResult& result) {
  Json out = Json::object();
  for (const auto& [relation, score] : result) {
    out[relation] = {{"precision", OrNull(score.precision)},
                     {"recall", OrNull(score.recall)},
                     {"recall_between_found", OrNull(score.recall_between_found)},
                     {"estimate_count", score.estimate_count},
                     {"truth_count", score.truth_count},
                     {"between_found_count", score.between_found_count}};
  }
  return out;
}

Json PicksJson(const PickResult& result) {
  return {{"precision", OrNull(result.precision)},
          {"recall", OrNull(result.recall)},
          {"brier", OrNull(result.brier)},
          {"truth_count", result.truth_count},
          {"mapped_count", result.mapped_count},
          {"noticed_count", result.noticed_count},
          {"sure_count", result.sure_count},
          {"right_count", result.right_count},
          {"prediction_count", result.prediction_count}};
}

Json PlacesJson(const PlaceResult& result) {
  return {{"collision_free_ratio", OrNull(result.collision_free_ratio)},
          {"coverage", OrNull(result.coverage)},
          {"stretch_median", OrNull(result.stretch_median)},
          {"connectivity", OrNull(result.connectivity)},
          {"places_per_100_m2", OrNull(result.per_100_m2)}};
}

Json RoomsJson(const RoomResult& result) {
  return {{"precision", OrNull(result.of_places.precision)},
          {"recall", OrNull(result.of_places.recall)},
          {"precision_outside_doors", OrNull(result.outside_doors.precision)},
          {"recall_outside_doors", OrNull(result.outside_doors.recall)},
          {"count", OrNull(result.count)},
          {"count_truth", result.count_truth},
          {"adjacency_f1", OrNull(result.adjacency_f1)},
          {"precision_volumetric", OrNull(result.volumetric.precision)},
          {"recall_volumetric", OrNull(result.volumetric.recall)},
          {"precision_one_to_one", OrNull(result.one_to_one.precision)},
          {"recall_one_to_one", OrNull(result.one_to_one.recall)}};
}

}  // namespace

std::string ReportToJson(const Report& report) {
  Json out = {{"map", report.map},
              {"revision", report.revision},
              {"world", report.world},
              {"seed", report.seed}};
  out["trajectory"] = TrajectoryJson(report.trajectory);
  out["mesh"] = MeshJson(report);
  out["humans"] = HumansJson(report.humans);
  out["objects"] = {{"unknown", ScoreJson(report.objects.unknown, false)},
                    {"known", ScoreJson(report.objects.known, true)},
                    {"merge_rate", OrNull(report.objects.merge_rate)},
                    {"split_rate", OrNull(report.objects.split_rate)}};
  out["places"] = PlacesJson(report.places);
  out["rooms"] = RoomsJson(report.rooms);
  out["relations"] = RelationsJson(report.relations);
  out["picks"] = PicksJson(report.picks);
  out["notes"] = report.notes;
  // Map names are ASCII, but a world's name comes from a file.
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace dsg::evaluation
