// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "ingest/rooms/structure.h"

namespace dsg::ingest {
namespace {

using absl::ascii_isalpha;
using absl::ascii_isdigit;
using absl::ascii_isupper;

unsigned char Byte(char letter) { return static_cast<unsigned char>(letter); }

// Lower case; letters alone and numbers are no words: "WallUp_A_3x" is "wall", "up".
std::vector<std::string> WordsOf(const std::string& name) {
  std::vector<std::string> words;
  std::string word;
  const auto end_word = [&] {
    if (word.size() > 1) words.push_back(word);
    word.clear();
  };
  for (size_t i = 0; i < name.size(); ++i) {
    const bool is_hump = i > 0 && ascii_isupper(Byte(name[i])) && !ascii_isupper(Byte(name[i - 1]));
    if (!ascii_isalpha(Byte(name[i])) || is_hump) end_word();
    if (ascii_isalpha(Byte(name[i]))) word += absl::ascii_tolower(Byte(name[i]));
  }
  end_word();
  return words;
}

// Files of game engines are named from the general to the special, "Walls_Kitchen", "Floor_3x3";
// plain words the other way round, "floor mat", "glass wall".
bool IsAssetName(const std::string& name) {
  if (name.empty() || !ascii_isupper(Byte(name[0]))) return false;
  for (size_t i = 1; i < name.size(); ++i) {
    if (name[i] == ' ') return false;
    if (name[i] == '_' || ascii_isdigit(Byte(name[i])) || ascii_isupper(Byte(name[i]))) return true;
  }
  return false;
}

// As uHumans2 names its pieces of wall: "W_6x_Door", "W_ConnectSeam".
bool IsShortWall(const std::string& name) {
  return name.size() > 2 && name[0] == 'W' && name[1] == '_';
}

bool IsAnyOf(const std::string& word, std::initializer_list<const char*> words) {
  for (const char* other : words) {
    if (word == other || word == std::string(other) + "s") return true;
  }
  return false;
}

enum class Kind { kNone, kWall, kFloor, kCeiling, kPillar };

Kind KindOf(const std::string& name) {
  if (IsShortWall(name)) return Kind::kWall;
  const std::vector<std::string> words = WordsOf(name);
  if (words.empty()) return Kind::kNone;
  const std::string& word = IsAssetName(name) ? words.front() : words.back();
  if (IsAnyOf(word, {"wall", "glass", "window"})) return Kind::kWall;
  if (IsAnyOf(word, {"floor"})) return Kind::kFloor;
  if (IsAnyOf(word, {"ceiling"})) return Kind::kCeiling;
  if (IsAnyOf(word, {"pillar", "column"})) return Kind::kPillar;
  return Kind::kNone;
}

bool Holds(const std::vector<int32_t>& ids, int32_t id) {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

}  // namespace

StructureClasses StructureClasses::FromLabels(const std::vector<SemanticLabel>& labels) {
  // Where many names share an id, most of them say what it is.
  std::map<int32_t, std::map<Kind, int>> votes;
  for (const SemanticLabel& label : labels) ++votes[label.id][KindOf(label.name)];
  StructureClasses classes;
  for (const auto& [id, counts] : votes) {
    const auto most =
        std::max_element(counts.begin(), counts.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    if (most->first == Kind::kWall) classes.wall.push_back(id);
    if (most->first == Kind::kFloor) classes.floor.push_back(id);
    if (most->first == Kind::kCeiling) classes.ceiling.push_back(id);
    if (most->first == Kind::kPillar) classes.pillar.push_back(id);
  }
  return classes;
}

bool StructureClasses::IsStructure(int32_t class_id) const {
  return Holds(wall, class_id) || Holds(floor, class_id) || Holds(ceiling, class_id) ||
         Holds(pillar, class_id);
}

}  // namespace dsg::ingest
