// SPDX-License-Identifier: Apache-2.0
// The verb prune: forgets a part of a map.
#include <unistd.h>

#include <array>
#include <cstdint>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/json.h"
#include "query/cli/progress.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "query/maintenance/prune_convert.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/retention/policy.h"
#include "schema/retention/policy_file.h"

namespace dsg::cli {
namespace {

struct PruneVerb {
  /// At most one of these is set; none is allowed with `simplify_m`.
  std::string branch;
  std::string region;
  std::string before;
  std::string older_than;
  std::string layer;
  std::string unseen_since;
  std::string unseen_for;
  std::string history_older_than;
  std::optional<int64_t> history_before;
  std::string policy_file;
  /// Empty = all layers.
  std::vector<std::string> only;
  /// Metres; 0 = forget instead of thinning.
  double simplify_m = 0.0;
  bool erase = false;
  bool dry_run = false;
  /// Share of the map; unset = that of the policy file, or no limit.
  std::optional<double> share_max;
  /// Also if everything matches.
  bool yes = false;
};

using AmountColumn = std::pair<const char*, int64_t (v1::Amount::*)() const>;

constexpr std::array<AmountColumn, 9> kCounts = {{{"nodes", &v1::Amount::node_count},
                                                  {"edges", &v1::Amount::edge_count},
                                                  {"poses", &v1::Amount::pose_count},
                                                  {"shapes", &v1::Amount::shape_count},
                                                  {"factors", &v1::Amount::factor_count},
                                                  {"stays", &v1::Amount::stay_count},
                                                  {"mesh blocks", &v1::Amount::mesh_block_count},
                                                  {"assets", &v1::Amount::asset_count},
                                                  {"revisions", &v1::Amount::revision_count}}};

using AmountRow = std::pair<std::string, const v1::Amount*>;

// Columns that are zero in all rows are left out.
Table TableOf(const std::vector<AmountRow>& rows) {
  std::vector<AmountColumn> shown;
  for (const AmountColumn& count : kCounts) {
    bool is_used = false;
    for (const auto& [name, amount] : rows) is_used |= (amount->*count.second)() != 0;
    if (is_used) shown.push_back(count);
  }
  std::vector<Column> columns = {{""}};
  for (const AmountColumn& count : shown) columns.push_back({count.first, Align::kRight});
  columns.push_back({"payload", Align::kRight});
  Table table(std::move(columns));
  for (const auto& [name, amount] : rows) {
    std::vector<std::string> cells = {Printable(name)};
    for (const AmountColumn& count : shown)
      cells.push_back(absl::StrCat((amount->*count.second)()));
    cells.push_back(BytesText(amount->byte_count()));
    table.AddRow(std::move(cells));
  }
  return table;
}

// Stays that only lose a part.
std::string StaysText(const v1::PolicyReport& policy) {
  const int64_t count = policy.matched().stay_edit_count();
  if (count == 0) return "";
  return absl::StrCat(Printable(policy.name()), ": ", Counted(count, "stay"),
                      count == 1 ? " loses its place, room or beginning and stays\n"
                                 : " lose their place, room or beginning and stay\n");
}

std::string FilesText(const v1::PruneResponse& reply) {
  return absl::StrCat("database: ", BytesText(reply.file_bytes_before() - reply.log_bytes_before()),
                      " before, ", BytesText(reply.file_bytes_after() - reply.log_bytes_after()),
                      " now; log, used again: ", BytesText(reply.log_bytes_before()), " before, ",
                      BytesText(reply.log_bytes_after()), " now\n");
}

template <typename Names>
std::string NamesText(const Names& names, int64_t count) {
  std::string text;
  for (const std::string& name : names) {
    absl::StrAppend(&text, text.empty() ? "" : " ", Printable(name));
  }
  return count > static_cast<int64_t>(names.size()) ? text + " ..." : text;
}

std::string ErasedText(const v1::PruneResponse& reply) {
  std::string text;
  if (reply.rewritten_count() > 0) {
    absl::StrAppend(&text, Counted(reply.rewritten_count(), "node"),
                    " were written again by others during the erasure: their past is erased, their "
                    "new state is not: ",
                    NamesText(reply.rewritten_ids(), reply.rewritten_count()), "\n");
  }
  if (reply.erased()) {
    // The text makes no claim about data retired before, or by another policy of the call.
    absl::StrAppend(&text, "erased: what this call found to erase is in no ",
                    reply.rewritten_count() > 0 ? "older " : "",
                    "revision and in no byte of the map's files; backups made before still have "
                    "it, and older revisions still have what was only retired\n");
    return text;
  }
  if (reply.left_count() == 0) {
    return text + "not fully erased: a reader kept the log; run the prune again\n";
  }
  absl::StrAppend(&text, "not fully erased: others wrote again ",
                  Counted(reply.left_count(), "thing"), ": ",
                  NamesText(reply.left_ids(), reply.left_count()),
                  "; stop these writers, and run the prune again\n");
  return text;
}

std::string DoubtsText(const v1::PruneResponse& reply) {
  std::string text;
  for (const std::string& note : reply.notes()) absl::StrAppend(&text, "clocks: ", note, "\n");
  if (!reply.refusal().empty()) {
    absl::StrAppend(&text, "the run would be refused: ", Printable(reply.refusal()), "\n");
  }
  return text;
}

// Something other than history went.
bool HasRows(const v1::PruneResponse& reply) {
  const v1::Amount& before = reply.map_before();
  const v1::Amount& after = reply.map_after();
  return reply.revision() > 0 && before.byte_count() > after.byte_count();
}

// `reply` merges all messages of a prune.
std::string RenderPrune(const v1::PruneResponse& reply, bool is_dry_run, bool is_erase) {
  std::vector<AmountRow> rows;
  for (const v1::PolicyReport& policy : reply.policies()) {
    rows.emplace_back(policy.name(), &policy.matched());
  }
  rows.emplace_back(is_dry_run ? "map" : "map before", &reply.map_before());
  if (!is_dry_run) rows.emplace_back("map after", &reply.map_after());
  std::string text = TableOf(rows).Render();
  for (const v1::PolicyReport& policy : reply.policies()) text += StaysText(policy);
  text += DoubtsText(reply);
  if (is_dry_run) return text + "nothing was changed\n";
  text += FilesText(reply);
  if (reply.revision() == 0) {
    absl::StrAppend(&text, "no new revision\n");
  } else {
    absl::StrAppend(&text, "newest revision: ", reply.revision(), "\n");
  }
  if (is_erase) {
    text += ErasedText(reply);
  } else if (HasRows(reply)) {
    text += "older revisions still have it: `dsg compact` frees their bytes\n";
  }
  return text;
}

absl::StatusOr<PrunePolicy::What> WhatOf(const PruneVerb& verb, const MapSpec& map) {
  if (!verb.branch.empty()) return PrunePolicy::Branch{verb.branch};
  if (!verb.layer.empty()) return PrunePolicy::WholeLayer{verb.layer};
  if (!verb.region.empty()) {
    DSG_ASSIGN_OR_RETURN(const Box3d box, ParseBox("--region", verb.region));
    return PrunePolicy::Region{box};
  }
  if (!verb.before.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--before", verb.before, map));
    return PrunePolicy::Before{at_ns};
  }
  if (!verb.unseen_since.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs at_ns,
                         ParseInstant("--unseen-since", verb.unseen_since, map));
    return PrunePolicy::UnseenSince{at_ns};
  }
  if (!verb.older_than.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs age_ns, ParseAge(verb.older_than));
    return PrunePolicy::OlderThan{age_ns};
  }
  if (!verb.unseen_for.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs age_ns, ParseAge(verb.unseen_for));
    return PrunePolicy::UnseenFor{age_ns};
  }
  if (!verb.history_older_than.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs age_ns, ParseAge(verb.history_older_than));
    return PrunePolicy::HistoryOlderThan{age_ns};
  }
  if (verb.history_before.has_value()) return PrunePolicy::HistoryBefore{*verb.history_before};
  return PrunePolicy::What();
}

// The options are a policy file with one policy.
absl::StatusOr<PolicyFile> PoliciesOf(const PruneVerb& verb, const MapSpec& map) {
  if (!verb.policy_file.empty()) return ReadPolicyFile(verb.policy_file);
  PrunePolicy policy;
  DSG_ASSIGN_OR_RETURN(policy.what, WhatOf(verb, map));
  policy.layers = verb.only;
  policy.simplify_m = verb.simplify_m;
  if (verb.erase) policy.strength = PruneStrength::kErase;
  if (std::holds_alternative<std::monostate>(policy.what) && !policy.IsThinning()) {
    return MakeError(Reason::kFieldInvalid,
                     "choose what to forget: --branch, --region, --before, --older-than, --layer, "
                     "--unseen-since, --unseen-for, --history-older-than, --history-before, "
                     "--simplify or --policy");
  }
  DSG_RETURN_IF_ERROR(policy.Validate());
  PolicyFile file;
  file.policies = {std::move(policy)};
  return file;
}

// All messages merged: reports are in the first, totals in the last.
absl::StatusOr<v1::PruneResponse> CallPrune(Session* session, const v1::PruneRequest& request) {
  v1::PruneResponse all;
  DSG_RETURN_IF_ERROR(ReadLong(session, absl::StrCat("prune ", session->map().name),
                               &query::Api::Prune, request,
                               [&](const v1::PruneResponse& message) { all.MergeFrom(message); }));
  return all;
}

// Asks on a terminal whether to prune everything; false for a script.
bool ConfirmPrune(const absl::Status& refusal, std::ostream& questions) {
  if (isatty(STDIN_FILENO) == 0) return false;
  questions << "dsg: " << refusal.message() << "\nForget all of it? [y/N] " << std::flush;
  std::string answer;
  return std::getline(std::cin, answer) && (answer == "y" || answer == "yes");
}

// A script must see an error if data is still there.
absl::Status CheckErased(Session* session, const v1::PruneResponse& reply) {
  if (reply.erased()) return absl::OkStatus();
  const auto request = session->Begin<v1::GetMapStatsRequest>();
  v1::GetMapStatsResponse stats;
  DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &stats));
  const v1::PendingErasure& pending = stats.pending_erasure();
  const bool is_named = pending.node_count() + pending.edge_count() + pending.mesh_block_count() +
                            pending.span_count() >
                        0;
  std::string why = "a reader kept the log; stop the readers and run the prune again";
  if (is_named) why = "an earlier prune was interrupted; run that prune again (see dsg stats)";
  if (reply.left_count() > 0) {
    why = "other writers wrote it again; stop them and run the prune again";
  }
  return MakeError(
      Reason::kWriterLocked,
      absl::StrCat("map \"", request.map(), "\" still has some of the data to erase: ", why),
      {{"map", request.map()}, {"left_count", absl::StrCat(reply.left_count())}});
}

absl::Status RunPrune(Session* session, const PruneVerb& verb, std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(const PolicyFile file, PoliciesOf(verb, session->map()));
  v1::PruneRequest request;
  request.set_map(session->map().name);
  request.set_author("dsg prune");
  request.set_dry_run(verb.dry_run);
  request.set_allow_everything(verb.yes);
  request.set_share_max(verb.share_max.value_or(file.share_max.value_or(0.0)));
  bool is_erase = false;
  for (const PrunePolicy& policy : file.policies) {
    query::ToProto(policy, request.add_policies());
    is_erase |= policy.strength == PruneStrength::kErase && !policy.IsHistory();
  }
  auto reply = CallPrune(session, request);
  if (ReasonOf(reply.status()) == Reason::kPolicyMatchesAll) {
    if (!ConfirmPrune(reply.status(), session->notes())) {
      return Annotate(reply.status(), "refused without --yes");
    }
    request.set_allow_everything(true);
    reply = CallPrune(session, request);
  }
  DSG_RETURN_IF_ERROR(reply.status());
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(*reply, out));
  } else {
    out << RenderPrune(*reply, verb.dry_run, is_erase);
  }
  return is_erase && !verb.dry_run ? CheckErased(session, *reply) : absl::OkStatus();
}

}  // namespace

void AddPruneVerb(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<PruneVerb>({.name = "prune",
                                                    .what = "Forget a part of a map",
                                                    .example = "--branch \"office 4\" --dry-run",
                                                    .takes = kServer | kMap | kJson,
                                                    .run = RunPrune});
  CLI::Option_group* const what = app->add_option_group("What", "What to forget");
  what->add_option("--branch", verb->branch, "A node by id or name, with all that it contains");
  what->add_option("--region", verb->region,
                   "X0,Y0,Z0,X1,Y1,Z1, metres: nodes, poses and mesh inside; begin 1 m below "
                   "the floor, since heights of poses scatter around it");
  what->add_option("--before", verb->before,
                   "Tracks before this TIME, and nodes that ended before it");
  what->add_option("--older-than", verb->older_than,
                   "As --before, as an age from the newest observation: 90s, 24h, 30d");
  what->add_option("--layer", verb->layer, "All of a layer: mesh, objects, agents, ...");
  what->add_option("--unseen-since", verb->unseen_since, "Nodes last observed before this TIME");
  what->add_option("--unseen-for", verb->unseen_for,
                   "As --unseen-since, as an age from the newest observation: 90s, 24h, 30d");
  what->add_option("--history-older-than", verb->history_older_than,
                   "Revisions without a tag that were committed longer ago than this: 30d");
  what->add_option("--history-before", verb->history_before,
                   "Revisions without a tag before this one")
      ->check(WholeZeroOrMore());
  CLI::Option* file =
      what->add_option("--policy", verb->policy_file, "A file of policies (docs/forgetting.md)");
  what->require_option(0, 1);
  CLI::Option* simplify =
      app->add_option("--simplify", verb->simplify_m,
                      "Thin tracks instead of forgetting them: drop poses that interpolation "
                      "reproduces within this distance, metres")
          ->check(AboveZero());
  CLI::Option* only = app->add_option("--only", verb->only, "Only this layer; repeatable");
  CLI::Option* retire = app->add_flag_callback(
      "--retire", [] {}, "Remove it from new revisions; older revisions keep it; the default");
  CLI::Option* erase = app->add_flag(
      "--erase", verb->erase, "Remove it from all revisions, and wipe its bytes from the disk");
  erase->excludes(retire);
  for (CLI::Option* other : {simplify, only, retire, erase}) file->excludes(other);
  app->add_option("--share-max", verb->share_max,
                  "Refuse to remove more than this share of the nodes or of the poses, up to 1; "
                  "default that of the policy file, or no limit")
      ->check(AboveZero())
      ->check(Between(0.0, 1.0));
  app->add_flag("--dry-run", verb->dry_run,
                "Only report what would go, and whether the run would be refused");
  app->add_flag("--yes", verb->yes,
                "Do not ask when a policy matches every node, every pose or the only building");
}

}  // namespace dsg::cli
