// SPDX-License-Identifier: Apache-2.0
// The verb factors: the pose-graph factors of an agent.
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/list_writer.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

struct FactorsVerb {
  std::string agent;
  std::string from;
  std::string to;
};

std::vector<ListColumn> FactorColumns() {
  return {{"from", CellType::kTime},
          {"to", CellType::kTime},
          {"type"},
          {"of"},
          {"x m", CellType::kReal, 3},
          {"y m", CellType::kReal, 3},
          {"z m", CellType::kReal, 3},
          {"yaw deg", CellType::kReal, 1},
          {"information"}};
}

// `agent_id`: whose factors they are.
Row FactorRow(const v1::PoseFactor& factor, const std::string& agent_id) {
  const v1::Vector3& p = factor.relative_pose().position();
  return {factor.from_time_ns(),
          factor.to_time_ns(),
          factor.type(),
          factor.to_agent().empty() ? agent_id : factor.to_agent(),
          p.x(),
          p.y(),
          p.z(),
          YawDeg(factor.relative_pose()),
          factor.information().empty() ? "none" : "6x6"};
}

absl::Status RunFactors(Session* session, const FactorsVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::ListFactorsRequest>();
  request.set_agent(verb.agent);
  DSG_RETURN_IF_ERROR(SetInstant("--from", verb.from, session->map(), &request,
                                 &v1::ListFactorsRequest::set_from_ns));
  DSG_RETURN_IF_ERROR(
      SetInstant("--to", verb.to, session->map(), &request, &v1::ListFactorsRequest::set_to_ns));
  ListWriter list(session->common(), session->times(), "factors", FactorColumns(), &out);
  int64_t left = EntriesLeft(session->common().limit);
  std::string agent_id;
  int64_t revision = 0;
  absl::Status written;
  DSG_RETURN_IF_ERROR(
      session->Read(&query::Api::ListFactors, request, [&](v1::ListFactorsResponse message) {
        // The first message has both.
        if (message.has_header()) {
          agent_id = message.agent_id();
          revision = message.header().read_revision();
        }
        CutToLimit(message.mutable_factors(), &left);
        written = list.Add(message, message.factors(), [&](const v1::PoseFactor& factor) {
          return FactorRow(factor, agent_id);
        });
        return written.ok() && left > 0;
      }));
  DSG_RETURN_IF_ERROR(written);
  return list.End(absl::StrCat(Counted(list.count(), "factor"), " of ", agent_id, " (revision ",
                               revision, ")\n"));
}

}  // namespace

void AddFactorsVerb(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<FactorsVerb>({.name = "factors",
                                                      .what = "The pose-graph factors of an agent",
                                                      .example = "body --from +10s --to +20s",
                                                      .takes = kQuestion | kLimit | kFormat,
                                                      .run = RunFactors});
  app->add_option("AGENT", verb->agent, "Node id (r0) or the name in the log (body)")->required();
  app->add_option("--from", verb->from, "Factors that begin at this TIME or later");
  app->add_option("--to", verb->to, "Factors that begin before this TIME");
}

}  // namespace dsg::cli
