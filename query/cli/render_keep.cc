// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_keep.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/cli/render_maps.h"
#include "query/cli/table.h"
#include "schema/base/time.h"

namespace dsg::cli {

std::string RenderTags(const v1::ListTagsResponse& reply) {
  if (reply.tags().empty()) return "no tags\n";
  Table table({{"tag"}, {"revision", Align::kRight}, {"set"}, {"note"}});
  for (const v1::Tag& tag : reply.tags()) {
    table.AddRow(
        {tag.name(), absl::StrCat(tag.revision()), FormatRfc3339(tag.created_ns()), tag.note()});
  }
  return table.Render();
}

std::string RenderTag(const v1::Tag& tag) {
  return absl::StrCat("tag ", tag.name(), " is revision ", tag.revision(), "\n");
}

std::string AmountText(const v1::Amount& amount) {
  const std::pair<int64_t, const char*> parts[] = {{amount.node_count(), "node"},
                                                   {amount.edge_count(), "edge"},
                                                   {amount.pose_count(), "pose"},
                                                   {amount.shape_count(), "body shape"},
                                                   {amount.factor_count(), "factor"},
                                                   {amount.stay_count(), "stay"},
                                                   {amount.mesh_block_count(), "mesh block"},
                                                   {amount.asset_count(), "asset"},
                                                   {amount.revision_count(), "revision"}};
  std::string text;
  for (const auto& [count, noun] : parts) {
    if (count > 0) absl::StrAppend(&text, text.empty() ? "" : ", ", Counted(count, noun));
  }
  return text.empty() ? "nothing" : text;
}

std::string RenderCompact(const v1::CompactResponse& reply) {
  return absl::StrCat(
      "dropped ", Counted(reply.revision_count(), "revision"), " and ",
      Counted(reply.row_count(), "row"), "; readable are revision ", reply.oldest_revision(),
      " and later, and those with tags; ", BytesText(reply.file_bytes_before()), " before, ",
      BytesText(reply.file_bytes_after()), " now",
      reply.shrunk() ? ""
                     : "; a reader keeps the file from shrinking, which it will at a later time",
      "\n");
}

std::string RenderRevert(const v1::RevertResponse& reply, const std::string& to, bool is_dry_run) {
  const std::string changes =
      absl::StrCat("restored ", AmountText(reply.added()), "; gone ", AmountText(reply.removed()));
  if (is_dry_run) return absl::StrCat("would go back to ", to, ": ", changes, "\n");
  if (reply.revision() == 0) {
    return absl::StrCat("the map is what it was at ", to, " already; nothing written\n");
  }
  return absl::StrCat("went back to ", to, " as revision ", reply.revision(), ": ", changes, "\n");
}

}  // namespace dsg::cli
