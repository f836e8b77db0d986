// SPDX-License-Identifier: Apache-2.0
#include "query/cli/completion.h"

#include <algorithm>
#include <array>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace dsg::cli {
namespace {

constexpr char kBash[] = R"sh(# Completion of dsg for bash: source <(dsg completion bash)
_dsg_complete() {
  local found word
  COMPREPLY=()
  if found=$("${COMP_WORDS[0]}" completion words -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
  then
    # No file may stand here.
    compopt +o default +o bashdefault 2>/dev/null
  fi
  while IFS= read -r word; do
    [[ -n $word ]] && COMPREPLY+=("$(printf '%q' "$word")")
  done <<< "$found"
}
complete -o default -o bashdefault -F _dsg_complete dsg
)sh";

constexpr char kZsh[] = R"sh(#compdef dsg
# Completion of dsg for zsh: source <(dsg completion zsh)
_dsg_complete() {
  local text is_file=0
  text="$("${words[1]}" completion words -- "${(@)words[2,CURRENT]}" 2>/dev/null)" || is_file=1
  local -a found
  found=("${(@f)text}")
  if [[ -n "${found[1]}" ]]; then
    compadd -- "${found[@]}"
  elif (( is_file )); then
    _files
  fi
}
if [[ "${funcstack[1]}" == _dsg ]]; then
  _dsg_complete
else
  compdef _dsg_complete dsg
fi
)sh";

constexpr char kFish[] = R"sh(# Completion of dsg for fish: dsg completion fish | source
function __dsg_complete
    set -l typed (commandline -opc)
    set -l found ($typed[1] completion words -- $typed[2..-1] "$(commandline -ct)" 2>/dev/null)
    set -l code $status
    if test (count $found) -gt 0
        printf '%s\n' $found
    else if test $code -ne 0
        __fish_complete_path (commandline -ct)
    end
end
complete -c dsg -f -a '(__dsg_complete)'
)sh";

const CLI::App* FindVerb(const CLI::App& app, const std::string& name) {
  const auto verbs =
      app.get_subcommands([&](const CLI::App* verb) { return verb->check_name(name); });
  return verbs.empty() ? nullptr : verbs.front();
}

const CLI::Option* FindOption(const CLI::App& verb, const std::string& word) {
  for (const CLI::Option* option : verb.get_options()) {
    if (absl::StartsWith(word, "-") && option->check_name(word)) return option;
  }
  return nullptr;
}

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

// Of a set of words the names are in the type: "TEXT:{rgb,label}".
std::vector<std::string> Choices(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t begin = type.find('{');
  const size_t end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos || end < begin) return {};
  return absl::StrSplit(type.substr(begin + 1, end - begin - 1), ',');
}

bool IsFile(const CLI::Option& option, const std::string& name) {
  constexpr std::array<absl::string_view, 11> kFiles = {
      "store", "out", "tum", "csv", "obj", "policy", "mesh", "FILE", "DIR", "OUT", "PATH"};
  // Of EndsIn.
  if (absl::StrContains(option.get_type_name(), "FILE.")) return true;
  return std::find(kFiles.begin(), kFiles.end(), name) != kFiles.end();
}

WordKind KindOf(const CLI::Option& option) {
  const std::string name =
      option.get_positional() ? option.get_name(true) : option.get_lnames().front();
  if (absl::StrContains(option.get_type_name(), "TAG")) return WordKind::kTag;
  if (name == "AGENT" || name == "OTHER") return WordKind::kAgent;
  if (name == "map" || name == "beside" || name == "MAP" || name == "OLD") return WordKind::kMap;
  if (name == "room") return WordKind::kRegion;
  if (name == "layer") return WordKind::kLayer;
  if (name == "kind") return WordKind::kKind;
  if (name == "class") return WordKind::kClass;
  if (name == "relation") return WordKind::kRelation;
  if (IsFile(option, name)) return WordKind::kFile;
  const bool is_node = name == "ID" || name == "FROM" || name == "TO" || name == "node" ||
                       name == "parent" || name == "source" || name == "target" ||
                       name == "object" || name == "avoid" || name == "ignore";
  return is_node ? WordKind::kNode : WordKind::kNone;
}

Completion ValuesOf(const CLI::Option& option, const std::string& typed) {
  return {BeginningWith(typed, Choices(option)), KindOf(option)};
}

// Options that are not given yet, or may be repeated.
std::vector<std::string> OptionsLeft(const CLI::App& verb, const std::vector<std::string>& words) {
  std::vector<std::string> names;
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_group().empty() || option->get_lnames().empty()) continue;
    const bool is_given =
        std::any_of(words.begin() + 1, words.end() - 1,
                    [&](const std::string& word) { return FindOption(verb, word) == option; });
    if (is_given && option->get_items_expected_max() <= 1) continue;
    names.push_back("--" + option->get_lnames().front());
  }
  return names;
}

// The positional argument that the last word is; nullptr if there is none.
const CLI::Option* PositionalAt(const CLI::App& verb, const std::vector<std::string>& words) {
  int before = 0;
  for (size_t i = 1; i + 1 < words.size(); ++i) {
    const CLI::Option* option = FindOption(verb, words[i]);
    if (option != nullptr && TakesValue(*option)) {
      ++i;
    } else if (!absl::StartsWith(words[i], "--")) {
      ++before;
    }
  }
  for (const CLI::Option* option : verb.get_options()) {
    if (!option->get_positional()) continue;
    if (before < option->get_items_expected_max()) return option;
    before -= option->get_items_expected_max();
  }
  return nullptr;
}

}  // namespace

std::vector<std::string> BeginningWith(const std::string& typed, std::vector<std::string> words) {
  const bool is_quoted = !typed.empty() && (typed[0] == '"' || typed[0] == '\'');
  const std::string front = is_quoted ? typed.substr(1) : typed;
  std::erase_if(words, [&](const std::string& word) {
    return word.empty() || !absl::StartsWithIgnoreCase(word, front);
  });
  return words;
}

std::string ValueOf(const std::vector<std::string>& words, const std::string& option) {
  for (size_t i = 0; i < words.size(); ++i) {
    if (words[i] == option && i + 2 < words.size()) return words[i + 1];
    if (absl::StartsWith(words[i], option + "=")) return words[i].substr(option.size() + 1);
  }
  return "";
}

Completion Complete(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty()) return {};
  const std::string& typed = words.back();
  const bool is_help = words.size() == 2 && words[0] == "help";
  if (words.size() == 1 || is_help) {
    std::vector<std::string> names;
    for (const CLI::App* verb : app.get_subcommands({})) names.push_back(verb->get_name());
    if (!is_help) names.insert(names.end(), {"help", "--help", "--version"});
    return {.words = BeginningWith(typed, std::move(names))};
  }
  const CLI::App* verb = FindVerb(app, words[0]);
  if (verb == nullptr) return {};
  const CLI::Option* before = FindOption(*verb, words[words.size() - 2]);
  if (before != nullptr && TakesValue(*before)) return ValuesOf(*before, typed);
  if (absl::StartsWith(typed, "-")) {
    return {.words = BeginningWith(typed, OptionsLeft(*verb, words))};
  }
  const CLI::Option* positional = PositionalAt(*verb, words);
  return positional == nullptr ? Completion() : ValuesOf(*positional, typed);
}

std::string CompletionScript(const std::string& shell) {
  if (shell == "zsh") return kZsh;
  return shell == "fish" ? kFish : kBash;
}

}  // namespace dsg::cli
