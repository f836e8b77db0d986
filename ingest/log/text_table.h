// SPDX-License-Identifier: Apache-2.0
// Lines, fields and numbers of text logs, with errors that name file, line, field and value.
// Refuses to guess: a number is read whole or not at all.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// Six printed digits leave a norm within 1e-5 of one; 1e-3 still cannot be another quantity.
inline constexpr double kQuaternionNormTolerance = 1e-3;

/// One line of a text file, without its line end.
struct TextLine {
  /// From 1.
  int64_t number = 0;
  std::string_view text;
  /// False only for a last line that the file ends in.
  bool has_line_end = true;
};

/// Hands out the lines of a file that are not blank. "\r\n" ends a line as "\n" does.
class LineReader {
 public:
  /// `left_out`: lines that are missing in `bytes` behind the first one, for their numbers.
  explicit LineReader(std::string_view bytes, int64_t left_out = 0)
      : rest_(bytes), left_out_(left_out) {}
  /// False at the end of the file.
  bool Next(TextLine* line);

 private:
  std::string_view rest_;
  int64_t left_out_;
  int64_t number_ = 0;
};

/// Fields between runs of blanks and tabs.
void SplitAtBlanks(std::string_view text, std::vector<std::string_view>* fields);
/// Fields between commas, or another character, blanks around them removed.
void SplitAtCommas(std::string_view text, std::vector<std::string_view>* fields, char comma = ',');
/// Fields of a line of CSV (RFC 4180): one in quotes may have the comma in it, and quotes, each
/// twice. What stood in quotes is kept in `unquoted`, to which the fields then point.
/// False if quotes do not end in the line, or have text behind them.
bool SplitCsv(std::string_view text, char comma, std::deque<std::string>* unquoted,
              std::vector<std::string_view>* fields);

/// A line of a file, for messages.
struct LinePosition {
  const std::string& file;
  int64_t line = 0;

  /// INVALID_ARGUMENT/FILE_MALFORMED: "file:line: message".
  absl::Status Error(std::string_view message) const;
  /// The same about one field: "file:line: field x is "abc"; message".
  absl::Status FieldError(std::string_view field, std::string_view value,
                          std::string_view message) const;
};

/// Errors: FILE_MALFORMED when there are not `count` fields, with a sentence of its own for a
/// last line that was cut off. `columns` names them for the message.
absl::Status CheckFieldCount(const LinePosition& at, const TextLine& line, size_t found,
                             size_t count, std::string_view columns);

/// A finite number.
absl::StatusOr<double> ParseNumber(const LinePosition& at, std::string_view field,
                                   std::string_view text);
/// A number within +-kCoordinateMaxM. Units: metres.
absl::StatusOr<double> ParseCoordinate(const LinePosition& at, std::string_view field,
                                       std::string_view text);
/// An integer in any notation: "12", "12.0", "1.2e+01".
absl::StatusOr<int64_t> ParseInteger(const LinePosition& at, std::string_view field,
                                     std::string_view text);
/// A frame number: an integer within +-2^53, so that differences never overflow.
absl::StatusOr<int64_t> ParseFrame(const LinePosition& at, std::string_view text);
/// A person's number as an agent name: an integer >= 0, printed without decimals.
absl::StatusOr<std::string> ParsePersonName(const LinePosition& at, std::string_view text);
/// Decimal seconds as nanoseconds, exactly; digits beyond the ninth decimal are rounded. Other
/// units by their power of ten: -3 = milliseconds, -6, -9.
absl::StatusOr<TimeNs> ParseSeconds(const LinePosition& at, std::string_view field,
                                    std::string_view text, int power = 0);
/// A quaternion made unit. Errors: FILE_MALFORMED when its norm is not within
/// kQuaternionNormTolerance of 1.
absl::StatusOr<Eigen::Quaterniond> Normalize(const LinePosition& at, const Eigen::Quaterniond& q);
/// `epoch_ns` + `offset_ns`. Errors: FILE_MALFORMED when the sum does not fit.
absl::StatusOr<TimeNs> AddToEpoch(const LinePosition& at, TimeNs epoch_ns, TimeNs offset_ns);

}  // namespace dsg::ingest
