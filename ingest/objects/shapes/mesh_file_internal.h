// SPDX-License-Identifier: Apache-2.0
// What the readers of CAD files share: messages with a place in the file, and whole numbers.
// Refuses to guess: a number is read whole or not at all.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace dsg::ingest {

/// INVALID_ARGUMENT/FILE_MALFORMED: "file: message".
absl::Status CadFileError(const std::string& file, std::string_view message);
/// "file:line: message".
absl::Status CadLineError(const std::string& file, int64_t line, std::string_view message);

/// Words of a text file, between blanks, with the lines they stand in.
class WordReader {
 public:
  /// Starts at `offset`, the beginning of line number `line`.
  WordReader(std::string_view bytes, size_t offset, int64_t line)
      : bytes_(bytes), at_(offset), line_(line) {}

  /// Empty at the end of the file.
  std::string_view Next();
  /// Empty at the end of the line.
  std::string_view NextInLine();
  /// Goes to the beginning of the next line. False at the end of the file.
  bool SkipLine();
  /// Of the word that came last.
  int64_t line() const { return line_; }

 private:
  void SkipBlanks(bool may_end_line);

  std::string_view bytes_;
  size_t at_ = 0;
  int64_t line_ = 1;
};

/// The whole word is a finite number.
bool ParseCadNumber(std::string_view word, double* value);
/// The whole word is an integer.
bool ParseCadInteger(std::string_view word, int64_t* value);

/// A word for a message: cut to 40 characters, unprintable ones as '?'.
std::string Quoted(std::string_view word);

}  // namespace dsg::ingest
