// SPDX-License-Identifier: Apache-2.0
// The verb factors: the pose-graph factors of an agent.
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/json.h"
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

std::string RenderFactors(const v1::ListFactorsResponse& reply, const TimeText& times) {
  Table table({{"from", Align::kRight},
               {"to", Align::kRight},
               {"type"},
               {"of"},
               {"x m", Align::kRight},
               {"y m", Align::kRight},
               {"z m", Align::kRight},
               {"yaw deg", Align::kRight},
               {"information"}});
  for (const v1::PoseFactor& factor : reply.factors()) {
    const v1::Vector3& p = factor.relative_pose().position();
    table.AddRow({times.Relative(factor.from_time_ns()), times.Relative(factor.to_time_ns()),
                  Printable(factor.type()),
                  factor.to_agent().empty() ? reply.agent_id() : factor.to_agent(), Fixed(p.x(), 3),
                  Fixed(p.y(), 3), Fixed(p.z(), 3), Fixed(YawDeg(factor.relative_pose()), 1),
                  factor.information().empty() ? "none" : "6x6"});
  }
  return absl::StrCat(table.Render(), Counted(reply.factors_size(), "factor"), " of ",
                      reply.agent_id(), " (revision ", reply.header().read_revision(), ")\n");
}

absl::Status RunFactors(Session* session, const FactorsVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::ListFactorsRequest>();
  request.set_agent(verb.agent);
  DSG_RETURN_IF_ERROR(SetInstant("--from", verb.from, session->map(), &request,
                                 &v1::ListFactorsRequest::set_from_ns));
  DSG_RETURN_IF_ERROR(
      SetInstant("--to", verb.to, session->map(), &request, &v1::ListFactorsRequest::set_to_ns));
  const int64_t count_max = EntriesLeft(session->common().limit);
  v1::ListFactorsResponse all;
  DSG_RETURN_IF_ERROR(
      session->Read(&query::Api::ListFactors, request, [&](const v1::ListFactorsResponse& message) {
        all.MergeFrom(message);
        return all.factors_size() < count_max;
      }));
  if (all.factors_size() > count_max) {
    all.mutable_factors()->DeleteSubrange(static_cast<int>(count_max),
                                          all.factors_size() - static_cast<int>(count_max));
  }
  if (session->common().json) return WriteJson(all, out);
  out << RenderFactors(all, session->times());
  return absl::OkStatus();
}

}  // namespace

void AddFactorsVerb(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<FactorsVerb>({.name = "factors",
                                                      .what = "The pose-graph factors of an agent",
                                                      .example = "body --from +10s --to +20s",
                                                      .takes = kQuestion | kLimit,
                                                      .run = RunFactors});
  app->add_option("AGENT", verb->agent, "Node id (r0) or the name in the log (body)")->required();
  app->add_option("--from", verb->from, "Factors that begin at this TIME or later");
  app->add_option("--to", verb->to, "Factors that begin before this TIME");
}

}  // namespace dsg::cli
