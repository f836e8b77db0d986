// SPDX-License-Identifier: Apache-2.0
// From evidence to probabilities. Names nobody unless the best candidate is clearly better than the
// rest.
#pragma once

#include <string>
#include <vector>

#include "schema/base/time.h"
#include "schema/model/ids.h"

namespace dsg::query {

inline constexpr char kUnseen[] = "unseen";
inline constexpr char kFalseChange[] = "false_change";

struct EvidenceRow {
  std::string kind;
  double log_weight = 0.0;
  double value = 0.0;
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  std::string source;
  std::string detail;
};

struct Suspect {
  /// Empty for alternatives.
  NodeId agent;
  std::string alternative;
  double probability = 0.0;
  TimeNs at_ns = 0;
  /// Seen within reach, or known to be somebody who was. Others are not named, however likely.
  bool was_near = true;
  std::vector<EvidenceRow> evidence;

  double LogOdds() const;
};

/// `later` is perhaps `earlier`, seen again.
struct SameAgent {
  NodeId later;
  NodeId earlier;
  double probability = 0.0;
};

struct Verdict {
  /// Descending probability, then id, the alternatives last; the probabilities sum to 1.
  std::vector<Suspect> candidates;
  bool abstained = false;
  std::string reason;
};

/// Softmax of the sums of log weights; what is known of identities moves its share from the later
/// track to the earlier one, which becomes a candidate by that if it was none.
/// Order of `same`: any; chains are followed from the highest id down.
Verdict Judge(std::vector<Suspect> candidates, std::vector<SameAgent> same);

}  // namespace dsg::query
