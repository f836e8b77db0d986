// SPDX-License-Identifier: Apache-2.0
// The parser of command lines, to which each family of verbs adds its own.
// Refuses to judge what options mean together: that is arguments.cc.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "query/cli/arguments.h"

namespace dsg::cli {

/// Which of the common options a verb takes; --store goes with all of them.
enum Takes : unsigned {
  kServer = 1,
  kMap = 2,
  kRevision = 4,
  kJson = 8,
  kLimit = 16,
  kQuestion = kServer | kMap | kRevision | kJson,
};

inline constexpr char kTimeHelp[] =
    "TIME is +12.5s from the map's epoch, RFC 3339, or nanoseconds.\n"
    "Exit codes: 0 found, 1 not found, 2 usage, 3 unavailable, 4 data loss.";

/// INVALID_ARGUMENT that says where help is; `verb` may be empty.
absl::Status Usage(const std::string& message, const std::string& verb);

/// A command line of the verb to begin with, on its own line.
std::string ExampleOf(const std::string& verb);

class Grammar {
 public:
  Grammar();

  /// A verb with the common options it takes. The second is what its own options may write to; it
  /// lives as long as the first, and becomes the command's verb if this verb is named.
  template <class V>
  std::pair<CLI::App*, V*> Add(const std::string& name, const std::string& what, unsigned takes) {
    CLI::App* app = AddApp(name, what, takes);
    const auto verb = std::make_shared<V>();
    app->callback([this, verb] { command_.verb = *verb; });
    return {app, verb.get()};
  }

  /// A verb that asks about one map by `run(session, options, out)`. `example` is its command line
  /// without "dsg" and its name.
  template <class Options>
  std::pair<CLI::App*, Options*> AddOwn(
      const std::string& name, const std::string& what, const std::string& example,
      absl::Status (*run)(Session* session, const Options& options, std::ostream& out),
      unsigned takes = kQuestion) {
    CLI::App* app = AddApp(name, what, takes);
    app->footer("Example: dsg " + name + " " + example + "\n" + kTimeHelp);
    const auto options = std::make_shared<Options>();
    app->callback([this, options, run] {
      command_.verb = OwnVerb{[options, run](Session* session, std::ostream& out) {
        return run(session, *options, out);
      }};
    });
    return {app, options.get()};
  }

  CommonOptions* common() { return &command_.common; }

  absl::Status Parse(std::vector<std::string> arguments);
  const Command& command() const { return command_; }

 private:
  CLI::App* AddApp(const std::string& name, const std::string& what, unsigned takes);

  CLI::App app_{"Asks a store of dynamic scene graphs, or a server, where and when."};
  Command command_;
  RevisionOption revision_;
};

inline constexpr char kFloorHelp[] =
    "Draw only this floor: a level or room by id or name, or a height in metres";

// Options that several verbs have.
void AddFilter(CLI::App* app, FilterOptions* filter);
void AddPicture(CLI::App* app, const std::string& what, PictureOptions* picture);
/// An option, or an argument, that takes the number of a revision or a tag.
CLI::Option* AddRevision(CLI::App* app, const std::string& name, const std::string& what,
                         RevisionOption* revision);

// The families of verbs: grammar_*.cc.
void AddAgentVerbs(Grammar* grammar);
void AddMeetingVerbs(Grammar* grammar);
void AddGraphVerbs(Grammar* grammar);
void AddSearchVerbs(Grammar* grammar);
void AddSpaceVerbs(Grammar* grammar);
void AddMapVerbs(Grammar* grammar);
void AddRevisionVerbs(Grammar* grammar);
void AddFileVerbs(Grammar* grammar);
void AddKeepVerbs(Grammar* grammar);
void AddMergeVerb(Grammar* grammar);
void AddPruneVerb(Grammar* grammar);

}  // namespace dsg::cli
