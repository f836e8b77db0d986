// SPDX-License-Identifier: Apache-2.0
#include "query/cli/run.h"

#include "query/cli/errors.h"
#include "query/cli/near_names.h"
#include "query/cli/session.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

absl::StatusOr<ExitCode> RunCommand(const std::vector<std::string>& arguments,
                                    const Environment& environment, std::ostream& out,
                                    std::ostream& errors) {
  DSG_ASSIGN_OR_RETURN(const Command command, ParseArguments(arguments, environment));
  Session session(command.common, environment.version, &errors);
  if (command.opens != Opens::kNothing) DSG_RETURN_IF_ERROR(session.Open());
  absl::Status answered;
  if (command.opens == Opens::kMap) answered = session.ChooseMap();
  out << command.help;
  if (answered.ok() && command.run) answered = command.run(&session, out);
  if (!answered.ok() && command.opens != Opens::kNothing) {
    return WithNearNames(&session, session.times().Explain(answered));
  }
  DSG_RETURN_IF_ERROR(answered);
  out.flush();
  // A full disk or a closed pipe must not look like a complete answer.
  if (!out) return absl::UnavailableError("the answer could not be written out in full");
  return session.found() ? kFound : kNotFound;
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
