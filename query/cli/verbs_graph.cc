// SPDX-License-Identifier: Apache-2.0
#include "query/cli/verbs_graph.h"

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/graph_rows.h"
#include "query/cli/json.h"
#include "query/cli/list_writer.h"
#include "query/cli/lookups.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/known_names.h"

namespace dsg::cli {
namespace {

std::string PointText(const v1::Vector3& point) {
  return absl::StrCat(Fixed(point.x(), 3), ", ", Fixed(point.y(), 3), ", ", Fixed(point.z(), 3));
}

std::string BoxText(const v1::Box& box) {
  return absl::StrCat("(", PointText(box.min()), ") to (", PointText(box.max()), ") m");
}

// Longer values are cut; --json has them whole.
constexpr size_t kShownBytesMax = 120;

std::string Shown(const std::string& text) {
  if (text.size() <= kShownBytesMax) return absl::StrCat("\"", text, "\"");
  return absl::StrCat("\"", std::string(Utf8Prefix(text, kShownBytesMax)), "...\" (", text.size(),
                      " bytes)");
}

std::string AttributeText(const v1::AttributeValue& value) {
  switch (value.value_case()) {
    case v1::AttributeValue::kNumber:
      return absl::StrFormat("%.17g", value.number());
    case v1::AttributeValue::kText:
      return Shown(value.text());
    case v1::AttributeValue::kFlag:
      return value.flag() ? "true" : "false";
    case v1::AttributeValue::VALUE_NOT_SET:
      break;
  }
  return "unset";
}

void AddObjectFields(const v1::ObjectComponent& object, std::vector<Field>* fields) {
  if (object.has_size()) fields->push_back({"size", PointText(object.size()) + " m"});
  if (object.has_color()) {
    fields->push_back({"color", absl::StrFormat("#%02x%02x%02x", object.color().red(),
                                                object.color().green(), object.color().blue())});
  }
  if (!object.model_sha256().empty()) {
    fields->push_back(
        {"model", absl::StrCat(absl::BytesToHexString(object.model_sha256()), ", residual ",
                               Fixed(object.registration_residual_m(), 4), " m")});
  }
  if (object.mesh_instance_id() != 0) {
    fields->push_back({"mesh instance", absl::StrCat(object.mesh_instance_id())});
  }
}

void AddStructureFields(const v1::StructureComponent& structure, std::vector<Field>* fields) {
  fields->push_back({"structure", structure.structure_type()});
  if (structure.has_plane_normal()) {
    fields->push_back(
        {"plane", absl::StrCat("normal (", PointText(structure.plane_normal()), "), offset ",
                               Fixed(structure.plane_offset_m(), 3), " m")});
  }
}

void AddRegionFields(const v1::RegionComponent& region, std::vector<Field>* fields) {
  if (region.footprint().xy_size() == 0) return;
  fields->push_back({"footprint", absl::StrCat(region.footprint().xy_size() / 2, " corners")});
  fields->push_back({"height", absl::StrCat(Fixed(region.z_min_m(), 2), " to ",
                                            Fixed(region.z_max_m(), 2), " m")});
}

void AddComponentFields(const v1::Node& node, std::vector<Field>* fields) {
  if (node.has_object()) AddObjectFields(node.object(), fields);
  if (node.has_agent()) fields->push_back({"tracker", node.agent().track_state()});
  if (node.has_place()) {
    fields->push_back({"clearance", Fixed(node.place().clearance_m(), 3) + " m"});
  }
  if (node.has_structure()) AddStructureFields(node.structure(), fields);
  if (node.has_region()) AddRegionFields(node.region(), fields);
}

std::string ObservedText(const v1::Node& node, const TimeText& times) {
  if (!node.has_first_observed_ns() && !node.has_last_observed_ns()) return "";
  std::string text;
  if (node.has_first_observed_ns()) {
    absl::StrAppend(&text, "first ", times.Full(node.first_observed_ns()), ", ");
  }
  if (node.has_last_observed_ns()) {
    absl::StrAppend(&text, "last ", times.Full(node.last_observed_ns()), ", ");
  }
  return absl::StrCat(text, Counted(node.observation_count(), "time"));
}

void AddTimeFields(const v1::GetNodeResponse& reply, const TimeText& times,
                   std::vector<Field>* fields) {
  const v1::Node& node = reply.node();
  fields->push_back(
      {"existed", times.Span(node.has_valid_from_ns() ? node.valid_from_ns() : kTimeMin,
                             node.has_valid_to_ns() ? node.valid_to_ns() : kTimeMax)});
  fields->push_back({"observed", ObservedText(node, times)});
  if (reply.pose_count() > 0) {
    fields->push_back(
        {"track", absl::StrCat(Counted(reply.pose_count(), "pose"), ", ",
                               times.Span(reply.first_pose_ns(), reply.last_pose_ns()))});
  }
}

void AddHierarchyFields(const v1::GetNodeResponse& reply, std::vector<Field>* fields) {
  fields->push_back({"inside", absl::StrJoin(reply.ancestor_ids(), ", ")});
  if (reply.child_count() > 0) fields->push_back({"children", absl::StrCat(reply.child_count())});
}

void AddAttributeFields(const v1::Node& node, std::vector<Field>* fields) {
  // The order within the message is that of a hash.
  std::map<std::string, std::string> sorted;
  for (const auto& [name, value] : node.attributes()) sorted[name] = AttributeText(value);
  for (auto& [name, text] : sorted) fields->push_back({"." + name, std::move(text)});
}

}  // namespace

std::vector<ListColumn> NearestColumns() {
  std::vector<ListColumn> columns = NodeColumns();
  columns.insert(columns.begin(),
                 {.heading = "distance m", .type = CellType::kReal, .decimals = 3});
  return columns;
}

absl::Status AddNearest(const v1::ListNearestNodesResponse& reply, ListWriter* list) {
  return list->Add(reply, reply.nodes(), [](const v1::NearestNode& nearest) {
    Row row = NodeRow(nearest.node());
    row.insert(row.begin(), nearest.distance_m());
    return row;
  });
}

std::string RenderNode(const v1::GetNodeResponse& reply, const TimeText& times) {
  const v1::Node& node = reply.node();
  std::vector<Field> fields{{"id", node.id()},
                            {"name", node.name()},
                            {"kind", node.kind()},
                            {"layer", node.layer()},
                            {"class", node.semantic_class().name()}};
  if (node.has_map_t_node()) {
    fields.push_back({"position", PointText(node.map_t_node().position()) + " m"});
    fields.push_back({"yaw", Fixed(YawDeg(node.map_t_node()), 1) + " deg"});
  }
  if (node.has_bounding_box()) {
    fields.push_back({"box", BoxText(node.bounding_box()) + " in its own frame"});
  }
  AddHierarchyFields(reply, &fields);
  AddTimeFields(reply, times, &fields);
  if (node.has_confidence()) fields.push_back({"confidence", Fixed(node.confidence(), 3)});
  fields.push_back({"provenance", ProvenanceText(node.provenance())});
  AddComponentFields(node, &fields);
  AddAttributeFields(node, &fields);
  fields.push_back({"written", absl::StrCat("by revision ", node.revision(), ", read at ",
                                            reply.header().read_revision())});
  return RenderFields(fields);
}

namespace {

absl::Status RunList(Session* session, const ListVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::ListNodesRequest>();
  v1::NodeFilter* filter = request.mutable_filter();
  DSG_RETURN_IF_ERROR(FillFilter(verb.filter, session->map(), filter));
  filter->set_parent_id(verb.parent);
  filter->set_name(verb.name);
  if (!verb.box.empty()) {
    DSG_ASSIGN_OR_RETURN(const Box3d box, ParseBox("--box", verb.box));
    ToProto(box, filter->mutable_box());
  }
  request.set_view(session->ViewFor(v1::NODE_VIEW_GEOMETRY));
  ListWriter list(session->common(), session->times(), "nodes", NodeColumns(), &out);
  PageEnd end;
  const auto take = [&](const v1::ListNodesResponse& page) -> absl::Status {
    if (page.nodes().empty() && list.count() == 0) {
      DSG_RETURN_IF_ERROR(CheckWords(session, WordsOf(verb.filter)));
    }
    end = PageEnd::Of(page);
    return list.Add(page, page.nodes(), NodeRow);
  };
  DSG_RETURN_IF_ERROR(session->EachPage(&query::Api::ListNodes, request, session->common().limit,
                                        &v1::ListNodesResponse::nodes_size, take));
  return list.End(Footer(list.count(), "node", end.revision, end.is_cut));
}

// "on" means ON: names of relations are told apart by their letters, not by their case.
std::string RelationNamed(const std::string& name) {
  for (const relations::Relation& known : relations::kAll) {
    const std::string spelt(known.name);
    if (absl::EqualsIgnoreCase(spelt, name)) return spelt;
  }
  return name;
}

absl::Status RunEdges(Session* session, const EdgesVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::ListEdgesRequest>();
  request.set_source(verb.source);
  request.set_relation(RelationNamed(verb.relation));
  request.set_target(verb.target);
  DSG_RETURN_IF_ERROR(
      SetInstant("--at", verb.at, session->map(), &request, &v1::ListEdgesRequest::set_at_ns));
  v1::NodePattern words;
  if (!verb.relation.empty()) words.add_relations()->set_relation(verb.relation);
  ListWriter list(session->common(), session->times(), "edges", EdgeColumns(), &out);
  PageEnd end;
  const auto take = [&](const v1::ListEdgesResponse& page) -> absl::Status {
    if (page.edges().empty() && list.count() == 0) {
      DSG_RETURN_IF_ERROR(CheckWords(session, words));
    }
    end = PageEnd::Of(page);
    return list.Add(page, page.edges(), EdgeRow);
  };
  DSG_RETURN_IF_ERROR(session->EachPage(&query::Api::ListEdges, request, session->common().limit,
                                        &v1::ListEdgesResponse::edges_size, take));
  return list.End(Footer(list.count(), "edge", end.revision, end.is_cut));
}

absl::Status RunShow(Session* session, const ShowVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::GetNodeRequest>();
  request.set_id(verb.id);
  request.set_view(v1::NODE_VIEW_FULL);
  v1::GetNodeResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetNode(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << RenderNode(reply, session->times());
  return absl::OkStatus();
}

absl::Status RunNear(Session* session, const NearVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::ListNearestNodesRequest>();
  DSG_ASSIGN_OR_RETURN(const Eigen::Vector3d position, ParsePoint("POSITION", verb.position));
  request.mutable_position()->set_x(position.x());
  request.mutable_position()->set_y(position.y());
  request.mutable_position()->set_z(position.z());
  request.set_k(verb.k);
  request.set_max_distance_m(verb.max_distance_m);
  request.set_view(session->ViewFor(v1::NODE_VIEW_GEOMETRY));
  DSG_RETURN_IF_ERROR(FillFilter(verb.filter, session->map(), request.mutable_filter()));
  v1::ListNearestNodesResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListNearestNodes(session->NewCall(), request, &reply));
  if (reply.nodes().empty()) {
    DSG_RETURN_IF_ERROR(CheckWords(session, WordsOf(verb.filter)));
  }
  ListWriter list(session->common(), session->times(), "nodes", NearestColumns(), &out);
  DSG_RETURN_IF_ERROR(AddNearest(reply, &list));
  return list.End(Footer(list.count(), "node", reply.header().read_revision(), false));
}

void AddList(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<ListVerb>({.name = "ls",
                                                   .what = "List nodes",
                                                   .example = "--kind room",
                                                   .takes = kQuestion | kLimit | kFormat,
                                                   .run = RunList});
  AddFilter(app, &verb->filter);
  app->add_option("--parent", verb->parent, "Only children of this node");
  app->add_option("--name", verb->name, "Only nodes with exactly this name");
  app->add_option("--box", verb->box, "Only nodes that touch X0,Y0,Z0,X1,Y1,Z1, metres");
}

void AddEdges(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<EdgesVerb>({.name = "edges",
                                                    .what = "List edges",
                                                    .example = "--source R9 --relation CONTAINS",
                                                    .takes = kQuestion | kLimit | kFormat,
                                                    .run = RunEdges});
  app->add_option("--source", verb->source, "Only edges from this node");
  app->add_option("--relation", verb->relation, "Only this relation: CONTAINS, ON, ...");
  app->add_option("--target", verb->target, "Only edges to this node");
  app->add_option("--at", verb->at, "Only edges that held at this TIME");
}

void AddShow(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<ShowVerb>(
      {.name = "show", .what = "All fields of one node", .example = "O9", .run = RunShow});
  app->add_option("ID", verb->id, kNodeHelp)->required();
}

void AddNear(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<NearVerb>({.name = "near",
                                                   .what = "The nodes nearest to a point",
                                                   .example = "3,2,0 --k 3 --layer objects",
                                                   .takes = kQuestion | kFormat,
                                                   .run = RunNear});
  app->add_option("POSITION", verb->position, "X,Y,Z in the map frame, metres")->required();
  app->add_option("-k,--k", verb->k, "Number of nodes")
      ->check(Between(1, 1000))
      ->capture_default_str();
  app->add_option("--max-distance", verb->max_distance_m, "Largest distance, metres")
      ->check(AboveZero());
  AddFilter(app, &verb->filter);
}

}  // namespace

void AddGraphVerbs(Grammar* grammar) {
  AddList(grammar);
  AddEdges(grammar);
  AddShow(grammar);
  AddNear(grammar);
}

}  // namespace dsg::cli
