// SPDX-License-Identifier: Apache-2.0
// The verb completion: scripts for shells, and the words for which they ask.
#include <sys/time.h>
#include <unistd.h>

#include <csignal>
#include <string>
#include <utility>
#include <vector>

#include "dsg/v1/maintenance_service.pb.h"
#include "query/cli/completion.h"
#include "query/cli/lookups.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

struct CompletionVerb {
  std::string shell;
  /// With "words": those of the command line.
  std::vector<std::string> words;
};

// A store that is slow to open, or a server that does not answer, must not hold up the typing.
constexpr int kPatienceMs = 200;
constexpr int64_t kNodesMax = 2000;

// Ends the program when the time is over: opening a store cannot be cancelled, and nothing is open
// for writing. What was found until then is flushed already.
class EndIfLate {
 public:
  EndIfLate() {
    std::signal(SIGALRM, [](int) { _exit(0); });
    Arm(kPatienceMs);
  }
  ~EndIfLate() { Arm(0); }
  EndIfLate(const EndIfLate&) = delete;
  EndIfLate& operator=(const EndIfLate&) = delete;

 private:
  static void Arm(int ms) {
    const itimerval timer{.it_interval = {}, .it_value = {.tv_sec = 0, .tv_usec = ms * 1000}};
    setitimer(ITIMER_REAL, &timer, nullptr);
  }
};

absl::StatusOr<std::vector<std::string>> NamesOfTags(Session* session) {
  DSG_ASSIGN_OR_RETURN(const v1::ListTagsResponse reply, ReadTags(session));
  std::vector<std::string> names;
  for (const v1::Tag& tag : reply.tags()) names.push_back(tag.name());
  return names;
}

std::vector<std::string> OfKind(SearchWords words, WordKind kind) {
  if (kind == WordKind::kLayer) return std::move(words.layers);
  if (kind == WordKind::kKind) return std::move(words.kinds);
  return kind == WordKind::kClass ? std::move(words.classes) : std::move(words.relations);
}

bool IsOfSearches(WordKind kind) {
  return kind == WordKind::kLayer || kind == WordKind::kKind || kind == WordKind::kClass ||
         kind == WordKind::kRelation;
}

absl::StatusOr<std::vector<std::string>> KnownWords(Session* session, WordKind kind) {
  DSG_RETURN_IF_ERROR(session->Open());
  if (kind == WordKind::kMap) return NamesOfMaps(*session);
  DSG_RETURN_IF_ERROR(session->ChooseMap());
  if (kind == WordKind::kTag) return NamesOfTags(session);
  if (IsOfSearches(kind)) {
    DSG_ASSIGN_OR_RETURN(SearchWords words, WordsOfSearches(*session));
    return OfKind(std::move(words), kind);
  }
  const char* layer = kind == WordKind::kAgent    ? "agents"
                      : kind == WordKind::kRegion ? "rooms"
                                                  : "";
  DSG_ASSIGN_OR_RETURN(NodeWords words, WordsOfNodes(*session, layer, kNodesMax));
  words.names.insert(words.names.end(), words.ids.begin(), words.ids.end());
  return std::move(words.names);
}

// The place and the map that the words name, or those of the environment.
CommonOptions OptionsOf(const std::vector<std::string>& words, CommonOptions common) {
  const std::string store = ValueOf(words, "--store");
  const std::string server = ValueOf(words, "--server");
  if (!store.empty() || !server.empty()) {
    common.store = store;
    common.server = server;
  }
  const std::string map = ValueOf(words, "--map");
  if (!map.empty()) common.map = map;
  common.timeout_s = kPatienceMs / 1000.0;
  return common;
}

absl::Status RunCompletion(Session* session, const CompletionVerb& verb, std::ostream& out) {
  if (verb.shell != "words") {
    out << CompletionScript(verb.shell);
    return absl::OkStatus();
  }
  Grammar grammar(session->program_version());
  AddAllVerbs(&grammar);
  const Completion completion = Complete(grammar.app(), verb.words);
  for (const std::string& word : completion.words) out << word << "\n";
  out.flush();
  if (completion.kind == WordKind::kFile) {
    session->set_found(false);
    return absl::OkStatus();
  }
  const CommonOptions common = OptionsOf(verb.words, session->common());
  if (completion.kind == WordKind::kNone || common.store.empty() == common.server.empty()) {
    return absl::OkStatus();
  }
  const EndIfLate end_if_late;
  Session asked(common, session->program_version(), &session->notes());
  const auto names = KnownWords(&asked, completion.kind);
  if (!names.ok()) return absl::OkStatus();
  for (const std::string& name : BeginningWith(verb.words.back(), *names)) {
    // What cannot be typed is not offered.
    if (name == Printable(name)) out << name << "\n";
  }
  out.flush();
  return absl::OkStatus();
}

}  // namespace

void AddCompletionVerb(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<CompletionVerb>(
      {.name = "completion",
       .what = "A script with which a shell completes verbs, options, names and ids",
       .example = "bash",
       .takes = kServer | kMap,
       .opens = Opens::kNothing,
       .run = RunCompletion,
       .footer =
           "bash: source <(dsg completion bash)\nzsh:  source <(dsg completion zsh)\n"
           "fish: dsg completion fish | source\n"
           "The scripts ask `dsg completion words -- WORD...` for what may follow; exit code 1 "
           "is for files, which\nthe shell completes. Names of maps and tags, names and ids of "
           "nodes, layers, kinds, classes and relations\ncome from the store or server of the "
           "command line or the environment, within 200 ms or not at all."});
  app->add_option("SHELL", verb->shell, "bash, zsh or fish; or words")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish", "words"}));
  grammar->AllowEmpty(
      app->add_option("WORD", verb->words, "With words: the command line so far, without dsg"));
}

}  // namespace dsg::cli
