// SPDX-License-Identifier: Apache-2.0
// The verbs that stand each in one file, verb_NAME.cc: options, help, what they ask and print. A
// new verb is added here.
#pragma once

#include <array>

#include "query/cli/grammar.h"

namespace dsg::cli {

void AddAssetVerb(Grammar* grammar);
void AddFactorsVerb(Grammar* grammar);

inline constexpr std::array kOwnVerbs = {&AddAssetVerb, &AddFactorsVerb};

}  // namespace dsg::cli
