// SPDX-License-Identifier: Apache-2.0
#include "query/cli/verbs_changes.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/message_differencer.h>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "query/cli/json.h"
#include "query/cli/list_writer.h"
#include "query/cli/lookups.h"
#include "query/cli/progress.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"

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

// Names of the fields that differ, except `revision`, which always differs.
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

namespace {

void AddNodes(const v1::DiffRevisionsResponse& reply, const TimeText& times, Table* table) {
  for (const v1::NodeChange& change : reply.nodes()) {
    const v1::Node& node = change.has_after() ? change.after() : change.before();
    const std::string detail = change.has_before() && change.has_after()
                                   ? DifferenceText(change.before(), change.after(), times)
                                   : NodeText(node);
    table->AddRow({SignOf(change.type()), "node", node.id(), detail});
  }
}

void AddEdgeChanges(const v1::DiffRevisionsResponse& reply, Table* table) {
  for (const v1::EdgeChange& change : reply.edges()) {
    const v1::Edge& edge = change.has_after() ? change.after() : change.before();
    std::string detail;
    if (change.has_before() && change.has_after()) {
      detail = absl::StrJoin(FieldsThatDiffer(change.before(), change.after()), ", ");
    }
    table->AddRow({SignOf(change.type()), "edge", EdgeText(edge), detail});
  }
}

// Mesh blocks have no names, so only their counts are shown.
std::string MeshText(const v1::DiffRevisionsResponse& reply) {
  std::array<int64_t, 4> count_of{};
  for (const v1::MeshChange& change : reply.mesh_blocks()) {
    if (change.type() >= 0 && change.type() <= 3) ++count_of[static_cast<size_t>(change.type())];
  }
  return absl::StrCat(count_of[v1::ADDED], " added, ", count_of[v1::CHANGED], " changed, ",
                      count_of[v1::REMOVED], " removed");
}

std::string RenderChanges(const v1::DiffRevisionsResponse& reply, const TimeText& times) {
  Table table({{""}, {"what"}, {"id"}, {"detail"}});
  AddNodes(reply, times, &table);
  AddEdgeChanges(reply, &table);
  for (const v1::TrackChange& track : reply.tracks()) {
    table.AddRow({"~", "track", track.agent_id(), TrackText(track, times)});
  }
  if (reply.mesh_blocks_size() > 0) table.AddRow({"~", "mesh", "blocks", MeshText(reply)});
  return table.row_count() == 0 ? "" : table.Render();
}

}  // namespace

std::string RenderDiff(const v1::DiffRevisionsResponse& reply, const TimeText& times) {
  const int64_t count = static_cast<int64_t>(reply.nodes_size()) + reply.edges_size() +
                        reply.tracks_size() + reply.mesh_blocks_size();
  return absl::StrCat(RenderChanges(reply, times), Counted(count, "change"), " from revision ",
                      reply.from_revision(), " to ", reply.to_revision(),
                      reply.next_page_token().empty() ? "" : "; there are more, see --limit", "\n");
}

namespace {

using RevisionTags = std::map<int64_t, std::vector<std::string>>;

std::vector<ListColumn> RevisionColumns(bool has_tags) {
  std::vector<ListColumn> columns = {{"revision", CellType::kCount},
                                     {"committed"},
                                     {"author"},
                                     {"nodes", CellType::kCount},
                                     {"edges", CellType::kCount},
                                     {"agents", CellType::kCount},
                                     {"poses", CellType::kCount},
                                     {"session"},
                                     {"message"}};
  if (has_tags) columns.insert(columns.begin() + 1, {"tags"});
  return columns;
}

Row RevisionRow(const v1::Revision& revision, bool has_tags, const RevisionTags& tags) {
  // A commit has a date on every clock.
  Row row = {revision.revision(),   FormatRfc3339(revision.committed_ns()),
             revision.author(),     revision.node_count(),
             revision.edge_count(), revision.agent_count(),
             revision.pose_count(), absl::StrCat(revision.session_id(), "/", revision.sequence()),
             revision.message()};
  if (!has_tags) return row;
  const auto found = tags.find(revision.revision());
  row.insert(row.begin() + 1, found == tags.end() ? "" : absl::StrJoin(found->second, " "));
  return row;
}

absl::Status RunLog(Session* session, const LogVerb&, std::ostream& out) {
  const CommonOptions& common = session->common();
  RevisionTags tags;
  if (!common.json && common.format != ListFormat::kJsonLines) {
    DSG_ASSIGN_OR_RETURN(const v1::ListTagsResponse reply, ReadTags(session));
    for (const v1::Tag& tag : reply.tags()) tags[tag.revision()].push_back(tag.name());
  }
  const bool has_tags = !tags.empty() || common.format == ListFormat::kCsv;
  ListWriter list(common, session->times(), "revisions", RevisionColumns(has_tags), &out);
  // This list is paged by revision, not by token.
  v1::ListRevisionsRequest request;
  request.set_map(session->map().name);
  for (int64_t left = EntriesLeft(common.limit); left > 0;) {
    const int64_t page_size = std::min(left, kPageSizeMax);
    request.set_page_size(static_cast<int32_t>(page_size));
    v1::ListRevisionsResponse page;
    DSG_RETURN_IF_ERROR(session->api().ListRevisions(session->NewCall(), request, &page));
    DSG_RETURN_IF_ERROR(list.Add(page, page.revisions(), [&](const v1::Revision& revision) {
      return RevisionRow(revision, has_tags, tags);
    }));
    left -= page.revisions_size();
    if (page.revisions_size() < page_size) break;
    request.set_before_revision(page.revisions(page.revisions_size() - 1).revision());
  }
  return list.End("");
}

absl::Status RunDiff(Session* session, const DiffVerb& verb, std::ostream& out) {
  v1::DiffRevisionsRequest request;
  request.set_map(session->map().name);
  DSG_ASSIGN_OR_RETURN(const std::optional<Revision> from, NumberOf(verb.from, session));
  DSG_ASSIGN_OR_RETURN(const std::optional<Revision> to, NumberOf(verb.to, session));
  request.set_from_revision(from.value_or(0));
  if (to.has_value()) request.set_to_revision(*to);
  request.set_layer(verb.layer);
  v1::DiffRevisionsResponse all;
  const auto count = [](const v1::DiffRevisionsResponse& page) {
    return page.nodes_size() + page.edges_size() + page.tracks_size() + page.mesh_blocks_size();
  };
  DSG_RETURN_IF_ERROR(session->ReadPages(&query::Api::DiffRevisions, request,
                                         session->common().limit, count, &all));
  if (session->common().json) return WriteJson(all, out);
  out << RenderDiff(all, session->times());
  return absl::OkStatus();
}

std::string RenderRevision(const v1::Revision& revision) {
  return Printable(absl::StrCat(
             "revision ", revision.revision(), "  ", FormatRfc3339(revision.committed_ns()), "  ",
             Counted(revision.node_count(), "node"), ", ", Counted(revision.edge_count(), "edge"),
             ", ", Counted(revision.pose_count(), "pose"), "  ", revision.author(),
             revision.message().empty() ? "" : absl::StrCat(": ", revision.message()))) +
         "\n";
}

using CallClock = query::CallContext::Clock;

// Prints messages and remembers the last revision.
class WatchPrinter {
 public:
  WatchPrinter(const Session& session, const WatchVerb& verb, std::optional<int64_t> after,
               std::ostream& out)
      : session_(session), verb_(verb), out_(out), after_(after) {}

  /// False when no more messages are needed.
  bool Take(const v1::WatchMapResponse& message) {
    after_ = message.header().read_revision();
    if (!message.has_revision()) return static_cast<bool>(out_);
    status_ = Print(message);
    out_.flush();
    if (message.complete()) ++count_;
    return status_.ok() && out_ && !IsDone();
  }

  bool IsDone() const { return verb_.count > 0 && count_ >= verb_.count; }
  std::optional<int64_t> after() const { return after_; }
  const absl::Status& status() const { return status_; }

 private:
  absl::Status Print(const v1::WatchMapResponse& message) {
    if (session_.common().json) return WriteJsonLine(message, out_);
    // All parts of a revision share one heading.
    if (message.revision().revision() != shown_) out_ << RenderRevision(message.revision());
    shown_ = message.revision().revision();
    if (message.has_changes()) out_ << RenderChanges(message.changes(), session_.times());
    return absl::OkStatus();
  }

  const Session& session_;
  const WatchVerb& verb_;
  std::ostream& out_;
  std::optional<int64_t> after_;
  int64_t count_ = 0;
  int64_t shown_ = -1;
  absl::Status status_;
};

// Waits for a server that went away, and says so in the notes.
class Patience {
 public:
  explicit Patience(std::ostream* notes) : notes_(*notes) {}

  void Heard(int64_t revision) {
    if (is_lost_) {
      notes_ << "dsg: the server is back; watching again after revision " << revision_ << "\n"
             << std::flush;
    }
    is_lost_ = false;
    has_heard_ = true;
    revision_ = revision;
  }

  /// False to give up: the server never answered, or not for a minute.
  bool Wait(const query::CallContext& call) {
    if (!has_heard_) return false;
    const auto now = CallClock::now();
    if (!is_lost_) {
      notes_ << "dsg: the server went away after revision " << revision_
             << "; trying for a minute to reach it again\n"
             << std::flush;
      is_lost_ = true;
      lost_at_ = now;
    }
    if (now - lost_at_ > kPatience) return false;
    // The client pauses between its retries; this covers errors that come at once.
    std::this_thread::sleep_for(kPause);
    return !call.cancelled();
  }

 private:
  static constexpr std::chrono::seconds kPatience{60};
  static constexpr std::chrono::milliseconds kPause{200};

  std::ostream& notes_;
  // The last revision heard of.
  int64_t revision_ = 0;
  bool has_heard_ = false;
  bool is_lost_ = false;
  CallClock::time_point lost_at_;
};

v1::WatchMapRequest WatchRequest(const Session& session, const WatchVerb& verb,
                                 const WatchPrinter& printer) {
  v1::WatchMapRequest request;
  request.set_map(session.map().name);
  if (printer.after().has_value()) request.set_after_revision(*printer.after());
  request.set_changes(verb.changes);
  request.set_view(v1::NODE_VIEW_FULL);
  return request;
}

absl::Status RunWatch(Session* session, const WatchVerb& verb, std::ostream& out) {
  // The client sets a deadline on a call without one.
  constexpr std::chrono::hours kForEver{24 * 365};
  const double timeout_s = session->common().timeout_s;
  const auto length = timeout_s > 0.0 ? std::chrono::duration_cast<CallClock::duration>(
                                            std::chrono::duration<double>(timeout_s))
                                      : std::chrono::duration_cast<CallClock::duration>(kForEver);
  query::CallContext call(CallClock::now() + length);
  const InterruptGuard guard(&call);
  DSG_ASSIGN_OR_RETURN(const std::optional<Revision> after, NumberOf(verb.after, session));
  WatchPrinter printer(*session, verb, after, out);
  Patience patience(&session->notes());
  const auto take = [&](const v1::WatchMapResponse& message) {
    const bool goes_on = printer.Take(message);
    patience.Heard(*printer.after());
    return goes_on;
  };
  while (true) {
    const absl::Status status = query::ReadStream(
        call, session->api().WatchMap(call, WatchRequest(*session, verb, printer)), take);
    DSG_RETURN_IF_ERROR(printer.status());
    if (printer.IsDone() || call.cancelled()) return absl::OkStatus();
    // A restarted server continues from the last revision heard of. A server that shuts down may
    // cancel a call that it has just taken, and it drops slow readers.
    const bool was_given_up =
        absl::IsResourceExhausted(status) && ReasonOf(status) == Reason::kUnspecified;
    const bool is_away = absl::IsUnavailable(status) || absl::IsCancelled(status) || was_given_up;
    if (!is_away || !patience.Wait(call)) return status;
  }
}

void AddLog(Grammar* grammar) {
  grammar->Add<LogVerb>({.name = "log",
                         .what = "List the revisions of a map, newest first",
                         .example = "--limit 5",
                         .takes = kServer | kMap | kJson | kLimit | kFormat,
                         .run = RunLog});
}

void AddDiff(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<DiffVerb>({.name = "diff",
                                                   .what = "What differs between two revisions",
                                                   .example = "0 1 --layer rooms",
                                                   .takes = kServer | kMap | kJson | kLimit,
                                                   .run = RunDiff});
  AddRevision(app, "FROM", "First revision or tag", &verb->from)->required();
  AddRevision(app, "TO", "Second revision or tag; default the newest", &verb->to);
  app->add_option("--layer", verb->layer, "Only nodes of this layer, and their edges");
}

void AddWatch(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<WatchVerb>({.name = "watch",
                               .what = "Print revisions as they are committed, until Ctrl-C",
                               .example = "--after 8 --changes",
                               .takes = kServer | kMap | kJson,
                               .run = RunWatch});
  AddRevision(app, "--after", "Begin after this revision or tag; default the newest", &verb->after);
  app->add_flag("--changes", verb->changes, "Also print what changed");
  app->add_option("-n,--count", verb->count, "End after this many revisions; default never")
      ->check(WholeAboveZero());
}

}  // namespace

void AddChangeVerbs(Grammar* grammar) {
  AddLog(grammar);
  AddDiff(grammar);
  AddWatch(grammar);
}

}  // namespace dsg::cli
