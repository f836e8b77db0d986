// SPDX-License-Identifier: Apache-2.0
// The grammar of the verbs about nodes and edges: ls, edges, show, near; find, around, subgraph.
#include "query/cli/grammar.h"
#include "query/cli/number_checks.h"

namespace dsg::cli {
namespace {

void AddNear(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<NearVerb>("near", "The nodes nearest to a point", kQuestion);
  app->add_option("POSITION", verb->position, "X,Y,Z in the map frame, metres")->required();
  app->add_option("-k,--k", verb->k, "How many")->check(Between(1, 1000))->capture_default_str();
  app->add_option("--max-distance", verb->max_distance_m, "No further than this, metres")
      ->check(AboveZero());
  AddFilter(app, &verb->filter);
}

void AddFind(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<FindVerb>(
      "find", "Nodes by class, name, colour, attribute, relation and room", kQuestion);
  app->add_option("QUERY", verb->words,
                  "cup and color = red on table in (room \"Dining room\"); see docs/search.md")
      ->required();
  CLI::Option* near =
      app->add_option("--near", verb->near, "Nearest first from X,Y,Z in the map frame, metres");
  app->add_option("--max-distance", verb->max_distance_m, "No further from there than this, metres")
      ->check(AboveZero())
      ->needs(near);
  app->add_option("--box", verb->box, "Only nodes that touch X0,Y0,Z0,X1,Y1,Z1, metres");
  app->add_option("--at", verb->at, "What held at this TIME; default now or before");
  app->add_option("-k,--limit", grammar->common()->limit, "List at most this many")
      ->check(WholeAboveZero());
  app->add_flag("--explain", verb->explain, "Also show how the answer was found");
  AddPicture(app, "what was found", &verb->picture);
}

void AddAround(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<AroundVerb>(
      "around", "The edges of a node and what is at their other ends", kQuestion | kLimit);
  app->add_option("ID", verb->id, "Node id (O42) or a name that is unique")->required();
  app->add_option("--relation", verb->relations, "Only this relation; may be given again")
      ->allow_extra_args(false);
  app->add_flag("--out", verb->outgoing, "Only edges from the node");
  app->add_flag("--in", verb->incoming, "Only edges to the node");
  app->add_option("--at", verb->at, "Only what held at this TIME");
}

void AddSubgraph(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<SubgraphVerb>(
      "subgraph", "A node and all that can be reached from it", kQuestion);
  app->add_option("ID", verb->id, "Node id (R2) or a name that is unique")->required();
  app->add_option("--relation", verb->relations,
                  "Follow this relation; may be given again; default CONTAINS")
      ->allow_extra_args(false);
  app->add_flag("--both", verb->both_directions, "Also against the direction of edges");
  app->add_option("--depth", verb->depth, "No more edges than this from the node")
      ->check(WholeAboveZero());
  app->add_flag("--tree", verb->tree_only, "Only the edges that were followed");
  AddFilter(app, &verb->filter);
}

}  // namespace

void AddGraphVerbs(Grammar* grammar) {
  const auto [list_app, list] = grammar->Add<ListVerb>("ls", "List nodes", kQuestion | kLimit);
  AddFilter(list_app, &list->filter);
  list_app->add_option("--parent", list->parent, "Only children of this node");
  list_app->add_option("--name", list->name, "Only nodes of exactly this name");
  list_app->add_option("--box", list->box, "Only nodes that touch X0,Y0,Z0,X1,Y1,Z1, metres");

  const auto [edges_app, edges] =
      grammar->Add<EdgesVerb>("edges", "List edges", kQuestion | kLimit);
  edges_app->add_option("--source", edges->source, "Only edges from this node");
  edges_app->add_option("--relation", edges->relation, "Only this relation: CONTAINS, ON, ...");
  edges_app->add_option("--target", edges->target, "Only edges to this node");
  edges_app->add_option("--at", edges->at, "Only edges that held at this TIME");

  const auto [show_app, show] =
      grammar->Add<ShowVerb>("show", "All that is known of one node", kQuestion);
  show_app->add_option("ID", show->id, "Node id (O42) or a name that is unique")->required();
  AddNear(grammar);
}

void AddSearchVerbs(Grammar* grammar) {
  AddFind(grammar);
  AddAround(grammar);
  AddSubgraph(grammar);
}

}  // namespace dsg::cli
