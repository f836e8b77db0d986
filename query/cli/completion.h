// SPDX-License-Identifier: Apache-2.0
// Completion of command lines in a shell. The scripts of the shells only ask the program, so all of
// them know every verb and option; see verb_completion.cc.
#pragma once

#include <string>
#include <vector>

#include "query/cli/grammar.h"

namespace dsg::cli {

/// What a word is, for words that depend on the maps of the store, and for files.
enum class WordKind {
  kNone,
  kMap,
  kTag,
  kAgent,
  kRegion,
  kNode,
  kLayer,
  kKind,
  kClass,
  kRelation,
  /// A file or a folder: the shell knows them.
  kFile
};

/// What may stand at the end of a command line.
struct Completion {
  /// Words that begin with what is typed.
  std::vector<std::string> words;
  /// What else may stand there; kNone also where only a number may.
  WordKind kind = WordKind::kNone;
};

/// `words`: those after the program's name; the last one is being typed and may be empty.
Completion Complete(const CLI::App& app, const std::vector<std::string>& words);

/// The value of a long option among the words, "--map office" or "--map=office"; empty without it.
std::string ValueOf(const std::vector<std::string>& words, const std::string& option);

/// Keeps the words that begin with `typed`, which may begin with a quote.
std::vector<std::string> BeginningWith(const std::string& typed, std::vector<std::string> words);

/// The script of "bash", "zsh" or "fish".
std::string CompletionScript(const std::string& shell);

}  // namespace dsg::cli
