// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "ingest/evaluation/evaluate.h"

namespace dsg::evaluation {
namespace {

using Json = nlohmann::json;

const std::map<std::string, std::vector<std::string>>& Names() {
  static const std::map<std::string, std::vector<std::string>> names = {
      {"/trajectory", {"ate_m", "ate_4dof_m", "coverage", "ate_smoothed_m"}},
      {"/mesh", {"rmse_m", "rmse_no_icp_m", "completeness", "ghost_m2", "miou"}},
      {"/humans", {"raw_m", "filtered_m", "tracked_m", "idf1"}},
      {"/objects/unknown", {"mean_error_m", "found_ratio", "f1"}},
      {"/objects/known", {"mean_error_m", "mean_yaw_deg", "found_ratio"}},
      {"/places", {"collision_free_ratio", "coverage", "stretch_median"}},
      {"/rooms",
       {"precision", "recall", "precision_outside_doors", "recall_outside_doors", "count",
        "adjacency_f1"}},
      {"/picks", {"precision", "recall", "brier"}}};
  return names;
}

TEST(Report, HasNullForEverythingThatWasNotBuilt) {
  const Report report = Evaluate(Estimate(), truth::Truth(), {}, {});
  const Json json = Json::parse(ReportToJson(report));
  for (const auto& [path, names] : Names()) {
    const Json& part = json.at(Json::json_pointer(path));
    for (const std::string& name : names) {
      ASSERT_TRUE(part.contains(name)) << path << "/" << name;
      EXPECT_TRUE(part.at(name).is_null()) << path << "/" << name << " is " << part.at(name);
    }
  }
  EXPECT_EQ(json.at("rooms").at("count_truth"), 0);
}

TEST(Report, PutsEachFigureUnderItsName) {
  Report report;
  report.trajectory.causal = AteResult{0.12, 0.1, 0.3};
  report.trajectory.causal_4dof = AteResult{0.13, 0.1, 0.3};
  report.trajectory.smoothed = AteResult{0.05, 0.04, 0.1};
  report.trajectory.coverage = 0.5;
  report.mesh.rmse_m = 0.06;
  report.humans.tracked_m = 0.65;
  report.rooms.of_places = {0.9989, 0.9984};
  report.rooms.count = 5;
  const Json json = Json::parse(ReportToJson(report));
  EXPECT_EQ(json["trajectory"]["ate_m"], 0.12);
  EXPECT_EQ(json["trajectory"]["ate_4dof_m"], 0.13);
  EXPECT_EQ(json["trajectory"]["ate_smoothed_m"], 0.05);
  EXPECT_EQ(json["mesh"]["rmse_m"], 0.06);
  EXPECT_EQ(json["humans"]["tracked_m"], 0.65);
  EXPECT_EQ(json["rooms"]["count"], 5);
}

TEST(Report, PrintsThePapersUnitsAndADashForNothing) {
  Report report;
  report.trajectory.causal = AteResult{0.12, 0.1, 0.3};
  report.trajectory.coverage = 0.5;
  report.rooms.of_places = {0.9989, 0.9984};
  const std::string text = ReportToText(report);
  EXPECT_NE(text.find("ATE causal                               12.0"), std::string::npos) << text;
  EXPECT_NE(text.find("FAILED"), std::string::npos) << text;
  EXPECT_NE(text.find("99.89 / 99.84"), std::string::npos) << text;
  EXPECT_NE(text.find("Brier score                                 -"), std::string::npos) << text;
}

}  // namespace
}  // namespace dsg::evaluation
