// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/g2o_line.h"

#include <Eigen/Eigenvalues>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "ingest/loop/residual.h"
#include "schema/base/status.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

constexpr size_t kQuotedLengthMax = 60;
// Six printed digits leave a norm within 1e-5 of one; 1e-3 still cannot be another quantity.
constexpr double kQuaternionNormTolerance = 1e-3;
// A norm this near to one is one: dividing would change digits that were written on purpose.
constexpr double kUnitNorm = 1e-15;
// Correlations of 1 leave eigenvalues of rounding's size.
constexpr double kEigenvalueMin = 1e-12;
// Variances of a nanometre squared to a thousand kilometres squared; squares stay in range.
constexpr double kInformationMin = 1e-18;
constexpr double kInformationMax = 1e18;

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

// Reads a line's fields one after another; the first bad one stays as the error.
class FieldReader {
 public:
  FieldReader(const G2oPosition& at, std::string_view rest) : at_(at), rest_(rest) {}

  std::string_view Next() {
    while (!rest_.empty() && IsBlank(rest_.front())) rest_.remove_prefix(1);
    size_t length = 0;
    while (length < rest_.size() && !IsBlank(rest_[length])) ++length;
    const std::string_view field = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return field;
  }

  int64_t Id(const char* name) {
    const std::string_view text = Next();
    int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || value < 0) {
      Refuse(name, text, "must be a whole number from 0 to 2^63 - 1");
    }
    return value;
  }

  double Number(const char* name) {
    std::string_view text = Next();
    const std::string_view whole = text;
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    // Too small to be told from zero is zero; strtod knows which end of the range was left.
    if (error == std::errc::result_out_of_range)
      value = std::strtod(std::string(text).c_str(), nullptr);
    const bool is_read = error == std::errc() || error == std::errc::result_out_of_range;
    if (!is_read || end != text.data() + text.size() || !std::isfinite(value)) {
      Refuse(name, whole, "must be a finite number");
    }
    return value;
  }

  double Coordinate(const char* name) {
    const std::string_view before = rest_;
    const double value = Number(name);
    if (!(std::abs(value) <= kCoordinateMaxM)) {
      rest_ = before;
      Refuse(name, Next(), absl::StrCat("must be within ", kCoordinateMaxM, " m"));
    }
    return value;
  }

  void End() {
    const std::string_view text = Next();
    if (!text.empty()) Refuse("after the last one", text, "must not be there");
  }

  void Refuse(const char* name, std::string_view value, const std::string& message) {
    if (!status_.ok()) return;
    status_ =
        value.empty()
            ? at_.Error(absl::StrCat("field ", name, " is missing"))
            : at_.Error(absl::StrCat("field ", name, " is ", QuoteText(value), "; it ", message));
  }

  const absl::Status& status() const { return status_; }

 private:
  const G2oPosition& at_;
  std::string_view rest_;
  absl::Status status_;
};

void ReadPlanarPose(FieldReader* fields, Pose3d* pose) {
  const double x = fields->Coordinate("x");
  const double y = fields->Coordinate("y");
  *pose = FromPlanar({x, y, fields->Number("theta")}, 0.0);
}

void ReadSpatialPose(FieldReader* fields, Pose3d* pose) {
  for (const int axis : {0, 1, 2}) {
    constexpr const char* kNames[] = {"x", "y", "z"};
    pose->position[axis] = fields->Coordinate(kNames[axis]);
  }
  Eigen::Vector4d q;
  for (const int part : {0, 1, 2, 3}) {
    constexpr const char* kNames[] = {"qx", "qy", "qz", "qw"};
    q[part] = fields->Number(kNames[part]);
  }
  const double norm = q.norm();
  if (!(std::abs(norm - 1.0) <= kQuaternionNormTolerance)) {
    fields->Refuse(
        "qx qy qz qw", absl::StrCat(q[0], " ", q[1], " ", q[2], " ", q[3]),
        absl::StrCat("must have a norm within ", kQuaternionNormTolerance, " of 1 and has ", norm));
    return;
  }
  if (std::abs(norm - 1.0) > kUnitNorm) q /= norm;
  pose->orientation = Eigen::Quaterniond(q);
}

void ReadInformation(FieldReader* fields, bool is_planar, Matrix6d* information) {
  constexpr std::array kPlanarRows = {0, 1, 5};
  const int size = is_planar ? 3 : 6;
  for (int r = 0; r < size; ++r) {
    for (int c = r; c < size; ++c) {
      const std::string name = absl::StrCat("I", r + 1, c + 1);
      const double value = fields->Number(name.c_str());
      const int row = is_planar ? kPlanarRows[static_cast<size_t>(r)] : r;
      const int column = is_planar ? kPlanarRows[static_cast<size_t>(c)] : c;
      (*information)(row, column) = value;
      (*information)(column, row) = value;
    }
  }
}

}  // namespace

absl::Status G2oPosition::Error(const std::string& message) const {
  return MakeError(Reason::kFileMalformed, absl::StrCat(file, ":", line, ": ", message),
                   {{"file", file}, {"line", absl::StrCat(line)}});
}

std::string QuoteText(std::string_view text) {
  const std::string_view shown = text.substr(0, kQuotedLengthMax);
  return absl::StrCat("\"", absl::CHexEscape(absl::string_view(shown.data(), shown.size())),
                      text.size() > shown.size() ? "...\"" : "\"");
}

absl::StatusOr<G2oLine> ParseG2oLine(const G2oPosition& at, std::string_view text) {
  FieldReader fields(at, text.substr(0, text.find('#')));
  G2oLine line;
  const std::string_view kind = fields.Next();
  if (kind.empty()) return line;
  line.is_planar = kind == "VERTEX_SE2" || kind == "EDGE_SE2";
  if (line.is_planar || kind == "VERTEX_SE3:QUAT" || kind == "EDGE_SE3:QUAT") {
    const bool is_edge = kind.starts_with("EDGE");
    line.kind = is_edge ? G2oLine::Kind::kEdge : G2oLine::Kind::kVertex;
    line.ids[0] = fields.Id(is_edge ? "from" : "id");
    if (is_edge) line.ids[1] = fields.Id("to");
    line.is_planar ? ReadPlanarPose(&fields, &line.pose) : ReadSpatialPose(&fields, &line.pose);
    if (is_edge) ReadInformation(&fields, line.is_planar, &line.information);
    fields.End();
  } else if (kind == "FIX") {
    line.kind = G2oLine::Kind::kFix;
    line.ids[0] = fields.Id("id");
  } else {
    line.kind = G2oLine::Kind::kOther;
  }
  if (!fields.status().ok()) return fields.status();
  return line;
}

bool IsInformation(const Matrix6d& information, bool is_planar) {
  const Eigen::MatrixXd matrix =
      is_planar ? Eigen::MatrixXd(PlanarBlock(information)) : Eigen::MatrixXd(information);
  const Eigen::VectorXd diagonal = matrix.diagonal();
  if (!(diagonal.minCoeff() >= kInformationMin && diagonal.maxCoeff() <= kInformationMax)) {
    return false;
  }
  // Metres and radians are scaled away.
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  if (!scaled.allFinite() || !(scaled.cwiseAbs().maxCoeff() < 2.0)) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled, Eigen::EigenvaluesOnly);
  return solver.info() == Eigen::Success && solver.eigenvalues()[0] > kEigenvalueMin;
}

}  // namespace dsg::ingest
