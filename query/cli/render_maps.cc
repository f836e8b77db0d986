// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_maps.h"

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "query/cli/table.h"
#include "schema/base/time.h"

namespace dsg::cli {
namespace {

std::string ClockText(v1::Clock clock) {
  switch (clock) {
    case v1::CLOCK_UNIX:
      return "unix";
    case v1::CLOCK_PTP_TAI:
      return "ptp-tai";
    case v1::CLOCK_LOG_MONOTONIC:
      return "monotonic";
    default:
      return "unknown";
  }
}

std::string CodecText(v1::TrajectoryCodec codec) {
  switch (codec) {
    case v1::TRAJECTORY_CODEC_QUANTIZED:
      return "quantized";
    case v1::TRAJECTORY_CODEC_LOSSLESS:
      return "lossless";
    default:
      return "unknown";
  }
}

std::string EpochText(const v1::MapSpec& map) {
  return map.clock() == v1::CLOCK_UNIX
             ? absl::StrCat(map.epoch_ns(), " ns (", FormatRfc3339(map.epoch_ns()), ")")
             : absl::StrCat(map.epoch_ns(), " ns");
}

}  // namespace

std::string BytesText(int64_t byte_count) {
  constexpr std::array<const char*, 4> kUnits{"kB", "MB", "GB", "TB"};
  if (byte_count < 1000) return absl::StrCat(byte_count, " bytes");
  double value = static_cast<double>(byte_count) / 1000.0;
  size_t unit = 0;
  for (; value >= 999.95 && unit + 1 < kUnits.size(); ++unit) value /= 1000.0;
  return absl::StrCat(Fixed(value, 1), " ", kUnits[unit], " (", byte_count, " bytes)");
}

std::string RenderMaps(const v1::ListMapsResponse& reply) {
  Table table({{"map"},
               {"frame"},
               {"clock"},
               {"epoch"},
               {"codec"},
               {"gap", Align::kRight},
               {"mesh block m", Align::kRight}});
  for (const v1::MapSpec& map : reply.maps()) {
    table.AddRow({map.name(), map.frame(), ClockText(map.clock()), EpochText(map),
                  CodecText(map.codec()), DurationText(0, map.gap_ns_max()),
                  Fixed(map.mesh_block_size_m(), 1)});
  }
  std::string text = table.Render();
  for (const std::string& name : reply.unreadable_maps()) {
    absl::StrAppend(&text, "map ", Printable(name),
                    " cannot be opened; dsg verify or a question to it says why\n");
  }
  return text;
}

std::string RenderStats(const v1::GetMapStatsResponse& reply, const TimeText& times) {
  std::string poses = absl::StrCat(reply.pose_count());
  if (reply.has_first_pose_ns() && reply.has_last_pose_ns()) {
    absl::StrAppend(&poses, ", ", times.Span(reply.first_pose_ns(), reply.last_pose_ns()));
  }
  std::vector<Field> fields{
      {"map", reply.map().name()},
      {"revision", absl::StrCat(reply.header().read_revision(), " (newest ", reply.head_revision(),
                                ", oldest readable ", reply.header().oldest_revision(), ")")},
      {"clock", ClockText(reply.map().clock())},
      {"epoch", EpochText(reply.map())},
      {"codec", CodecText(reply.map().codec())},
      {"nodes", absl::StrCat(reply.node_count())},
      {"edges", absl::StrCat(reply.edge_count())},
      {"agents", absl::StrCat(reply.agent_count())},
      {"poses", poses},
      {"stays", absl::StrCat(reply.stay_count())},
      {"mesh blocks", absl::StrCat(reply.mesh_block_count())},
      {"on disk", BytesText(reply.bytes_on_disk())},
      {"format", absl::StrCat(reply.format_version())},
  };
  if (reply.has_pending_erasure()) {
    const v1::PendingErasure& left = reply.pending_erasure();
    fields.push_back(
        {"erasure",
         absl::StrCat("begun and cut off; still names ", left.node_count(), " nodes, ",
                      left.edge_count(), " edges, ", left.mesh_block_count(), " mesh blocks, ",
                      left.span_count(), " stretches of tracks; run the same prune again")});
  }
  Table layers({{"layer"}, {"rank", Align::kRight}, {"nodes", Align::kRight}});
  for (const v1::LayerStats& layer : reply.layers()) {
    layers.AddRow({layer.name(), absl::StrCat(layer.rank()), absl::StrCat(layer.node_count())});
  }
  return absl::StrCat(RenderFields(fields), "\n", layers.Render());
}

std::string RenderRevisions(const v1::ListRevisionsResponse& reply,
                            const v1::ListTagsResponse& tags) {
  std::map<int64_t, std::vector<std::string>> tags_of;
  for (const v1::Tag& tag : tags.tags()) tags_of[tag.revision()].push_back(tag.name());
  std::vector<Column> columns = {{"revision", Align::kRight},
                                 {"committed"},
                                 {"author"},
                                 {"nodes", Align::kRight},
                                 {"edges", Align::kRight},
                                 {"agents", Align::kRight},
                                 {"poses", Align::kRight},
                                 {"session"},
                                 {"message"}};
  if (!tags_of.empty()) columns.insert(columns.begin() + 1, {"tags"});
  Table table(std::move(columns));
  for (const v1::Revision& revision : reply.revisions()) {
    std::vector<std::string> cells = {absl::StrCat(revision.revision()),
                                      FormatRfc3339(revision.committed_ns()),
                                      revision.author(),
                                      absl::StrCat(revision.node_count()),
                                      absl::StrCat(revision.edge_count()),
                                      absl::StrCat(revision.agent_count()),
                                      absl::StrCat(revision.pose_count()),
                                      absl::StrCat(revision.session_id(), "/", revision.sequence()),
                                      revision.message()};
    if (!tags_of.empty()) {
      cells.insert(cells.begin() + 1, absl::StrJoin(tags_of[revision.revision()], " "));
    }
    table.AddRow(std::move(cells));
  }
  return table.Render();
}

}  // namespace dsg::cli
