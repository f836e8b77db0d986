// SPDX-License-Identifier: Apache-2.0
// PLY files are read back by a reader of our own that follows their headers.
#include "query/cli/export/mesh_file.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "schema/picture/look.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/query/cli/example_content.h"

namespace dsg::cli {
namespace {

using Row = std::map<std::string, double>;

struct Element {
  std::string name;
  size_t count = 0;
  /// Type and name; lists have the type "list".
  std::vector<std::pair<std::string, std::string>> properties;
};

struct Ply {
  std::vector<std::string> comments;
  std::map<std::string, std::vector<Row>> rows;
  std::vector<std::vector<int32_t>> lists;
  size_t bytes_left = 0;
};

template <class T>
T Take(const std::string& bytes, size_t* at) {
  T value{};
  EXPECT_LE(*at + sizeof(T), bytes.size());
  if (*at + sizeof(T) <= bytes.size()) std::memcpy(&value, bytes.data() + *at, sizeof(T));
  *at += sizeof(T);
  return value;
}

double TakeNumber(const std::string& type, const std::string& bytes, size_t* at) {
  if (type == "float") return static_cast<double>(Take<float>(bytes, at));
  if (type == "uchar") return Take<uint8_t>(bytes, at);
  if (type == "int") return Take<int32_t>(bytes, at);
  if (type == "uint") return Take<uint32_t>(bytes, at);
  ADD_FAILURE() << "unknown type " << type;
  return 0.0;
}

std::vector<Element> ReadHeader(std::istringstream* header, Ply* ply) {
  std::vector<Element> elements;
  std::string line;
  std::getline(*header, line);
  EXPECT_EQ(line, "ply");
  std::getline(*header, line);
  EXPECT_EQ(line, "format binary_little_endian 1.0");
  while (std::getline(*header, line)) {
    std::istringstream words(line);
    std::string word, type, name;
    words >> word;
    if (word == "comment") {
      ply->comments.push_back(line.substr(8));
    } else if (word == "element") {
      elements.emplace_back();
      words >> elements.back().name >> elements.back().count;
    } else if (word == "property") {
      words >> type;
      if (type == "list") {
        EXPECT_EQ(line, "property list uchar int vertex_indices");
      } else {
        words >> name;
      }
      elements.back().properties.emplace_back(type, name);
    } else {
      ADD_FAILURE() << "unknown line " << line;
    }
  }
  return elements;
}

Ply ReadPly(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::string end = "end_header\n";
  size_t at = bytes.find(end);
  Ply ply;
  EXPECT_NE(at, std::string::npos);
  if (at == std::string::npos) return ply;
  std::istringstream header(bytes.substr(0, at));
  at += end.size();
  for (const Element& element : ReadHeader(&header, &ply)) {
    for (size_t i = 0; i < element.count; ++i) {
      Row row;
      for (const auto& [type, name] : element.properties) {
        if (type != "list") {
          row[name] = TakeNumber(type, bytes, &at);
          continue;
        }
        ply.lists.emplace_back(Take<uint8_t>(bytes, &at));
        for (int32_t& index : ply.lists.back()) index = Take<int32_t>(bytes, &at);
      }
      ply.rows[element.name].push_back(row);
    }
  }
  ply.bytes_left = bytes.size() - at;
  return ply;
}

uint32_t RgbOf(const Row& row) {
  return static_cast<uint32_t>(row.at("red")) << 16 | static_cast<uint32_t>(row.at("green")) << 8 |
         static_cast<uint32_t>(row.at("blue"));
}

class PlyTest : public testing::Test {
 protected:
  Ply Mesh(const MapContent& content, MeshColor color = MeshColor::kAuto) {
    auto file = AtomicFile::Create(path_, true);
    EXPECT_TRUE(file.ok() && WriteMeshPly(content, color, &*file).ok() && file->Commit().ok());
    return ReadPly(path_);
  }
  Ply Graph(const MapContent& content) {
    auto file = AtomicFile::Create(path_, true);
    EXPECT_TRUE(file.ok() && WriteGraphPly(content, &*file).ok() && file->Commit().ok());
    return ReadPly(path_);
  }

  dsg::test::TempFolder folder_;
  const std::string path_ = folder_.path() + "/a.ply";
};

TEST_F(PlyTest, HoldsTheMeshWithNormalsLabelsAndFaces) {
  const Ply ply = Mesh(test::ExampleContent());
  const std::vector<Row>& vertices = ply.rows.at("vertex");
  ASSERT_EQ(vertices.size(), 8u);
  EXPECT_EQ(vertices[6].at("x"), 4.0);
  EXPECT_EQ(vertices[6].at("y"), 4.0);
  for (const Row& vertex : vertices) {
    // Made from the faces, since the blocks have none.
    EXPECT_EQ(vertex.at("nz"), 1.0);
    EXPECT_EQ(vertex.at("label"), 3.0);
    EXPECT_EQ(vertex.at("instance"), 9.0);
    EXPECT_EQ(RgbOf(vertex), LabelColor(3));
  }
  // Indices of the second block count on from the first.
  ASSERT_EQ(ply.lists.size(), 4u);
  EXPECT_EQ(ply.lists[3], (std::vector<int32_t>{4, 6, 7}));
  EXPECT_EQ(ply.bytes_left, 0u);
  EXPECT_EQ(ply.comments[0], "map example at revision 5");
  EXPECT_EQ(ply.comments[2], "label 3 chair");
}

TEST_F(PlyTest, ColoursByWhatIsAskedFor) {
  MapContent content = test::ExampleContent();
  content.mesh[0].colors = {0x010203, 0x010203, 0x010203, 0x010203};
  EXPECT_EQ(RgbOf(Mesh(content).rows.at("vertex")[0]), 0x010203u);
  EXPECT_EQ(RgbOf(Mesh(content, MeshColor::kLabel).rows.at("vertex")[0]), LabelColor(3));
  EXPECT_EQ(RgbOf(Mesh(content, MeshColor::kInstance).rows.at("vertex")[0]), LabelColor(9));
}

TEST_F(PlyTest, OfAMapWithoutMeshIsAFileWithoutVertices) {
  const Ply ply = Mesh(MapContent());
  EXPECT_TRUE(ply.rows.empty());
  EXPECT_EQ(ply.bytes_left, 0u);
  EXPECT_TRUE(Graph(MapContent()).rows.empty());
}

TEST_F(PlyTest, HoldsTheGraphAsPointsAndLines) {
  const MapContent content = test::ExampleContent();
  const Ply ply = Graph(content);
  const std::vector<Row>& vertices = ply.rows.at("vertex");
  const std::vector<Row>& lines = ply.rows.at("edge");
  // Nodes, four boxes or prisms (rooms, chair, wall) of eight corners, five poses.
  ASSERT_EQ(vertices.size(), content.nodes.size() + 4 * 8 + 5);
  // Edges, twelve lines a box, three steps.
  ASSERT_EQ(lines.size(), content.edges.size() + 4 * 12 + 3);
  // The agent stands where it was last.
  EXPECT_EQ(vertices[0].at("x"), 7.0);
  EXPECT_EQ(vertices[0].at("layer"), layers::kAgents);
  const Row& traversable = lines[1];
  EXPECT_EQ(vertices[static_cast<size_t>(traversable.at("vertex1"))].at("x"), 2.0);
  EXPECT_EQ(vertices[static_cast<size_t>(traversable.at("vertex2"))].at("x"), 6.0);
  for (const Row& line : lines) {
    EXPECT_LT(line.at("vertex1"), static_cast<double>(vertices.size()));
    EXPECT_LT(line.at("vertex2"), static_cast<double>(vertices.size()));
  }
  EXPECT_EQ(ply.bytes_left, 0u);
}

}  // namespace
}  // namespace dsg::cli
