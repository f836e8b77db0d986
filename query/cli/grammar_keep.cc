// SPDX-License-Identifier: Apache-2.0
// The grammar of the verbs that keep maps for years: tag, compact, revert, backup, restore.
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "query/cli/grammar.h"

namespace dsg::cli {
namespace {

constexpr char kRevisionForm[] = "REVISION|TAG";

// Empty if the text is a revision or may be a tag; else what is wrong.
std::string ProblemOf(const std::string& text) {
  int64_t number = 0;
  if (absl::SimpleAtoi(text, &number) && number >= 0) return "";
  const bool is_number =
      !text.empty() && text.find_first_not_of("+-.0123456789") == std::string::npos;
  if (!text.empty() && !is_number) return "";
  return absl::StrCat("\"", text, "\" is neither a revision, counted from 0, nor a tag");
}

}  // namespace

CLI::Option* AddRevision(CLI::App* app, const std::string& name, const std::string& what,
                         RevisionOption* revision) {
  const auto take = [revision](const std::string& text) {
    int64_t number = 0;
    if (absl::SimpleAtoi(text, &number)) {
      revision->number = number;
    } else {
      revision->tag = text;
    }
  };
  return app->add_option_function<std::string>(name, take, what)
      ->check(CLI::Validator(ProblemOf, kRevisionForm));
}

void AddKeepVerbs(Grammar* grammar) {
  constexpr unsigned kTakes = kServer | kMap | kJson;
  const auto [tag_app, tag] = grammar->Add<TagVerb>(
      "tag", "Name a revision, which then stays readable; or list the names", kTakes | kRevision);
  CLI::Option* name = tag_app->add_option("NAME", tag->name, "The name; one that is there moves");
  tag_app->add_option("--note", tag->note, "A remark to keep with it")->needs(name);
  CLI::Option* list = tag_app->add_flag("--list", tag->list, "List them; default without a NAME");
  CLI::Option* remove = tag_app->add_option("--remove", tag->removed, "Take this name away");
  list->excludes(name)->excludes(remove);
  remove->excludes(name);

  const auto [compact_app, compact] = grammar->Add<CompactVerb>(
      "compact", "Drop old revisions that have no tag, and give their bytes back", kTakes);
  AddRevision(compact_app, "--keep-from", "The oldest revision to keep; default the newest",
              &compact->keep_from);

  const auto [revert_app, revert] = grammar->Add<RevertVerb>(
      "revert", "Make a map what it was at a revision, as new revisions", kTakes);
  AddRevision(revert_app, "TO", "Revision or tag to go back to", &revert->to)->required();
  revert_app->add_flag("--dry-run", revert->dry_run, "Only say what would change");

  const auto [backup_app, backup] = grammar->Add<BackupVerb>(
      "backup", "Write archives of all maps, or of one, to a folder", kTakes);
  backup_app->add_option("OUT", backup->folder, "The folder; a backup that is there is renewed")
      ->required();

  const auto [restore_app, restore] =
      grammar->Add<RestoreVerb>("restore", "Put the maps of a backup into a store", kMap | kJson);
  restore_app->add_option("PATH", restore->path, "Folder of a backup, or a .dsgz file")->required();
  restore_app->add_option("--as", restore->as, "Name of the map in the store");
  restore_app->add_flag("--force", restore->force, "Replace maps that are there");
}

}  // namespace dsg::cli
