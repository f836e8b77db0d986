// SPDX-License-Identifier: Apache-2.0
// The verb map: a picture of a map.
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "query/cli/answer_picture.h"
#include "query/cli/export/exploded_view.h"
#include "query/cli/export/map_content.h"
#include "query/cli/export/top_view.h"
#include "query/cli/json.h"
#include "query/cli/read_content.h"
#include "query/cli/session.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"
#include "schema/picture/look.h"
#include "schema/picture/raster.h"

namespace dsg::cli {
namespace {

struct MapVerb {
  std::string png;
  /// A level or room by id or name, or a height; empty = all floors.
  std::string floor;
  /// The layers one above the other, instead of the map from above.
  bool is_exploded = false;
  /// The mesh alone, seen obliquely.
  bool is_mesh = false;
  /// A second map whose mesh is drawn at the right of it; empty = none.
  std::string beside;
  bool with_bodies = false;
  int width_px = 1600;
  std::string at;
  bool force = false;
};

std::string NameAndRevision(const MapContent& content) {
  return absl::StrCat(content.spec.name, "  revision ", content.revision);
}

// The title of the picture: map, revision and instant.
std::string TitleOf(const Session& session, const ContentAnswer& answer, const MapVerb& verb) {
  std::string title = NameAndRevision(answer.content);
  if (!verb.at.empty()) {
    const auto at_ns = ParseInstant("--at", verb.at, session.map());
    if (at_ns.ok()) absl::StrAppend(&title, "  at ", session.times().Full(*at_ns));
  } else if (answer.last_pose_ns.has_value()) {
    // A millisecond is finer than the picture.
    constexpr TimeNs kMillisecond = 1'000'000;
    const TimeNs last_ns = *answer.last_pose_ns / kMillisecond * kMillisecond;
    absl::StrAppend(&title, "  up to ", session.times().Full(last_ns));
  }
  if (!verb.floor.empty()) absl::StrAppend(&title, "  floor ", verb.floor);
  return title;
}

// The newest content of another map of the same store or server.
absl::StatusOr<MapContent> ReadBeside(const Session& session, const MapVerb& verb) {
  CommonOptions common = session.common();
  common.map = verb.beside;
  common.at = {};
  Session other(std::move(common), session.program_version(), &session.notes());
  DSG_RETURN_IF_ERROR(other.Open());
  DSG_RETURN_IF_ERROR(other.ChooseMap());
  DSG_ASSIGN_OR_RETURN(ContentAnswer answer, ReadContentAt(&other, verb.at, {}));
  return std::move(answer.content);
}

// "on floor L1 at revision 7"; what is valid at --at is a part of that.
std::string PartOf(const MapContent& content, const std::string& floor, const std::string& at) {
  return absl::StrCat(floor.empty() ? "" : absl::StrCat("on floor ", floor, " "),
                      at.empty() ? "" : absl::StrCat("at ", at, " "), "at revision ",
                      content.revision);
}

// An empty picture would not say why it is.
void NoteWithoutMesh(const Session& session, const MapContent& content, const std::string& floor,
                     const std::string& at) {
  if (CountMesh(content.mesh).faces > 0) return;
  session.notes() << "note: map " << content.spec.name << " has no mesh "
                  << PartOf(content, floor, at)
                  << ", so its picture is empty; leave out --mesh to draw the rest of it\n";
}

void NoteWhatIsMissing(const Session& session, const MapContent& content, const MapVerb& verb) {
  if (verb.is_mesh) {
    NoteWithoutMesh(session, content, verb.floor, verb.at);
  } else if (content.nodes.empty() && CountMesh(content.mesh).faces == 0) {
    session.notes() << "note: map " << content.spec.name << " has nothing "
                    << PartOf(content, verb.floor, verb.at) << ", so its picture is empty\n";
  } else if (verb.with_bodies && content.bodies.empty()) {
    session.notes() << "note: no body of anybody is known at " << verb.at << ", so none is drawn\n";
  }
}

absl::StatusOr<picture::Picture> DrawMap(Session* session, const MapVerb& verb,
                                         const MapContent& content, const std::string& title) {
  if (verb.is_exploded) {
    return DrawExplodedView(content, {.width_px = verb.width_px, .title = title});
  }
  if (!verb.is_mesh) return DrawTopView(content, {.width_px = verb.width_px, .title = title});
  if (verb.beside.empty()) return DrawMeshes({{content, title}}, verb.width_px);
  DSG_ASSIGN_OR_RETURN(const MapContent other, ReadBeside(*session, verb));
  // Of the other map all floors are drawn.
  NoteWithoutMesh(*session, other, "", verb.at);
  return DrawMeshes({{content, NameAndRevision(content)}, {other, NameAndRevision(other)}},
                    verb.width_px);
}

absl::Status RunMap(Session* session, const MapVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckMayWrite(verb.png, verb.force));
  DSG_ASSIGN_OR_RETURN(ContentAnswer answer,
                       ReadContentAt(session, verb.at, {.with_bodies = verb.with_bodies}));
  MapContent& content = answer.content;
  if (!verb.floor.empty()) {
    DSG_ASSIGN_OR_RETURN(const HeightRange floor, ChooseFloor(content, verb.floor));
    KeepFloor(floor, &content);
  }
  NoteWhatIsMissing(*session, content, verb);
  DSG_ASSIGN_OR_RETURN(const picture::Picture picture,
                       DrawMap(session, verb, content, TitleOf(*session, answer, verb)));
  DSG_ASSIGN_OR_RETURN(const Written written, WritePng(picture, verb.png, verb.force));
  TellWritten({written}, content.revision, session->common().json, out);
  return absl::OkStatus();
}

absl::Status CheckMap(const MapVerb& verb, const CommonOptions&) {
  if (!verb.with_bodies || !verb.at.empty()) return absl::OkStatus();
  return Usage("a picture shows one instant: give --at with --bodies", "map");
}

}  // namespace

void AddMapVerb(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<MapVerb>({.name = "map",
                                                  .what = "Draw a map from above",
                                                  .example = "--png office.png",
                                                  .run = RunMap,
                                                  .check = CheckMap});
  app->add_option("--png", verb->png, "The picture to write")->required()->check(EndsIn({".png"}));
  app->add_option("--floor", verb->floor, kFloorHelp);
  CLI::Option* exploded =
      app->add_flag("--exploded", verb->is_exploded, "Layers one above the other, seen obliquely");
  CLI::Option* mesh =
      app->add_flag("--mesh", verb->is_mesh, "The mesh alone, seen obliquely")->excludes(exploded);
  app->add_option("--beside", verb->beside,
                  "Another map: its mesh at the right, seen from the same place")
      ->needs(mesh);
  app->add_flag("--bodies", verb->with_bodies, "People as bodies, as they are at --at")
      ->excludes(mesh);
  app->add_option("--width", verb->width_px, "Width of the picture, pixels")
      ->check(Between(kTopViewWidthMin, kTopViewWidthMax))
      ->capture_default_str();
  app->add_option("--at", verb->at, kContentAtHelp);
  app->add_flag("--force", verb->force, "Replace an existing file");
}

}  // namespace dsg::cli
