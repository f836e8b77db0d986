// SPDX-License-Identifier: Apache-2.0
// dsg-align: where one map of a store is in another one, by the places that robots of both
// remember. Refuses to change anything; dsg merge takes what it prints.

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ingest/alignment/map_alignment.h"
#include "ingest/config/option_flags.h"
#include "ingest/program/progress.h"
#include "schema/base/status.h"
#include "schema/program/command_line.h"
#include "schema/program/manual.h"
#include "schema/store/graph_store.h"

namespace dsg::ingest {
namespace {

struct Flags {
  std::string store;
  std::string map;
  std::string other;
  bool is_json = false;
  bool is_quiet = false;
  MapAlignmentOptions options;
};

void AddFlags(CLI::App* app, Flags* flags) {
  app->set_version_flag("--version", DSG_VERSION);
  app->add_option("MAP", flags->map, "The map that stays as it is")->required();
  app->add_option("OTHER", flags->other, "The map whose place in it is sought")->required();
  app->add_option("--store", flags->store, "Folder of the store")->envname("DSG_STORE")->required();
  app->add_flag("--json", flags->is_json, "Print JSON instead of the transform alone");
  app->add_flag("--quiet", flags->is_quiet, "No progress, and no line on stderr that explains");
  UseShortHelp(app);
  const OptionGroup group{"places seen in both", flags->options.Bind()};
  AddTuning({&group, 1}, app);
}

double HeadingOf(const Pose3d& pose) {
  return 2.0 * std::atan2(pose.orientation.z(), pose.orientation.w());
}

std::string ToJson(const MapAlignment& alignment) {
  const SessionAlignment& found = alignment.found;
  const Eigen::Vector3d& shift = found.map_T_other.position;
  nlohmann::ordered_json json;
  json["transform"] = {shift.x(), shift.y(), shift.z(), HeadingOf(found.map_T_other)};
  json["position_sigma_m"] = found.position_sigma_m;
  json["heading_sigma_rad"] = found.turn_sigma_rad;
  json["residual_m"] = found.residual_m;
  json["views"] = found.tie_count;
  json["agreeing_views"] = found.agree_count;
  json["keyframes"] = alignment.keyframe_count;
  json["other_keyframes"] = alignment.other_keyframe_count;
  return json.dump(2) + "\n";
}

// In the form of dsg merge --transform.
std::string ToTransform(const Pose3d& pose) {
  const Eigen::Vector3d& shift = pose.position;
  return absl::StrFormat("%.4f,%.4f,%.4f,%.6f\n", shift.x(), shift.y(), shift.z(), HeadingOf(pose));
}

void Explain(const Flags& flags, const MapAlignment& alignment) {
  const SessionAlignment& found = alignment.found;
  std::fputs(
      absl::StrFormat(
          "%d of %d views of %s that show places of %s agree within %.2f m, and the transform is "
          "good to %.2f m and %.1f degrees; next: dsg merge --store %s --map %s %s --transform=%s",
          found.agree_count, found.tie_count, flags.other, flags.map, found.residual_m,
          found.position_sigma_m, found.turn_sigma_rad * 180.0 / M_PI, flags.store, flags.map,
          flags.other, ToTransform(found.map_T_other))
          .c_str(),
      stderr);
}

absl::Status Align(Flags& flags) {
  DSG_RETURN_IF_ERROR(ValidateFields(flags.options.Bind()));
  if (flags.map == flags.other) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("MAP and OTHER are both \"", flags.map, "\"; name two maps"),
                     {{"field", "OTHER"}, {"value", flags.other}});
  }
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(flags.store, {}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(flags.map));
  DSG_ASSIGN_OR_RETURN(const auto other, store->OpenMap(flags.other));
  DSG_ASSIGN_OR_RETURN(const auto snapshot, map->Latest());
  DSG_ASSIGN_OR_RETURN(const auto other_snapshot, other->Latest());
  MapAlignment alignment;
  {
    Progress progress(flags.other, 0, flags.is_quiet);
    const auto tell = [&progress](int64_t done, int64_t total) {
      progress.Update("places sought", done, total);
    };
    DSG_ASSIGN_OR_RETURN(alignment,
                         AlignMaps({flags.map, snapshot.get()}, {flags.other, other_snapshot.get()},
                                   flags.options, tell));
  }
  if (!flags.is_quiet) Explain(flags, alignment);
  const std::string out =
      flags.is_json ? ToJson(alignment) : ToTransform(alignment.found.map_T_other);
  if (std::fwrite(out.data(), 1, out.size(), stdout) != out.size() || std::fflush(stdout) != 0) {
    return absl::UnavailableError("cannot write the transform to standard output");
  }
  return absl::OkStatus();
}

int AlignMain(int argc, char** argv) {
  CLI::App app("dsg-align: finds where a map is in another one from places that both have seen",
               "dsg-align");
  Flags flags;
  AddFlags(&app, &flags);
  AddManual(&app, DSG_VERSION);
  return RunProgram(argc, argv, &app, [&] { return Align(flags); });
}

}  // namespace
}  // namespace dsg::ingest

int main(int argc, char** argv) { return dsg::ingest::AlignMain(argc, argv); }
