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

}  // namespace

std::string RenderMerge(const v1::MergeMapsResponse& reply, const std::string& other,
                        const std::string& map, bool is_dry_run) {
  std::string text = RenderFields(
      {{"map", map},
       {"other", other},
       {"other lies at", PoseText(reply.map_t_other())},
       {"things agreeing", absl::StrCat(reply.agreeing_count())},
       {"they differ by", absl::StrCat(Fixed(reply.residual_m(), 3), " m (root mean square)")}});
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
  return absl::StrCat(text, "\n", Ended(reply, is_dry_run));
}

}  // namespace dsg::cli
