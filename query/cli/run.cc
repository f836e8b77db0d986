// SPDX-License-Identifier: Apache-2.0
#include "query/cli/run.h"

#include <memory>
#include <variant>

#include "query/cli/exit_code.h"
#include "query/cli/session.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

// Calls the function of the verb that was named.
class Dispatcher {
 public:
  Dispatcher(const Command& command, const Environment& environment, std::ostream& out,
             std::ostream& errors)
      : command_(command), environment_(environment), out_(out), errors_(errors) {}

  absl::Status operator()(const HelpVerb& verb) {
    out_ << verb.text;
    return absl::OkStatus();
  }
  absl::Status operator()(const VersionVerb&) {
    return RunVersion(command_.common, environment_, out_);
  }
  absl::Status operator()(const ImportVerb& verb) {
    return RunImport(command_.common, verb, out_, errors_);
  }
  absl::Status operator()(const VerifyVerb&) { return RunVerify(command_.common, out_, errors_); }
  absl::Status operator()(const MapsVerb&) {
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<Session> session, Session::Open(command_.common));
    return RunMaps(session.get(), out_);
  }
  /// The verbs that ask about one map.
  template <class V>
  absl::Status operator()(const V& verb) {
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<Session> session, Session::Open(command_.common));
    DSG_RETURN_IF_ERROR(session->ChooseMap());
    return Ask(session.get(), verb);
  }

 private:
  absl::Status Ask(Session* session, const WhereVerb& verb) {
    return RunWhere(session, verb, out_);
  }
  absl::Status Ask(Session* session, const TrackVerb& verb) {
    return RunTrack(session, verb, out_);
  }
  absl::Status Ask(Session* session, const ShapeVerb& verb) {
    return RunShape(session, verb, out_);
  }
  absl::Status Ask(Session* session, const WhoVerb& verb) { return RunWho(session, verb, out_); }
  absl::Status Ask(Session* session, const ListVerb& verb) { return RunList(session, verb, out_); }
  absl::Status Ask(Session* session, const EdgesVerb& verb) {
    return RunEdges(session, verb, out_);
  }
  absl::Status Ask(Session* session, const ShowVerb& verb) { return RunShow(session, verb, out_); }
  absl::Status Ask(Session* session, const NearVerb& verb) { return RunNear(session, verb, out_); }
  absl::Status Ask(Session* session, const LogVerb&) { return RunLog(session, out_); }
  absl::Status Ask(Session* session, const StatsVerb&) { return RunStats(session, out_); }
  absl::Status Ask(Session* session, const ExportVerb& verb) {
    return RunExport(session, verb, out_);
  }
  absl::Status Ask(Session* session, const MapVerb& verb) { return RunMap(session, verb, out_); }

  const Command& command_;
  const Environment& environment_;
  std::ostream& out_;
  std::ostream& errors_;
};

absl::Status RunCommand(const std::vector<std::string>& arguments, const Environment& environment,
                        std::ostream& out, std::ostream& errors) {
  DSG_ASSIGN_OR_RETURN(const Command command, ParseArguments(arguments, environment));
  DSG_RETURN_IF_ERROR(std::visit(Dispatcher(command, environment, out, errors), command.verb));
  out.flush();
  // A full disk or a closed pipe behind `out` must not look like a complete answer.
  if (!out) return absl::UnavailableError("the answer could not be written out in full");
  return absl::OkStatus();
}

}  // namespace

int Run(const std::vector<std::string>& arguments, const Environment& environment,
        std::ostream& out, std::ostream& errors) {
  const absl::Status status = RunCommand(arguments, environment, out, errors);
  if (!status.ok()) errors << ErrorLine(status) << std::flush;
  return ExitCodeOf(status);
}

}  // namespace dsg::cli
