// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_merge.h"

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

// Empty if there is nothing to warn of.
std::string Doubts(const v1::MergeMapsResponse& reply, const MergeAsked& asked) {
  // A map that was merged before and brings nothing new need not be found again.
  if (reply.added_node_count() == 0 && reply.revision() == 0) return "";
  constexpr char kWhatToDo[] =
      "look at both with --dry-run --png FILE, and say where it lies with --transform X,Y,Z,YAW "
      "(metres, radians)";
  if (reply.agreeing_count() == 0) {
    return absl::StrCat("\nwarning: no thing of ", asked.other, " is one of ", asked.map,
                        ": they share nothing, or the transform is wrong; ", kWhatToDo, "\n");
  }
  if (asked.has_transform || reply.agreeing_count() >= kFewThings) return "";
  return absl::StrCat("\nwarning: the transform rests on ",
                      Counted(reply.agreeing_count(), "thing"), " only; ", kWhatToDo, "\n");
}

}  // namespace

std::string RenderMerge(const v1::MergeMapsResponse& reply, const MergeAsked& asked) {
  const bool has_pairs = reply.fused_object_count() > 0;
  std::string text = RenderFields(
      {{"map", asked.map},
       {"other", asked.other},
       {"other lies at", PoseText(reply.map_t_other())},
       {"things agreeing", absl::StrCat(reply.agreeing_count())},
       {"they differ by",
        has_pairs ? absl::StrCat(Fixed(reply.residual_m(), 3), " m (root mean square)") : "-"}});
  Table table({{"", Align::kLeft}, {"nodes", Align::kRight}});
  const auto row = [&](const char* what, int64_t count) {
    table.AddRow({what, absl::StrCat(count)});
  };
  row("objects in both", reply.fused_object_count());
  row("places in both", reply.fused_place_count());
  row("rooms in both", reply.fused_room_count());
  row("structures in both", reply.fused_structure_count());
  row("added", reply.added_node_count());
  row("gone", reply.gone_count());
  row("of these moved", static_cast<int64_t>(reply.moved_ids().size()));
  absl::StrAppend(&text, "\n", table.Render());
  if (reply.fused_mesh_block_count() > 0) {
    absl::StrAppend(&text, "\n", reply.fused_mesh_block_count(), " mesh blocks joined\n");
  }
  return absl::StrCat(text, "\n", Ended(reply, asked.is_dry_run), Doubts(reply, asked));
}

}  // namespace dsg::cli
