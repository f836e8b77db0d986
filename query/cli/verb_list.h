// SPDX-License-Identifier: Apache-2.0
// The list of verbs, in the order of `dsg --help`. A new verb is added here.
#pragma once

#include <array>

#include "query/cli/grammar.h"

namespace dsg::cli {

// Each stands in verb_NAME.cc or verbs_NAME.cc: options, help, request and text of the verb.
void AddAgentVerbs(Grammar* grammar);
void AddShapeVerb(Grammar* grammar);
void AddMeetingVerbs(Grammar* grammar);
void AddPredictVerb(Grammar* grammar);
void AddGraphVerbs(Grammar* grammar);
void AddSearchVerbs(Grammar* grammar);
void AddSpaceVerbs(Grammar* grammar);
void AddChangeVerbs(Grammar* grammar);
void AddMapsVerbs(Grammar* grammar);
void AddImportVerb(Grammar* grammar);
void AddStoreVerbs(Grammar* grammar);
void AddExportVerb(Grammar* grammar);
void AddMapVerb(Grammar* grammar);
void AddKeepVerbs(Grammar* grammar);
void AddBackupVerbs(Grammar* grammar);
void AddMergeVerb(Grammar* grammar);
void AddPruneVerb(Grammar* grammar);
void AddAssetVerb(Grammar* grammar);
void AddFactorsVerb(Grammar* grammar);
void AddDropVerbs(Grammar* grammar);
void AddSetVerb(Grammar* grammar);
void AddCompletionVerb(Grammar* grammar);
void AddViewVerb(Grammar* grammar);
void AddHistoryVerbs(Grammar* grammar);

inline constexpr std::array kVerbs = {
    &AddAgentVerbs,  &AddShapeVerb,      &AddMeetingVerbs, &AddPredictVerb, &AddGraphVerbs,
    &AddSearchVerbs, &AddSpaceVerbs,     &AddChangeVerbs,  &AddMapsVerbs,   &AddImportVerb,
    &AddStoreVerbs,  &AddExportVerb,     &AddMapVerb,      &AddKeepVerbs,   &AddBackupVerbs,
    &AddMergeVerb,   &AddPruneVerb,      &AddAssetVerb,    &AddFactorsVerb, &AddDropVerbs,
    &AddSetVerb,     &AddCompletionVerb, &AddViewVerb,     &AddHistoryVerbs};

}  // namespace dsg::cli
