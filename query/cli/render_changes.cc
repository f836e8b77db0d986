// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_changes.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/message_differencer.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/map_service.pb.h"
#include "query/cli/table.h"

namespace dsg::cli {
namespace {

const char* SignOf(v1::ChangeType type) {
  switch (type) {
    case v1::ADDED:
      return "+";
    case v1::REMOVED:
      return "-";
    default:
      return "~";
  }
}

std::string NodeText(const v1::Node& node) {
  std::vector<std::string> words{node.kind()};
  if (!node.semantic_class().name().empty() && node.semantic_class().name() != node.kind()) {
    words.push_back(node.semantic_class().name());
  }
  if (!node.name().empty()) words.push_back(absl::StrCat("\"", node.name(), "\""));
  return absl::StrJoin(words, " ");
}

// Names of the fields that differ, `revision` aside: that differs always.
template <class M>
std::vector<std::string> FieldsThatDiffer(const M& before, const M& after) {
  std::vector<std::string> names;
  const auto* descriptor = M::descriptor();
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const google::protobuf::FieldDescriptor* field = descriptor->field(i);
    if (field->name() == "revision") continue;
    google::protobuf::util::MessageDifferencer differencer;
    const std::vector<const google::protobuf::FieldDescriptor*> only{field};
    if (!differencer.CompareWithFields(before, after, only, only)) names.push_back(field->name());
  }
  return names;
}

double DistanceM(const v1::Vector3& a, const v1::Vector3& b) {
  return std::hypot(a.x() - b.x(), a.y() - b.y(), a.z() - b.z());
}

std::string EdgeText(const v1::Edge& edge) {
  return absl::StrCat(edge.source(), " ", edge.relation(), " ", edge.target());
}

std::string TrackText(const v1::TrackChange& track, const TimeText& times) {
  const int64_t more = track.pose_count_after() - track.pose_count_before();
  std::string text = more > 0   ? absl::StrCat(Counted(more, "pose"), " more")
                     : more < 0 ? absl::StrCat(Counted(-more, "pose"), " fewer")
                                : "as many poses";
  if (track.pose_count_after() > 0) {
    absl::StrAppend(&text, ", up to ", times.Full(track.last_pose_ns_after()));
  }
  return track.corrected() ? text + ", earlier ones corrected" : text;
}

void AddNodes(const v1::DiffRevisionsResponse& reply, const TimeText& times, Table* table) {
  for (const v1::NodeChange& change : reply.nodes()) {
    const v1::Node& node = change.has_after() ? change.after() : change.before();
    const std::string detail = change.has_before() && change.has_after()
                                   ? DifferenceText(change.before(), change.after(), times)
                                   : NodeText(node);
    table->AddRow({SignOf(change.type()), "node", node.id(), detail});
  }
}

void AddEdges(const v1::DiffRevisionsResponse& reply, Table* table) {
  for (const v1::EdgeChange& change : reply.edges()) {
    const v1::Edge& edge = change.has_after() ? change.after() : change.before();
    std::string detail;
    if (change.has_before() && change.has_after()) {
      detail = absl::StrJoin(FieldsThatDiffer(change.before(), change.after()), ", ");
    }
    table->AddRow({SignOf(change.type()), "edge", EdgeText(edge), detail});
  }
}

// Blocks have no names that people know: counts are enough.
std::string MeshText(const v1::DiffRevisionsResponse& reply) {
  std::array<int64_t, 4> count_of{};
  for (const v1::MeshChange& change : reply.mesh_blocks()) {
    if (change.type() >= 0 && change.type() <= 3) ++count_of[static_cast<size_t>(change.type())];
  }
  return absl::StrCat(count_of[v1::ADDED], " added, ", count_of[v1::CHANGED], " changed, ",
                      count_of[v1::REMOVED], " removed");
}

}  // namespace

std::string DifferenceText(const v1::Node& before, const v1::Node& after, const TimeText& times) {
  std::vector<std::string> parts;
  for (const std::string& field : FieldsThatDiffer(before, after)) {
    const double moved_m = DistanceM(before.map_t_node().position(), after.map_t_node().position());
    if (field == "map_T_node" && moved_m > 0.0) {
      parts.push_back(absl::StrCat("moved ", Fixed(moved_m, 3), " m"));
    } else if (field == "map_T_node") {
      parts.push_back("turned");
    } else if (field == "valid_to_ns" && after.has_valid_to_ns()) {
      parts.push_back("ended at " + times.Full(after.valid_to_ns()));
    } else if (field == "name") {
      parts.push_back(absl::StrCat("name \"", before.name(), "\" is \"", after.name(), "\""));
    } else if (field == "semantic_class") {
      parts.push_back(absl::StrCat("class ", before.semantic_class().name(), " is ",
                                   after.semantic_class().name()));
    } else {
      parts.push_back(field);
    }
  }
  return absl::StrCat(NodeText(after), ": ",
                      parts.empty() ? "written again" : absl::StrJoin(parts, ", "));
}

std::string RenderChanges(const v1::DiffRevisionsResponse& reply, const TimeText& times) {
  Table table({{""}, {"what"}, {"id"}, {"detail"}});
  AddNodes(reply, times, &table);
  AddEdges(reply, &table);
  for (const v1::TrackChange& track : reply.tracks()) {
    table.AddRow({"~", "track", track.agent_id(), TrackText(track, times)});
  }
  if (reply.mesh_blocks_size() > 0) table.AddRow({"~", "mesh", "blocks", MeshText(reply)});
  return table.row_count() == 0 ? "" : table.Render();
}

std::string RenderDiff(const v1::DiffRevisionsResponse& reply, const TimeText& times) {
  const int64_t count = static_cast<int64_t>(reply.nodes_size()) + reply.edges_size() +
                        reply.tracks_size() + reply.mesh_blocks_size();
  return absl::StrCat(RenderChanges(reply, times), Counted(count, "change"), " from revision ",
                      reply.from_revision(), " to ", reply.to_revision(),
                      reply.next_page_token().empty() ? "" : "; there are more, see --limit", "\n");
}

std::string RenderRevision(const v1::Revision& revision) {
  return Printable(absl::StrCat(
             "revision ", revision.revision(), "  ", FormatRfc3339(revision.committed_ns()), "  ",
             Counted(revision.node_count(), "node"), ", ", Counted(revision.edge_count(), "edge"),
             ", ", Counted(revision.pose_count(), "pose"), "  ", revision.author(),
             revision.message().empty() ? "" : absl::StrCat(": ", revision.message()))) +
         "\n";
}

}  // namespace dsg::cli
