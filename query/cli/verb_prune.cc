// SPDX-License-Identifier: Apache-2.0
// The verb prune: forgets a part of a map.
#include <unistd.h>

#include <iostream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "query/cli/interrupt.h"
#include "query/cli/json.h"
#include "query/cli/progress.h"
#include "query/cli/render_prune.h"
#include "query/cli/values.h"
#include "query/cli/verbs.h"
#include "query/maintenance/prune_convert.h"
#include "schema/base/status.h"
#include "schema/retention/policy.h"
#include "schema/retention/policy_file.h"

namespace dsg::cli {
namespace {

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

// What is said by options is a file of one policy.
absl::StatusOr<PolicyFile> PoliciesOf(const PruneVerb& verb, const MapSpec& map) {
  if (!verb.policy_file.empty()) return ReadPolicyFile(verb.policy_file);
  PrunePolicy policy;
  DSG_ASSIGN_OR_RETURN(policy.what, WhatOf(verb, map));
  policy.layers = verb.only;
  policy.simplify_m = verb.simplify_m;
  if (verb.erase) policy.strength = PruneStrength::kErase;
  if (std::holds_alternative<std::monostate>(policy.what) && !policy.IsThinning()) {
    return MakeError(Reason::kFieldInvalid,
                     "say what to forget: --branch, --region, --before, --older-than, --layer, "
                     "--unseen-since, --unseen-for, --history-older-than, --history-before, "
                     "--simplify or --policy");
  }
  DSG_RETURN_IF_ERROR(policy.Validate());
  PolicyFile file;
  file.policies = {std::move(policy)};
  return file;
}

// What all messages say together: reports stand in the first, ends in the last.
absl::StatusOr<v1::PruneResponse> Run(Session* session, const v1::PruneRequest& request,
                                      std::ostream& progress_out) {
  Progress progress(absl::StrCat("prune ", session->map().name), &progress_out);
  query::CallContext call = session->NewCall();
  const InterruptGuard guard(&call);
  v1::PruneResponse all;
  DSG_RETURN_IF_ERROR(query::ReadStream(call, session->api().Prune(call, request),
                                        [&](const v1::PruneResponse& message) {
                                          progress.Update(message.progress());
                                          all.MergeFrom(message);
                                          return true;
                                        }));
  return all;
}

// A person says whether everything may go; nobody is there to ask a script.
bool AskPerson(const absl::Status& refusal, std::ostream& questions) {
  if (isatty(STDIN_FILENO) == 0) return false;
  questions << "dsg: " << refusal.message() << "\nForget it all? [y/N] " << std::flush;
  std::string answer;
  return std::getline(std::cin, answer) && (answer == "y" || answer == "yes");
}

// A script must not take for erased what is still there.
absl::Status CheckErased(Session* session, const v1::PruneResponse& reply) {
  if (reply.erased()) return absl::OkStatus();
  const auto request = session->Begin<v1::GetMapStatsRequest>();
  v1::GetMapStatsResponse stats;
  DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &stats));
  const v1::PendingErasure& pending = stats.pending_erasure();
  const bool is_named = pending.node_count() + pending.edge_count() + pending.mesh_block_count() +
                            pending.span_count() >
                        0;
  std::string why = "a reader kept its log; stop the readers and do the same again";
  if (is_named) why = "an earlier prune that was cut off; run that one again (see dsg stats)";
  if (reply.left_count() > 0) {
    why = "others went on writing it; stop the writers and do the same again";
  }
  return MakeError(
      Reason::kWriterLocked,
      absl::StrCat("map \"", request.map(), "\" still holds some of what was to be erased: ", why),
      {{"map", request.map()}, {"left_count", absl::StrCat(reply.left_count())}});
}

}  // namespace

absl::Status RunPrune(Session* session, const PruneVerb& verb, std::ostream& out,
                      std::ostream& progress_out) {
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
  auto reply = Run(session, request, progress_out);
  if (ReasonOf(reply.status()) == Reason::kPolicyMatchesAll) {
    if (!AskPerson(reply.status(), progress_out)) {
      return Annotate(reply.status(), "refused without --yes");
    }
    request.set_allow_everything(true);
    reply = Run(session, request, progress_out);
  }
  DSG_RETURN_IF_ERROR(reply.status());
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(*reply, out));
  } else {
    out << RenderPrune(*reply, verb.dry_run, is_erase);
  }
  return is_erase && !verb.dry_run ? CheckErased(session, *reply) : absl::OkStatus();
}

}  // namespace dsg::cli
