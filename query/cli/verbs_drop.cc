// SPDX-License-Identifier: Apache-2.0
// The verbs that take a map away from its name: drop, rename.
#include <unistd.h>

#include <cstdint>
#include <iostream>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/json.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/model/ids.h"

namespace dsg::cli {
namespace {

struct DropVerb {
  std::string map;
  /// Drop only a map that is at this revision.
  std::optional<int64_t> expected;
  /// Without a question.
  bool yes = false;
};

struct RenameVerb {
  std::string from;
  std::string to;
};

// What is asked of the person at the terminal, and of the map: that it is still what was shown.
struct DropPlan {
  std::string what;
  v1::DropMapRequest request;
};

// A map that cannot be read is dropped too, but nobody can say what goes with it.
absl::StatusOr<DropPlan> PlanDrop(Session* session, const DropVerb& verb) {
  DropPlan plan;
  plan.request.set_map(verb.map);
  v1::GetMapStatsRequest request;
  request.set_map(verb.map);
  v1::GetMapStatsResponse stats;
  const absl::Status looked = session->api().GetMapStats(session->NewCall(), request, &stats);
  if (ReasonOf(looked) == Reason::kMapUnknown || absl::IsInvalidArgument(looked)) return looked;
  if (looked.ok()) {
    plan.what =
        absl::StrCat("map ", verb.map, ": ", Counted(stats.head_revision(), "revision"), ", ",
                     Counted(stats.node_count(), "node"), ", ", Counted(stats.pose_count(), "pose"),
                     ", ", BytesText(stats.bytes_on_disk()));
    plan.request.set_expected_incarnation(stats.header().incarnation());
    plan.request.set_expected_head_revision(stats.head_revision());
  } else {
    plan.what = absl::StrCat("map ", verb.map, ", which cannot be read: ", looked.message());
  }
  return plan;
}

absl::Status ConfirmDrop(const DropVerb& verb, const std::string& what, std::ostream& questions) {
  if (isatty(STDIN_FILENO) == 0) {
    return absl::FailedPreconditionError(absl::StrCat("refused without --yes: this drops ", what));
  }
  questions << "dsg: this drops " << Printable(what)
            << "\nNothing of it can be read afterwards but from backups. Drop it? [y/N] "
            << std::flush;
  std::string answer;
  if (std::getline(std::cin, answer) && (answer == "y" || answer == "yes")) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("map ", verb.map, " stays as it is"));
}

absl::Status RunDrop(Session* session, const DropVerb& verb, std::ostream& out) {
  v1::DropMapRequest request;
  request.set_map(verb.map);
  if (!verb.yes) {
    DSG_ASSIGN_OR_RETURN(DropPlan plan, PlanDrop(session, verb));
    DSG_RETURN_IF_ERROR(ConfirmDrop(verb, plan.what, session->notes()));
    // What the answer was about, and not what has become of it since.
    request = std::move(plan.request);
  }
  if (verb.expected.has_value()) request.set_expected_head_revision(*verb.expected);
  v1::DropMapResponse reply;
  DSG_RETURN_IF_ERROR(session->api().DropMap(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << "map " << verb.map << " is dropped";
  if (reply.has_head_revision()) out << ", with " << Counted(reply.head_revision(), "revision");
  out << "; " << BytesText(reply.bytes_on_disk()) << " freed\n";
  return absl::OkStatus();
}

absl::Status RunRename(Session* session, const RenameVerb& verb, std::ostream& out) {
  v1::RenameMapRequest request;
  request.set_map(verb.from);
  request.set_new_name(verb.to);
  v1::RenameMapResponse reply;
  DSG_RETURN_IF_ERROR(session->api().RenameMap(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << "map " << verb.from << " is now " << reply.map().name() << "\n";
  return absl::OkStatus();
}

absl::Status CheckRename(const RenameVerb& verb, const CommonOptions&) {
  DSG_RETURN_IF_ERROR(CheckMapName(verb.from));
  return CheckMapName(verb.to);
}

void AddDrop(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<DropVerb>(
      {.name = "drop",
       .what = "Remove a map with its history and all its files",
       .example = "office-copy --expect 3 --yes",
       .takes = kServer | kJson,
       .opens = Opens::kPlace,
       .run = RunDrop,
       .check = [](const DropVerb& drop, const CommonOptions&) { return CheckMapName(drop.map); }});
  app->add_option("MAP", verb->map, "Name of the map")->required();
  app->add_option("--expect", verb->expected,
                  "Only if this is the map's newest revision; default any, or the one that the "
                  "question names")
      ->check(WholeZeroOrMore());
  app->add_flag("--yes", verb->yes, "Do not ask");
}

void AddRename(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<RenameVerb>({.name = "rename",
                                                     .what = "Give a map another name",
                                                     .example = "office-copy attic",
                                                     .takes = kServer | kJson,
                                                     .opens = Opens::kPlace,
                                                     .run = RunRename,
                                                     .check = CheckRename});
  app->add_option("OLD", verb->from, "Name of the map")->required();
  app->add_option("NEW", verb->to, "Its new name, which no map has")->required();
}

}  // namespace

void AddDropVerbs(Grammar* grammar) {
  AddDrop(grammar);
  AddRename(grammar);
}

}  // namespace dsg::cli
