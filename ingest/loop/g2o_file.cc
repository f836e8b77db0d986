// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/g2o_file.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

#include "absl/strings/str_cat.h"
#include "ingest/files/output_file.h"
#include "ingest/loop/g2o_line.h"
#include "ingest/loop/optimize.h"
#include "ingest/loop/residual.h"
#include "ingest/loop/start.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr size_t kFilePoseCountMax = 1'000'000;
constexpr size_t kEdgeCountMax = 2'000'000;
// An edge has 31 fields; whatever is longer is no text file.
constexpr size_t kLineLengthMax = 8192;
// The robot's letter in keys of GTSAM.
constexpr int kLetterShift = 56;

constexpr char kOtherLines[] = "line of another kind";
constexpr char kNotDefinite[] = "information matrix not positive definite";
constexpr char kToItself[] = "edge from a pose to itself";
constexpr char kFixUnknown[] = "FIX of an unknown pose";

struct Vertex {
  int64_t id = 0;
  int64_t line = 0;
  Pose3d pose;
};

struct Edge {
  std::array<int64_t, 2> ids;
  RelativePose edge;
};

// False at the end of the file. Errors: a line that is too long.
absl::StatusOr<bool> ReadLine(std::istream* in, const G2oPosition& at, std::string* text) {
  text->resize(kLineLengthMax + 1);
  in->getline(text->data(), static_cast<std::streamsize>(text->size()));
  // getline counts the line end that it took, and has none at the end of the file.
  const auto taken = static_cast<size_t>(in->gcount());
  if (taken == 0) return false;
  if (in->fail()) {
    return at.Error(
        absl::StrCat("a line of more than ", kLineLengthMax, " characters; this is no g2o file"));
  }
  text->resize(in->eof() ? taken : taken - 1);
  return true;
}

class G2oReader {
 public:
  explicit G2oReader(const std::string& path) : path_(path) {}

  absl::StatusOr<G2oFile> Read(std::istream* in);

 private:
  absl::Status ReadLines(std::istream* in);
  absl::Status Take(const G2oPosition& at, const G2oLine& line, const std::string& text);
  absl::Status TakeEdge(const G2oPosition& at, const G2oLine& line);
  absl::Status CheckKind(const G2oPosition& at, const G2oLine& line);
  void Skip(const char* reason, int64_t line, const std::string& text = "");
  absl::Status NumberPoses();
  absl::Status NumberEdges();
  void Fix();
  void TellParts();
  std::optional<int> IndexOf(int64_t id) const;

  const std::string& path_;
  std::vector<Vertex> vertices_;
  std::vector<Edge> edges_;
  std::vector<std::pair<int64_t, int64_t>> fixes_;
  // The first line that told whether the graph is planar; 0 = none yet.
  int64_t kind_line_ = 0;
  G2oFile file_;
};

absl::StatusOr<G2oFile> G2oReader::Read(std::istream* in) {
  DSG_RETURN_IF_ERROR(ReadLines(in));
  if (edges_.empty()) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(path_,
                                  ": not one usable EDGE_SE2 or EDGE_SE3:QUAT line; a pose "
                                  "graph needs measurements between poses"),
                     {{"file", path_}});
  }
  DSG_RETURN_IF_ERROR(NumberPoses());
  DSG_RETURN_IF_ERROR(NumberEdges());
  Fix();
  if (!file_.has_start) {
    const std::vector<int> parts = PartsOf(file_.graph, {});
    file_.graph.poses = TreeStart(file_.graph, {}, AnchorsOf(parts, file_.fixed_pose));
  }
  TellParts();
  return std::move(file_);
}

absl::Status G2oReader::ReadLines(std::istream* in) {
  std::string text;
  G2oPosition at{path_, 0};
  while (true) {
    ++at.line;
    DSG_ASSIGN_OR_RETURN(const bool is_there, ReadLine(in, at, &text));
    if (!is_there) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const G2oLine line, ParseG2oLine(at, text));
    DSG_RETURN_IF_ERROR(Take(at, line, text));
  }
}

absl::Status G2oReader::Take(const G2oPosition& at, const G2oLine& line, const std::string& text) {
  switch (line.kind) {
    case G2oLine::Kind::kBlank:
      return absl::OkStatus();
    case G2oLine::Kind::kOther:
      Skip(kOtherLines, at.line, text.substr(0, text.find(' ')));
      return absl::OkStatus();
    case G2oLine::Kind::kFix:
      // One is enough to hold a graph.
      if (fixes_.size() < kFilePoseCountMax) fixes_.emplace_back(line.ids[0], at.line);
      return absl::OkStatus();
    case G2oLine::Kind::kVertex:
      DSG_RETURN_IF_ERROR(CheckKind(at, line));
      if (vertices_.size() == kFilePoseCountMax) {
        return MakeError(Reason::kLimitExceeded,
                         absl::StrCat(path_, ":", at.line, ": more than ", kFilePoseCountMax,
                                      " poses; thin the graph out"));
      }
      vertices_.push_back({line.ids[0], at.line, line.pose});
      return absl::OkStatus();
    case G2oLine::Kind::kEdge:
      return TakeEdge(at, line);
  }
  return absl::OkStatus();
}

absl::Status G2oReader::CheckKind(const G2oPosition& at, const G2oLine& line) {
  if (kind_line_ == 0) {
    kind_line_ = at.line;
    file_.graph.is_planar = line.is_planar;
  }
  if (line.is_planar == file_.graph.is_planar) return absl::OkStatus();
  return at.Error(absl::StrCat("a ", line.is_planar ? "planar" : "spatial", " line in a ",
                               file_.graph.is_planar ? "planar" : "spatial", " graph (line ",
                               kind_line_, "); write them to two files"));
}

absl::Status G2oReader::TakeEdge(const G2oPosition& at, const G2oLine& line) {
  DSG_RETURN_IF_ERROR(CheckKind(at, line));
  if (line.ids[0] == line.ids[1]) {
    Skip(kToItself, at.line);
    return absl::OkStatus();
  }
  if (!IsInformation(line.information, line.is_planar)) {
    Skip(kNotDefinite, at.line);
    return absl::OkStatus();
  }
  if (edges_.size() == kEdgeCountMax) {
    return MakeError(Reason::kLimitExceeded,
                     absl::StrCat(path_, ":", at.line, ": more than ", kEdgeCountMax,
                                  " edges; thin the graph out"));
  }
  Edge edge{line.ids, {}};
  edge.edge.from_T_to = line.pose;
  edge.edge.information = line.information;
  edge.edge.line = at.line;
  edges_.push_back(std::move(edge));
  return absl::OkStatus();
}

void G2oReader::Skip(const char* reason, int64_t line, const std::string& text) {
  if (++file_.skipped[reason] > 1) return;
  const std::string named = text.empty() ? "" : absl::StrCat(" ", QuoteText(text));
  file_.notes.push_back(absl::StrCat("line ", line, ": left out: ", reason, named,
                                     "; more of them are only counted"));
}

absl::Status G2oReader::NumberPoses() {
  PoseGraph& graph = file_.graph;
  file_.has_start = !vertices_.empty();
  if (!file_.has_start) {
    for (const Edge& edge : edges_)
      graph.ids.insert(graph.ids.end(), edge.ids.begin(), edge.ids.end());
    std::sort(graph.ids.begin(), graph.ids.end());
    graph.ids.erase(std::unique(graph.ids.begin(), graph.ids.end()), graph.ids.end());
    graph.poses.resize(graph.ids.size());
    return absl::OkStatus();
  }
  std::stable_sort(vertices_.begin(), vertices_.end(),
                   [](const Vertex& a, const Vertex& b) { return a.id < b.id; });
  for (const Vertex& vertex : vertices_) {
    if (!graph.ids.empty() && graph.ids.back() == vertex.id) {
      return G2oPosition{path_, vertex.line}.Error(
          absl::StrCat("vertex ", vertex.id, " for the second time; it is in line ",
                       (&vertex)[-1].line, " already"));
    }
    graph.ids.push_back(vertex.id);
    graph.poses.push_back(vertex.pose);
  }
  vertices_ = {};
  return absl::OkStatus();
}

std::optional<int> G2oReader::IndexOf(int64_t id) const {
  const std::vector<int64_t>& ids = file_.graph.ids;
  const auto found = std::lower_bound(ids.begin(), ids.end(), id);
  if (found == ids.end() || *found != id) return std::nullopt;
  return static_cast<int>(found - ids.begin());
}

absl::Status G2oReader::NumberEdges() {
  for (Edge& edge : edges_) {
    std::array<int, 2> indices = {0, 0};
    for (const size_t end : {size_t{0}, size_t{1}}) {
      const std::optional<int> index = IndexOf(edge.ids[end]);
      if (!index.has_value()) {
        return G2oPosition{path_, edge.edge.line}.Error(
            absl::StrCat("field ", end == 0 ? "from" : "to", " is ", edge.ids[end],
                         ", a vertex that the file does not have; add its VERTEX line or leave "
                         "all of them out"));
      }
      indices[end] = *index;
    }
    edge.edge.from = indices[0];
    edge.edge.to = indices[1];
    const bool is_same_robot = edge.ids[0] >> kLetterShift == edge.ids[1] >> kLetterShift;
    edge.edge.is_loop = !is_same_robot || std::abs(indices[0] - indices[1]) != 1;
    file_.graph.edges.push_back(edge.edge);
  }
  edges_ = {};
  return absl::OkStatus();
}

void G2oReader::Fix() {
  bool is_fixed = false;
  for (const auto& [id, line] : fixes_) {
    const std::optional<int> index = IndexOf(id);
    if (!index.has_value()) {
      Skip(kFixUnknown, line);
    } else if (!is_fixed) {
      file_.fixed_pose = *index;
      is_fixed = true;
    }
  }
}

void G2oReader::TellParts() {
  std::vector<int64_t> sizes;
  for (const int part : PartsOf(file_.graph, {})) {
    if (static_cast<size_t>(part) >= sizes.size()) sizes.resize(static_cast<size_t>(part) + 1);
    ++sizes[static_cast<size_t>(part)];
  }
  const int64_t lone_count = std::count(sizes.begin(), sizes.end(), 1);
  const int64_t part_count = static_cast<int64_t>(sizes.size()) - lone_count;
  if (lone_count > 0) {
    file_.notes.push_back(absl::StrCat(lone_count, " of ", file_.graph.poses.size(),
                                       " poses have no edge; they stay where they are"));
  }
  if (part_count > 1) {
    file_.notes.push_back(absl::StrCat("the graph falls into ", part_count,
                                       " parts without an edge between them; each keeps its own "
                                       "first pose"));
  }
}

void AppendNumber(double value, std::string* out) {
  char digits[32];
  const auto [end, error] = std::to_chars(digits, digits + sizeof(digits), value);
  out->push_back(' ');
  out->append(digits, end);
}

void AppendPose(const Pose3d& pose, bool is_planar, std::string* out) {
  if (is_planar) {
    for (const double value : PlanarOf(pose)) AppendNumber(value, out);
    return;
  }
  for (const double value : pose.position) AppendNumber(value, out);
  for (const double value : pose.orientation.coeffs()) AppendNumber(value, out);
}

template <typename Matrix>
void AppendUpper(const Matrix& matrix, std::string* out) {
  for (int r = 0; r < matrix.rows(); ++r) {
    for (int c = r; c < matrix.cols(); ++c) AppendNumber(matrix(r, c), out);
  }
}

}  // namespace

absl::StatusOr<G2oFile> ReadG2oStream(std::istream* in, const std::string& name) {
  return G2oReader(name).Read(in);
}

absl::StatusOr<G2oFile> ReadG2o(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    return absl::NotFoundError(absl::StrCat("no file \"", path, "\""));
  }
  if (status.type() != std::filesystem::file_type::regular) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("\"", path, "\" is not a regular file; give a g2o file"));
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("cannot read \"", path, "\": ", std::strerror(errno)));
  }
  return ReadG2oStream(&in, path);
}

absl::Status WriteG2o(const PoseGraph& graph, const std::string& path) {
  DSG_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path));
  std::string& out = file.buffer();
  for (size_t i = 0; i < graph.poses.size(); ++i) {
    absl::StrAppend(&out, graph.is_planar ? "VERTEX_SE2 " : "VERTEX_SE3:QUAT ", graph.ids[i]);
    AppendPose(graph.poses[i], graph.is_planar, &out);
    out.push_back('\n');
    DSG_RETURN_IF_ERROR(file.Flush());
  }
  for (const RelativePose& edge : graph.edges) {
    absl::StrAppend(&out, graph.is_planar ? "EDGE_SE2 " : "EDGE_SE3:QUAT ",
                    graph.ids[static_cast<size_t>(edge.from)], " ",
                    graph.ids[static_cast<size_t>(edge.to)]);
    AppendPose(edge.from_T_to, graph.is_planar, &out);
    if (graph.is_planar) {
      AppendUpper(PlanarBlock(edge.information), &out);
    } else {
      AppendUpper(edge.information, &out);
    }
    out.push_back('\n');
    DSG_RETURN_IF_ERROR(file.Flush());
  }
  return file.Commit();
}

}  // namespace dsg::ingest
