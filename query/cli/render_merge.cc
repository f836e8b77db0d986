// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_merge.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/cli/table.h"
#include "schema/codec/proto_convert.h"

namespace dsg::cli {
namespace {

std::string PoseText(const v1::Pose& pose) {
  const Pose3d plain = FromProto(pose);
  const Eigen::Vector3d x = plain.orientation * Eigen::Vector3d::UnitX();
  const double yaw_degrees = std::atan2(x.y(), x.x()) * 180.0 / std::numbers::pi;
  return absl::StrCat(Fixed(plain.position.x(), 3), ",", Fixed(plain.position.y(), 3), ",",
                      Fixed(plain.position.z(), 3), " turned by ", Fixed(yaw_degrees, 2),
                      " degrees");
}

std::string Ended(const v1::MergeMapsResponse& reply, bool is_dry_run) {
  if (is_dry_run) return "nothing was written (--dry-run)\n";
  if (reply.revision() == 0) return "nothing is new: the map has it all already\n";
  return absl::StrCat("revision ", reply.revision(), "\n");
}

// Of fewer things a wrong transform may find as many by chance.
constexpr int kFewThings = 8;
// What an estimate must do better than to be believed; see schema/merge/align.h.
constexpr double kAgreeingShareMin = 0.25;
constexpr double kBlockedShareMax = 0.15;

constexpr char kWhatToDo[] =
    "; look at both with --dry-run --png FILE, and say where it lies with --transform X,Y,Z,YAW "
    "(metres, radians)";

// Of what both maps could have seen, what both did see.
double AgreeingShare(const v1::MergeMapsResponse& plan) {
  const double agreeing = plan.agreeing_count();
  return agreeing / std::max(1.0, agreeing + 0.5 * plan.missing_count());
}

}  // namespace

std::string DoubtsOf(const v1::MergeMapsResponse& plan, const MergeAsked& asked) {
  // What brings nothing new doubles nothing.
  if (plan.added_node_count() == 0) return "";
  const std::string agreeing = Counted(plan.agreeing_count(), "thing");
  if (plan.agreeing_count() == 0) {
    return absl::StrCat("no thing of ", asked.other, " is one of ", asked.map,
                        ": they share nothing, or the transform is wrong", kWhatToDo);
  }
  if (AgreeingShare(plan) < kAgreeingShareMin) {
    return absl::StrCat("little speaks for the transform: ", agreeing, " of both maps agree, and ",
                        plan.missing_count(), " are missing where both have been", kWhatToDo);
  }
  if (plan.blocked_share() > kBlockedShareMax) {
    return absl::StrCat(
        "much speaks against the transform: of the places near walls of the other map, ",
        Fixed(100.0 * plan.blocked_share(), 0), " % stand in them", kWhatToDo);
  }
  if (asked.has_transform || plan.agreeing_count() >= kFewThings) return "";
  return absl::StrCat("the transform rests on ", agreeing, " only", kWhatToDo);
}

std::string RenderMerge(const v1::MergeMapsResponse& reply, const MergeAsked& asked) {
  const bool has_pairs = reply.fused_object_count() > 0;
  std::string text = RenderFields(
      {{"map", asked.map},
       {"other", asked.other},
       {"other lies at", PoseText(reply.map_t_other())},
       {"things agreeing", absl::StrCat(reply.agreeing_count())},
       {"they differ by",
        has_pairs ? absl::StrCat(Fixed(reply.residual_m(), 3), " m (root mean square)") : "-"}});
  Table table({{"", Align::kLeft}, {absl::StrCat("nodes of ", asked.other), Align::kRight}});
  const auto row = [&](const char* what, int64_t count) {
    table.AddRow({what, absl::StrCat(count)});
  };
  row("objects in both", reply.fused_object_count());
  row("places in both", reply.fused_place_count());
  row("rooms in both", reply.fused_room_count());
  row("structures in both", reply.fused_structure_count());
  row("added", reply.added_node_count());
  absl::StrAppend(&text, "\n", table.Render());
  if (reply.gone_count() > 0) {
    absl::StrAppend(&text, "\n", Counted(reply.gone_count(), "node"), " of ", asked.map,
                    " gone, and ", reply.moved_ids().size(), " of these moved\n");
  }
  // Blocks that were looked at for nothing are nobody's business.
  if (reply.fused_mesh_block_count() > 0 && reply.revision() > 0) {
    absl::StrAppend(&text, "\n", reply.fused_mesh_block_count(), " mesh blocks joined\n");
  }
  absl::StrAppend(&text, "\n", Ended(reply, asked.is_dry_run));
  const std::string doubts = asked.is_dry_run ? DoubtsOf(reply, asked) : "";
  return doubts.empty() ? text : absl::StrCat(text, "\nwarning: ", doubts, "\n");
}

}  // namespace dsg::cli
