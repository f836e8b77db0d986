// SPDX-License-Identifier: Apache-2.0
// Policies and amounts as messages and back. PrunePolicy::Validate judges a policy.
#pragma once

#include "absl/status/statusor.h"
#include "schema/model/layer.h"
#include "schema/retention/amount.h"
#include "schema/retention/policy.h"

namespace dsg::v1 {
class Amount;
class PrunePolicy;
}  // namespace dsg::v1

namespace dsg::query {

void ToProto(const PrunePolicy& policy, v1::PrunePolicy* out);
/// A policy without a name gets one that says what it does; `map` tells how instants read.
/// Errors: BOX_INVERTED, NUMBER_NOT_FINITE; FIELD_INVALID for a strength that is none; what
/// PrunePolicy::Validate returns.
absl::StatusOr<PrunePolicy> FromProto(const v1::PrunePolicy& in, const MapSpec& map);

void ToProto(const Amount& amount, v1::Amount* out);

}  // namespace dsg::query
