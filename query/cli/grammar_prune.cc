// SPDX-License-Identifier: Apache-2.0
// The grammar of the verb prune.
#include "query/cli/grammar.h"
#include "query/cli/number_checks.h"

namespace dsg::cli {

void AddPruneVerb(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<PruneVerb>("prune", "Forget a part of a map", kServer | kMap | kJson);
  CLI::Option_group* const what = app->add_option_group("What", "What to forget");
  what->add_option("--branch", verb->branch, "A node by id or name, and all that it contains");
  what->add_option("--region", verb->region,
                   "X0,Y0,Z0,X1,Y1,Z1: nodes, poses and mesh inside; begin a metre below the "
                   "floor, about which feet scatter");
  what->add_option("--before", verb->before, "Tracks before this TIME, and nodes that ended");
  what->add_option("--older-than", verb->older_than,
                   "The same, counted back from the newest observation: 90s, 24h, 30d");
  what->add_option("--layer", verb->layer, "All of a layer: mesh, objects, agents, ...");
  what->add_option("--unseen-since", verb->unseen_since, "Nodes last observed before this TIME");
  what->add_option("--unseen-for", verb->unseen_for,
                   "The same, counted back from the newest observation");
  what->add_option("--history-older-than", verb->history_older_than,
                   "Revisions committed longer ago than this that have no tag: 30d");
  what->add_option("--history-before", verb->history_before,
                   "Revisions before this one that have no tag")
      ->check(WholeZeroOrMore());
  CLI::Option* file =
      what->add_option("--policy", verb->policy_file, "A file of policies (docs/forgetting.md)");
  what->require_option(0, 1);
  CLI::Option* simplify =
      app->add_option("--simplify", verb->simplify_m,
                      "Do not forget tracks but thin them: drop poses that interpolation gives "
                      "back within so many metres")
          ->check(AboveZero());
  CLI::Option* only =
      app->add_option("--only", verb->only, "Only of this layer; may be given several times");
  CLI::Option* retire = app->add_flag_callback(
      "--retire", [] {}, "New revisions are without it, older ones still know; the default");
  CLI::Option* erase = app->add_flag(
      "--erase", verb->erase, "No revision knows any more, and the bytes are wiped from the disk");
  erase->excludes(retire);
  for (CLI::Option* other : {simplify, only, retire, erase}) file->excludes(other);
  app->add_option("--share-max", verb->share_max,
                  "Refuse to take more than this share of the nodes or of the poses, up to 1; "
                  "default that of the policy file, or no limit")
      ->check(AboveZero())
      ->check(Between(0.0, 1.0));
  app->add_flag("--dry-run", verb->dry_run,
                "Only say what would go, and whether the run would be refused");
  app->add_flag("--yes", verb->yes,
                "Do not ask when a policy matches every node, every pose or the only building");
}

}  // namespace dsg::cli
