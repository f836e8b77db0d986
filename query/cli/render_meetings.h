// SPDX-License-Identifier: Apache-2.0
// Who met whom and who picked what, as text for people. Only turns replies into words.
#pragma once

#include <string>

#include "query/cli/node_names.h"
#include "query/cli/time_text.h"

namespace dsg::v1 {
class InteractionCandidate;
class ListEncountersResponse;
class ListInteractionsResponse;
}  // namespace dsg::v1

namespace dsg::cli {

/// A line a meeting, then who was observed at all.
std::string RenderEncounters(const v1::ListEncountersResponse& reply, const TimeText& times,
                             const NodeNames& names);

/// "carol (H1)", "somebody unseen", "nobody: no real change".
std::string CandidateText(const v1::InteractionCandidate& candidate);

/// A line a candidate, those of one object together. `with_evidence`: each followed by its
/// evidence.
std::string RenderInteractions(const v1::ListInteractionsResponse& reply, const TimeText& times,
                               const NodeNames& names, bool with_evidence);

}  // namespace dsg::cli
