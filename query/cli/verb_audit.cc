// SPDX-License-Identifier: Apache-2.0
// The verb audit: what a server's audit log says, and whether it is what the server wrote.
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "nlohmann/json.hpp"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "schema/audit/audit_log.h"
#include "schema/base/counted.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

struct AuditVerb {
  std::string file;
  std::string key_file;
  std::string caller;
  /// A chain that was noted before; empty = none.
  std::string noted;
};

nlohmann::ordered_json JsonOf(const AuditEntry& entry) {
  return {{"number", entry.number},
          {"time", FormatRfc3339(entry.time_ns)},
          {"caller", entry.caller},
          {"peer", entry.peer},
          {"method", entry.method},
          {"map", entry.map},
          {"code", entry.code},
          {"revision", entry.revision},
          {"left_out", entry.left_out_count}};
}

absl::Status RunAudit(Session* session, const AuditVerb& verb, std::ostream& out) {
  const CommonOptions& common = session->common();
  DSG_ASSIGN_OR_RETURN(const std::string key, ReadAuditKey(verb.key_file));
  Table table({{"number", Align::kRight},
               {"time"},
               {"caller"},
               {"method"},
               {"map"},
               {"code"},
               {"revision", Align::kRight},
               {"peer"}});
  std::string lines;
  bool has_noted = verb.noted.empty();
  int64_t left_out_count = 0;
  const auto take = [&](const AuditEntry& entry) {
    has_noted = has_noted || entry.chain == verb.noted;
    left_out_count += entry.left_out_count;
    const bool is_asked = (verb.caller.empty() || entry.caller == verb.caller) &&
                          (common.map.empty() || entry.map == common.map);
    if (!is_asked) return;
    if (common.json) {
      absl::StrAppend(&lines, JsonOf(entry).dump(), "\n");
      return;
    }
    table.AddRow({absl::StrCat(entry.number), FormatRfc3339(entry.time_ns),
                  entry.caller.empty() ? "-" : entry.caller, entry.method,
                  entry.map.empty() ? "-" : entry.map, entry.code,
                  entry.revision == 0 ? "-" : absl::StrCat(entry.revision), entry.peer});
  };
  // Nothing is told of a log that is not right.
  DSG_ASSIGN_OR_RETURN(const AuditHead head, VerifyAuditLog(verb.file, key, take));
  if (!has_noted) {
    return MakeError(Reason::kStoreCorrupt,
                     absl::StrCat("audit log ", verb.file, " has no line of the chain ", verb.noted,
                                  ": lines were cut off, or the log made anew"),
                     {{"table", "audit"}});
  }
  if (common.json) {
    out << lines;
    return absl::OkStatus();
  }
  if (table.row_count() > 0) out << table.Take();
  out << Counted(head.entry_count, "line") << ", all as they were written"
      << (head.has_torn_end ? " but for a last one that a crash cut off" : "") << "; chain "
      << head.chain << "\n";
  if (left_out_count > 0) {
    out << Counted(left_out_count, "refused call") << " more stand in no line: there were too many "
        << "at once\n";
  }
  return absl::OkStatus();
}

}  // namespace

void AddAuditVerb(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<AuditVerb>(
      {.name = "audit",
       .what = "Who changed which map: a server's audit log, verified",
       .example = "audit.jsonl --caller robot-7",
       .takes = kMapFilter | kJson,
       .opens = Opens::kNothing,
       .run = RunAudit,
       .footer = "Lines that were changed, moved or taken out are found, and with --key also by "
                 "whom who could write the file. Lines cut off at the end show to those who give "
                 "the chain that they noted of a later one. docs/access.md says more."});
  app->add_option("FILE", verb->file, "What dsg-server --audit writes")->required();
  app->add_option("--key", verb->key_file, "The key of dsg-server --audit-key");
  app->add_option("--caller", verb->caller, "Only calls of this caller");
  app->add_option("--noted", verb->noted, "A chain that must be in it");
}

}  // namespace dsg::cli
