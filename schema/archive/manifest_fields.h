// SPDX-License-Identifier: Apache-2.0
// The fields of a JSON object that a manifest is made of, read by name.
// Refuses fields that are missing or of another kind, and says which.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "schema/model/node.h"

namespace dsg {

/// After the first field that cannot be read, those that follow are read as nothing; look at
/// problem() before what was read is believed.
///
/// Threads: one caller at a time.
class ManifestFields {
 public:
  explicit ManifestFields(std::string_view text);
  ~ManifestFields();
  ManifestFields(ManifestFields&&) noexcept;
  ManifestFields& operator=(ManifestFields&&) = delete;

  std::string Text(const char* name);
  /// Written as text, since readers of JSON elsewhere round large numbers.
  int64_t Integer(const char* name);
  /// The same, and not negative.
  int64_t Count(const char* name);
  /// Written as a number.
  int SmallInteger(const char* name);
  double Number(const char* name);
  Sha256 Digest(const char* name);
  /// A list of objects.
  std::vector<ManifestFields> Objects(const char* name);

  /// `field "x" is missing`; empty if all that was asked for could be read.
  const std::string& problem() const { return problem_; }

  /// For callers who know more of a field: makes it the problem, unless there is one.
  void Refuse(const char* name, std::string_view why);

 private:
  enum class Kind { kText, kSmallInteger, kNumber, kObjects };
  struct Value;
  explicit ManifestFields(std::unique_ptr<Value> object);
  /// Nothing of that kind if there is a problem.
  Value Take(const char* name, Kind kind);

  std::unique_ptr<Value> object_;
  std::string problem_;
};

}  // namespace dsg
