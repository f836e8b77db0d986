// SPDX-License-Identifier: Apache-2.0
// The grammar of the verbs about agents: where, track, shape, who; met, picked, predict.
#include "query/cli/grammar.h"
#include "query/cli/number_checks.h"

namespace dsg::cli {
namespace {

constexpr char kAgentHelp[] = "Node id (H12) or the log's name (12)";

void AddTrack(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<TrackVerb>("track", "The poses of an agent", kQuestion | kLimit);
  app->add_option("AGENT", verb->agent, kAgentHelp)->required();
  app->add_option("--from", verb->from, "First TIME; default the track's first pose");
  app->add_option("--to", verb->to, "TIME to stop before; default with the last pose");
  app->add_option("--every", verb->every, "Interpolate at this period: 0.5s, 200ms");
  AddPicture(app, "the way", &verb->picture);
}

void AddShape(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<ShapeVerb>("shape", "The body of an agent over time", kQuestion | kLimit);
  app->add_option("AGENT", verb->agent, kAgentHelp)->required();
  app->add_option("--from", verb->from, "First TIME; default the first body");
  app->add_option("--to", verb->to, "TIME to stop before; default with the last body");
  CLI::Option* ply = app->add_option("--ply", verb->ply, "Write the first body, binary PLY");
  CLI::Option* obj =
      app->add_option("--obj", verb->obj_folder, "Folder to write a Wavefront OBJ a body into");
  ply->excludes(obj);
  app->add_flag("--force", verb->force, "Replace files that are there");
}

void AddWho(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<WhoVerb>("who", "Who was in a room or a box, and when", kQuestion | kLimit);
  CLI::Option* room =
      app->add_option("--room", verb->room,
                      "Room, place or region, by id (R2) or name; or the only room of a class");
  CLI::Option* box =
      app->add_option("--box", verb->box, "X0,Y0,Z0,X1,Y1,Z1 in the map frame, metres");
  room->excludes(box);
  app->add_option("--from", verb->from, "First TIME; default the first pose of the map");
  app->add_option("--to", verb->to, "TIME to stop before; default with the last pose");
}

void AddMet(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<MetVerb>("met", "Who came near whom, when and where", kQuestion | kLimit);
  app->add_option("AGENT", verb->agent, "Only meetings of this one; default everybody's");
  app->add_option("OTHER", verb->other_agent, "Only with this one");
  app->add_option("--from", verb->from, "First TIME; default the first pose of the map");
  app->add_option("--to", verb->to, "TIME to stop before; default with the last pose");
  app->add_option("--within", verb->within_m, "Metres between them; default 2")->check(AboveZero());
  app->add_option("--for", verb->for_at_least, "Leave out what was shorter: 2s, 500ms");
  CLI::Option* sight = app->add_flag("--line-of-sight", verb->line_of_sight,
                                     "Only while no wall stood between them");
  app->add_option("--sight-gap", verb->sight_gap,
                  "Out of sight for no longer than this is the same meeting; default 2s")
      ->needs(sight);
  AddPicture(app, "where they met", &verb->picture);
}

void AddPicked(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<PickedVerb>("picked", "Who picked up which object", kQuestion | kLimit);
  app->add_option("AGENT", verb->agent, "Only what this one may have picked; default anybody");
  app->add_option("--object", verb->object, "Only this object, by id or name");
  app->add_option("--class", verb->class_name, "Only objects of this class");
  app->add_option("--room", verb->room, "Only in this room or region, by id or name");
  app->add_option("--from", verb->from, "First TIME; default the first pose of the map");
  app->add_option("--to", verb->to, "TIME to stop before; default with the last pose");
  app->add_flag("--placed", verb->placed, "What was put down instead");
  app->add_flag("--all", verb->all, "Also those for which the evidence names nobody");
  app->add_flag("--why", verb->why, "Show the evidence for each candidate");
  AddPicture(app, "the objects", &verb->picture);
}

void AddPredict(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<PredictVerb>("predict", "Where an agent will be", kQuestion);
  app->add_option("AGENT", verb->agent, kAgentHelp)->required();
  app->add_option("--at", verb->at,
                  "Foresee from this TIME, knowing nothing later; default the "
                  "end of the track");
  app->add_option("--horizon", verb->horizon, "How far ahead; default 4.8s");
  app->add_option("--every", verb->every, "Period of the steps; default 400ms");
  app->add_option(
         "--model", verb->model,
         "goals: along the places; cv: constant velocity; weighted: mean of the last steps")
      ->check(CLI::IsMember({"goals", "cv", "weighted"}));
  app->add_option("--paths", verb->path_count, "At most so many ways; default 6")
      ->check(Between(1, 20));
  app->add_flag("--stop-at-walls", verb->stop_at_walls, "Cut straight predictions at walls");
  AddPicture(app, "the ways", &verb->picture);
}

}  // namespace

void AddAgentVerbs(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<WhereVerb>("where", "Where an agent was at an instant", kQuestion);
  app->add_option("AGENT", verb->agent, kAgentHelp)->required();
  app->add_option("--at", verb->at, "TIME asked about")->required();
  AddTrack(grammar);
  AddShape(grammar);
  AddWho(grammar);
}

void AddMeetingVerbs(Grammar* grammar) {
  AddMet(grammar);
  AddPicked(grammar);
  AddPredict(grammar);
}

}  // namespace dsg::cli
