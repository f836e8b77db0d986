// SPDX-License-Identifier: Apache-2.0
#include "query/cli/run.h"

#include <memory>
#include <variant>

#include "query/cli/exit_code.h"
#include "query/cli/flag_names.h"
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
  absl::Status operator()(const VerifyVerb& verb) {
    return RunVerify(command_.common, verb, out_, errors_);
  }
  absl::Status operator()(const RestoreVerb& verb) {
    return RunRestore(command_.common, verb, out_, errors_);
  }
  absl::Status operator()(const BackupVerb& verb) {
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<Session> session, Session::Open(command_.common));
    return RunBackup(session.get(), verb, out_, errors_);
  }
  absl::Status operator()(const UpgradeVerb&) { return RunUpgrade(command_.common, out_); }
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

  /// False if the answer is that there is none, which is no error.
  bool found() const { return found_; }

 private:
  absl::Status Ask(Session* session, const CollideVerb& verb) {
    return RunCollide(session, verb, out_, &found_);
  }
  absl::Status Ask(Session* session, const TagVerb& verb) { return RunTag(session, verb, out_); }
  absl::Status Ask(Session* session, const CompactVerb& verb) {
    return RunCompact(session, verb, out_, errors_);
  }
  absl::Status Ask(Session* session, const RevertVerb& verb) {
    return RunRevert(session, verb, out_, errors_);
  }
  absl::Status Ask(Session* session, const MergeVerb& verb) {
    return RunMerge(session, verb, out_, errors_);
  }
  absl::Status Ask(Session* session, const PruneVerb& verb) {
    return RunPrune(session, verb, out_, errors_);
  }
  absl::Status Ask(Session* session, const LogVerb&) { return RunLog(session, out_); }
  absl::Status Ask(Session* session, const StatsVerb&) { return RunStats(session, out_); }
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
  absl::Status Ask(Session* session, const MetVerb& verb) { return RunMet(session, verb, out_); }
  absl::Status Ask(Session* session, const PickedVerb& verb) {
    return RunPicked(session, verb, out_);
  }
  absl::Status Ask(Session* session, const PredictVerb& verb) {
    return RunPredict(session, verb, out_);
  }
  absl::Status Ask(Session* session, const FindVerb& verb) { return RunFind(session, verb, out_); }
  absl::Status Ask(Session* session, const PathVerb& verb) { return RunPath(session, verb, out_); }
  absl::Status Ask(Session* session, const ListVerb& verb) { return RunList(session, verb, out_); }
  absl::Status Ask(Session* session, const EdgesVerb& verb) {
    return RunEdges(session, verb, out_);
  }
  absl::Status Ask(Session* session, const ShowVerb& verb) { return RunShow(session, verb, out_); }
  absl::Status Ask(Session* session, const NearVerb& verb) { return RunNear(session, verb, out_); }
  absl::Status Ask(Session* session, const AroundVerb& verb) {
    return RunAround(session, verb, out_);
  }
  absl::Status Ask(Session* session, const SubgraphVerb& verb) {
    return RunSubgraph(session, verb, out_);
  }
  absl::Status Ask(Session* session, const DiffVerb& verb) { return RunDiff(session, verb, out_); }
  absl::Status Ask(Session* session, const WatchVerb& verb) {
    return RunWatch(session, verb, out_, errors_);
  }
  absl::Status Ask(Session* session, const ExportVerb& verb) {
    return RunExport(session, verb, out_, errors_);
  }
  absl::Status Ask(Session* session, const MapVerb& verb) { return RunMap(session, verb, out_); }
  absl::Status Ask(Session* session, const OwnVerb& verb) { return verb.run(session, out_); }

  const Command& command_;
  const Environment& environment_;
  std::ostream& out_;
  std::ostream& errors_;
  bool found_ = true;
};

absl::StatusOr<ExitCode> RunCommand(const std::vector<std::string>& arguments,
                                    const Environment& environment, std::ostream& out,
                                    std::ostream& errors) {
  DSG_ASSIGN_OR_RETURN(const Command command, ParseArguments(arguments, environment));
  Dispatcher dispatcher(command, environment, out, errors);
  DSG_RETURN_IF_ERROR(std::visit(dispatcher, command.verb));
  out.flush();
  // A full disk or a closed pipe behind `out` must not look like a complete answer.
  if (!out) return absl::UnavailableError("the answer could not be written out in full");
  return dispatcher.found() ? kFound : kNotFound;
}

}  // namespace

int Run(const std::vector<std::string>& arguments, const Environment& environment,
        std::ostream& out, std::ostream& errors) {
  const absl::StatusOr<ExitCode> code = RunCommand(arguments, environment, out, errors);
  if (code.ok()) return *code;
  errors << ErrorLine(InFlags(code.status())) << std::flush;
  return ExitCodeOf(code.status());
}

}  // namespace dsg::cli
