// SPDX-License-Identifier: Apache-2.0
// The list of verbs, by heading and in the order of `dsg --help`. A new verb is added here.
#pragma once

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
void AddVersionVerb(Grammar* grammar);
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
void AddAuditVerb(Grammar* grammar);

inline void AddAllVerbs(Grammar* grammar) {
  grammar->set_heading("Ask about people and robots");
  AddAgentVerbs(grammar);
  AddShapeVerb(grammar);
  AddMeetingVerbs(grammar);
  AddPredictVerb(grammar);
  AddFactorsVerb(grammar);

  grammar->set_heading("Ask about rooms, objects and the space between them");
  AddSearchVerbs(grammar);
  AddGraphVerbs(grammar);
  AddHistoryVerbs(grammar);
  AddSpaceVerbs(grammar);
  AddAssetVerb(grammar);

  grammar->set_heading("Look");
  AddMapVerb(grammar);
  AddViewVerb(grammar);

  grammar->set_heading("Maps and their revisions");
  AddMapsVerbs(grammar);
  AddChangeVerbs(grammar);
  AddSetVerb(grammar);
  AddMergeVerb(grammar);
  AddDropVerbs(grammar);

  grammar->set_heading("Keep and forget");
  AddKeepVerbs(grammar);
  AddPruneVerb(grammar);
  AddBackupVerbs(grammar);
  AddStoreVerbs(grammar);
  AddAuditVerb(grammar);

  grammar->set_heading("In and out");
  AddImportVerb(grammar);
  AddExportVerb(grammar);

  grammar->set_heading("This program");
  AddCompletionVerb(grammar);
  AddVersionVerb(grammar);
}

}  // namespace dsg::cli
