// SPDX-License-Identifier: Apache-2.0
// The verbs about whole maps: stats, maps, version.
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/json.h"
#include "query/cli/list_writer.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/base/time.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {
namespace {

struct StatsVerb {};

struct MapsVerb {};

struct VersionVerb {};

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

std::vector<ListColumn> MapColumns() {
  return {{"map"},
          {"frame"},
          {"clock"},
          {"epoch"},
          {"codec"},
          {"gap", CellType::kDuration},
          {"mesh block m", CellType::kReal, 1}};
}

Row MapRow(const v1::MapSpec& map, bool is_table) {
  return {map.name(),
          map.frame(),
          ClockText(map.clock()),
          is_table ? EpochText(map) : absl::StrCat(map.epoch_ns()),
          CodecText(map.codec()),
          map.gap_ns_max(),
          map.mesh_block_size_m()};
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
         absl::StrCat("interrupted; still to erase: ", left.node_count(), " nodes, ",
                      left.edge_count(), " edges, ", left.mesh_block_count(), " mesh blocks, ",
                      left.span_count(), " parts of tracks; run the same prune again")});
  }
  Table layers({{"layer"}, {"rank", Align::kRight}, {"nodes", Align::kRight}});
  for (const v1::LayerStats& layer : reply.layers()) {
    layers.AddRow({layer.name(), absl::StrCat(layer.rank()), absl::StrCat(layer.node_count())});
  }
  return absl::StrCat(RenderFields(fields), "\n", layers.Render());
}

absl::Status RunStats(Session* session, const StatsVerb&, std::ostream& out) {
  const auto request = session->Begin<v1::GetMapStatsRequest>();
  v1::GetMapStatsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << RenderStats(reply, session->times());
  return absl::OkStatus();
}

absl::Status RunMaps(Session* session, const MapsVerb&, std::ostream& out) {
  v1::ListMapsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListMaps(session->NewCall(), v1::ListMapsRequest(), &reply));
  std::string unreadable;
  for (const std::string& name : reply.unreadable_maps()) {
    absl::StrAppend(&unreadable, "map ", Printable(name),
                    " cannot be opened; dsg verify gives the reason\n");
  }
  ListWriter list(session->common(), session->times(), "maps", MapColumns(), &out);
  DSG_RETURN_IF_ERROR(list.Add(
      reply, reply.maps(), [&](const v1::MapSpec& map) { return MapRow(map, list.is_table()); }));
  // JSON has them in a field of its own; rows have no place for them.
  if (!list.is_table() && !session->common().json) session->notes() << unreadable;
  return list.End(unreadable);
}

absl::Status RunVersion(Session* session, const VersionVerb&, std::ostream& out) {
  const CommonOptions& common = session->common();
  v1::GetServerInfoResponse reply;
  reply.set_version(session->program_version());
  reply.set_store_format_version(kStoreFormatVersion);
  const std::string own =
      absl::StrCat("dsg ", reply.version(), ", store format ", reply.store_format_version(), "\n");
  std::string server;
  if (!common.server.empty()) {
    DSG_RETURN_IF_ERROR(session->Open());
    DSG_RETURN_IF_ERROR(
        session->api().GetServerInfo(session->NewCall(), v1::GetServerInfoRequest(), &reply));
    server = absl::StrCat("dsg-server ", reply.version(), " at ", common.server, ", store format ",
                          reply.store_format_version(), "\n");
  }
  if (common.json) return WriteJson(reply, out);
  out << own << server;
  return absl::OkStatus();
}

}  // namespace

void AddMapsVerbs(Grammar* grammar) {
  grammar->Add<StatsVerb>({.name = "stats",
                           .what = "Counts and sizes of a map",
                           .example = "--revision 3",
                           .run = RunStats});
  grammar->Add<MapsVerb>({.name = "maps",
                          .what = "List the maps",
                          .takes = kServer | kJson | kFormat,
                          .opens = Opens::kPlace,
                          .run = RunMaps});
}

void AddVersionVerb(Grammar* grammar) {
  grammar->Add<VersionVerb>({.name = "version",
                             .what = "Version of this program, and of a server if one is named",
                             .example = "--server unix:dsg.sock",
                             .takes = kServer | kJson,
                             .opens = Opens::kNothing,
                             .run = RunVersion});
}

}  // namespace dsg::cli
