// SPDX-License-Identifier: Apache-2.0
// The grammar of the verbs about ways and obstacles: path, collide.
#include "query/cli/grammar.h"
#include "query/cli/number_checks.h"

namespace dsg::cli {
namespace {

void AddPath(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<PathVerb>("path", "The way from here to there", kQuestion);
  constexpr char kEnd[] = "X,Y,Z, an id or a unique name, or \"nearest CLASS\"";
  app->add_option("FROM", verb->from, kEnd)->required();
  app->add_option("TO", verb->to, kEnd)->required();
  app->add_option("--radius", verb->radius_m, "Of the robot, metres; default a point")
      ->check(AboveZero());
  app->add_option("--avoid", verb->blocked,
                  "Not over this place, or through this room; may be "
                  "given again")
      ->allow_extra_args(false);
  app->add_flag("--flat", verb->flat, "Over all places at once, instead of rooms first");
  app->add_option("--at", verb->at, "The world at this TIME; default now");
  app->add_flag("--check", verb->check,
                "Sweep the robot along the way and say what it touches: things, walls, and the\n"
                "other agents where they were at --at (default: at their last poses)");
  AddPicture(app, "the way", &verb->picture);
}

void AddScope(CLI::App* app, CollideVerb* verb) {
  app->add_flag("--objects", verb->objects, "Against objects");
  app->add_flag("--structures", verb->structures, "Against walls, floors, ceilings");
  app->add_flag("--mesh-blocks", verb->mesh_blocks, "Against the map's mesh");
  app->add_flag("--agents", verb->agents, "Against agents where they were");
  app->add_flag("--predicted", verb->predicted_agents, "Against agents where they will be");
  app->add_flag("--ignore-floor", verb->ignore_floor, "Not against floors in the mesh");
  app->add_option("--ignore", verb->ignored, "Not against this node; may be given again")
      ->allow_extra_args(false);
}

}  // namespace

void AddSpaceVerbs(Grammar* grammar) {
  AddPath(grammar);
  const auto [app, verb] =
      grammar->Add<CollideVerb>("collide", "What a body touches, or how far all is", kQuestion);
  app->add_option("--sphere", verb->sphere_radius_m, "Radius, metres")->check(AboveZero());
  app->add_option("--box", verb->box, "X,Y,Z: edge lengths, metres");
  app->add_option("--capsule", verb->capsule,
                  "RADIUS,LENGTH along z, between the centres of its ends, metres");
  app->add_option("--mesh", verb->mesh_file, "A PLY file of triangles, in the frame of the body");
  app->add_option("--pose", verb->poses,
                  "X,Y,Z or X,Y,Z,QX,QY,QZ,QW in the map frame; several are a way")
      ->required();
  app->add_option("--at", verb->at, "The world at this TIME; default now");
  app->add_option("--margin", verb->margin_m, "Closer than this is a hit, metres")
      ->check(ZeroOrMore());
  app->add_option("--reach", verb->clearance_max_m, "Look no further than this, metres; default 2")
      ->check(AboveZero());
  AddScope(app, verb);
  AddPicture(app, "body and obstacle", &verb->picture);
  app->footer(
      ExampleOf("collide") +
      "Against everything but predicted agents unless --objects and the like say otherwise.\n"
      "Exit codes: 0 the body touches something, 1 it is free, 2 usage, 3 unavailable, 4 data "
      "loss.");
}

}  // namespace dsg::cli
