// SPDX-License-Identifier: Apache-2.0
#include "query/maintenance/prune_convert.h"

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/request.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/retention/policy.h"

namespace dsg::query {
namespace {

using Policy = PrunePolicy;

class WhatToProto {
 public:
  explicit WhatToProto(v1::PrunePolicy* out) : out_(*out) {}
  void operator()(const std::monostate&) const {}
  void operator()(const Policy::Branch& what) const { out_.set_branch(what.id_or_name); }
  void operator()(const Policy::Region& what) const {
    dsg::ToProto(what.box_map, out_.mutable_region_map());
  }
  void operator()(const Policy::Before& what) const { out_.set_before_ns(what.at_ns); }
  void operator()(const Policy::OlderThan& what) const { out_.set_older_than_ns(what.age_ns); }
  void operator()(const Policy::WholeLayer& what) const { out_.set_layer(what.name); }
  void operator()(const Policy::UnseenSince& what) const { out_.set_unseen_since_ns(what.at_ns); }
  void operator()(const Policy::UnseenFor& what) const { out_.set_unseen_for_ns(what.age_ns); }
  void operator()(const Policy::HistoryOlderThan& what) const {
    out_.set_history_older_than_ns(what.age_ns);
  }
  void operator()(const Policy::HistoryBefore& what) const {
    out_.set_history_before_revision(what.revision);
  }

 private:
  v1::PrunePolicy& out_;
};

absl::StatusOr<Policy::What> WhatFromProto(const v1::PrunePolicy& in) {
  switch (in.what_case()) {
    case v1::PrunePolicy::kBranch:
      return Policy::Branch{in.branch()};
    case v1::PrunePolicy::kRegionMap: {
      DSG_ASSIGN_OR_RETURN(const Box3d box, BoxFromProto(in.region_map(), "policies.region_map"));
      return Policy::Region{box};
    }
    case v1::PrunePolicy::kBeforeNs:
      return Policy::Before{in.before_ns()};
    case v1::PrunePolicy::kOlderThanNs:
      return Policy::OlderThan{in.older_than_ns()};
    case v1::PrunePolicy::kLayer:
      return Policy::WholeLayer{in.layer()};
    case v1::PrunePolicy::kUnseenSinceNs:
      return Policy::UnseenSince{in.unseen_since_ns()};
    case v1::PrunePolicy::kUnseenForNs:
      return Policy::UnseenFor{in.unseen_for_ns()};
    case v1::PrunePolicy::kHistoryOlderThanNs:
      return Policy::HistoryOlderThan{in.history_older_than_ns()};
    case v1::PrunePolicy::kHistoryBeforeRevision:
      return Policy::HistoryBefore{in.history_before_revision()};
    case v1::PrunePolicy::WHAT_NOT_SET:
      break;
  }
  return Policy::What();
}

// For the log of revisions.
class NameOf {
 public:
  explicit NameOf(const MapSpec& map) : map_(map) {}

  std::string operator()(const std::monostate&) const { return "all tracks"; }
  std::string operator()(const Policy::Branch& what) const { return "branch " + what.id_or_name; }
  std::string operator()(const Policy::Region&) const { return "region"; }
  std::string operator()(const Policy::Before& what) const {
    return "before " + Instant(what.at_ns);
  }
  std::string operator()(const Policy::OlderThan& what) const {
    return "older than " + FormatAge(what.age_ns);
  }
  std::string operator()(const Policy::WholeLayer& what) const { return "layer " + what.name; }
  std::string operator()(const Policy::UnseenSince& what) const {
    return "unseen since " + Instant(what.at_ns);
  }
  std::string operator()(const Policy::UnseenFor& what) const {
    return "unseen for " + FormatAge(what.age_ns);
  }
  std::string operator()(const Policy::HistoryOlderThan& what) const {
    return "history older than " + FormatAge(what.age_ns);
  }
  std::string operator()(const Policy::HistoryBefore& what) const {
    return absl::StrCat("history before revision ", what.revision);
  }

 private:
  // A clock that is not UTC has no dates.
  std::string Instant(TimeNs at_ns) const {
    return map_.clock == Clock::kUnix ? FormatRfc3339(at_ns) : FormatRelative(at_ns, map_.epoch_ns);
  }

  const MapSpec& map_;
};

}  // namespace

void ToProto(const PrunePolicy& policy, v1::PrunePolicy* out) {
  out->set_name(policy.name);
  std::visit(WhatToProto(out), policy.what);
  for (const std::string& layer : policy.layers) out->add_layers(layer);
  out->set_simplify_m(policy.simplify_m);
  if (policy.IsThinning()) out->set_simplify_rad(policy.simplify_rad);
  out->set_strength(policy.strength == PruneStrength::kErase ? v1::ERASE
                                                             : v1::PRUNE_STRENGTH_UNSPECIFIED);
}

absl::StatusOr<PrunePolicy> FromProto(const v1::PrunePolicy& in, const MapSpec& map) {
  if (!v1::PruneStrength_IsValid(in.strength())) {
    return FieldError("policies.strength", absl::StrCat(static_cast<int>(in.strength())),
                      "give RETIRE or ERASE");
  }
  PrunePolicy policy;
  policy.name = in.name();
  DSG_ASSIGN_OR_RETURN(policy.what, WhatFromProto(in));
  policy.layers.assign(in.layers().begin(), in.layers().end());
  policy.simplify_m = in.simplify_m();
  if (in.simplify_rad() != 0.0) policy.simplify_rad = in.simplify_rad();
  if (in.simplify_rad() != 0.0 && in.simplify_m() == 0.0) {
    return FieldError("simplify_rad", absl::StrCat(in.simplify_rad()),
                      "give simplify_m too: without it a policy forgets and does not thin");
  }
  if (in.strength() == v1::ERASE) policy.strength = PruneStrength::kErase;
  // Before it has a name: one made of a node's name may be too long.
  DSG_RETURN_IF_ERROR(policy.Validate());
  if (policy.name.empty()) {
    policy.name = std::visit(NameOf(map), policy.what);
    // Messages of revisions stay: they must not tell the name of what is erased.
    const bool is_branch = std::holds_alternative<Policy::Branch>(policy.what);
    if (is_branch && policy.strength == PruneStrength::kErase) policy.name = "branch";
    if (policy.IsThinning()) {
      policy.name = absl::StrCat("thin ", policy.name, " to ", policy.simplify_m, " m");
    }
    if (!policy.Validate().ok()) policy.name = "branch";
  }
  return policy;
}

void ToProto(const Amount& amount, v1::Amount* out) {
  out->set_node_count(amount.node_count);
  out->set_edge_count(amount.edge_count);
  out->set_pose_count(amount.pose_count);
  out->set_shape_count(amount.shape_count);
  out->set_factor_count(amount.factor_count);
  out->set_stay_count(amount.stay_count);
  out->set_stay_edit_count(amount.stay_edit_count);
  out->set_mesh_block_count(amount.mesh_block_count);
  out->set_asset_count(amount.asset_count);
  out->set_revision_count(amount.revision_count);
  out->set_byte_count(amount.byte_count);
}

}  // namespace dsg::query
