// SPDX-License-Identifier: Apache-2.0
// The grammar of the verb merge.
#include "query/cli/grammar.h"

namespace dsg::cli {

void AddMergeVerb(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<MergeVerb>(
      "merge", "Take another map of the same place into this one", kServer | kMap | kJson);
  app->add_option("OTHER", verb->other, "The map that is taken in; it stays as it is")->required();
  app->add_option(
      "--transform", verb->transform,
      "X,Y,Z,YAW or X,Y,Z,QX,QY,QZ,QW: carries points of OTHER into the map, metres and "
      "radians; estimated from things that both have seen if not given");
  app->add_flag("--dry-run", verb->dry_run, "Only say what would become of it");
  app->add_flag("--yes", verb->yes, "Do not ask when little speaks for the transform");
  AddPicture(app, "what both maps have, what is new and what is gone", &verb->picture);
}

}  // namespace dsg::cli
