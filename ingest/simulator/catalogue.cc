// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/catalogue.h"

#include <map>

#include "schema/base/check.h"

namespace dsg::simulator {
namespace {

constexpr Piece kDesk[] = {
    {"desk", 0.0, 0.37, 1.4, 0.7, 0.74},
    {"chair", 0.0, 1.05, 0.5, 0.5, 0.9, 2},
    {"laptop", 0.0, 0.4, 0.35, 0.25, 0.22, 0, 0},
    {"cup", 0.5, 0.5, 0.08, 0.08, 0.1, 0, 0, 0.6},
};
constexpr Piece kMeetingTable[] = {
    {"table", 0.0, 0.0, 2.4, 1.0, 0.75},
    {"chair", -0.8, 0.82, 0.5, 0.5, 0.9, 2},
    {"chair", 0.0, 0.82, 0.5, 0.5, 0.9, 2},
    {"chair", 0.8, 0.82, 0.5, 0.5, 0.9, 2},
    {"chair", -0.8, -0.82, 0.5, 0.5, 0.9},
    {"chair", 0.0, -0.82, 0.5, 0.5, 0.9},
    {"chair", 0.8, -0.82, 0.5, 0.5, 0.9},
    {"laptop", -0.8, 0.2, 0.35, 0.25, 0.22, 0, 0, 0.5},
    {"cup", 0.5, -0.3, 0.08, 0.08, 0.1, 0, 0, 0.5},
};
constexpr Piece kDiningTable[] = {
    {"table", 0.0, 0.0, 1.4, 0.8, 0.75},
    {"chair", -0.35, 0.7, 0.45, 0.45, 0.9, 2},
    {"chair", 0.35, 0.7, 0.45, 0.45, 0.9, 2},
    {"chair", -0.35, -0.7, 0.45, 0.45, 0.9},
    {"chair", 0.35, -0.7, 0.45, 0.45, 0.9},
    {"cup", -0.4, 0.2, 0.08, 0.08, 0.1, 0, 0},
    {"bowl", 0.1, 0.0, 0.25, 0.25, 0.1, 0, 0, 0.7},
};
constexpr Piece kCouch[] = {
    {"couch", 0.0, 0.45, 1.9, 0.85, 0.8},
    {"coffee table", 0.0, 1.4, 1.0, 0.5, 0.42},
    {"cup", 0.3, 1.4, 0.08, 0.08, 0.1, 0, 1, 0.6},
    {"book", -0.25, 1.4, 0.22, 0.16, 0.03, 0, 1, 0.6},
};
constexpr Piece kCounter[] = {
    {"counter", 0.0, 0.32, 2.2, 0.6, 0.9},
    {"microwave", -0.75, 0.3, 0.5, 0.38, 0.3, 0, 0},
    {"coffee machine", 0.0, 0.25, 0.3, 0.32, 0.38, 0, 0},
    {"cup", 0.4, 0.35, 0.08, 0.08, 0.1, 0, 0},
    {"cup", 0.6, 0.3, 0.08, 0.08, 0.1, 0, 0, 0.6},
};
constexpr Piece kTelevision[] = {
    {"tv stand", 0.0, 0.22, 1.6, 0.4, 0.45},
    {"tv", 0.0, 0.2, 1.2, 0.1, 0.7, 0, 0},
};
constexpr Piece kBed[] = {
    {"bed", 0.0, 1.04, 1.6, 2.04, 0.55},
    {"nightstand", 1.08, 0.24, 0.45, 0.4, 0.5},
    {"book", 1.08, 0.24, 0.16, 0.22, 0.03, 0, 1, 0.5},
};
constexpr Piece kArmchair[] = {{"armchair", 0.0, 0.45, 0.8, 0.85, 0.85}};
constexpr Piece kFridge[] = {{"fridge", 0.0, 0.37, 0.7, 0.7, 1.8}};
constexpr Piece kShelf[] = {{"shelf", 0.0, 0.2, 1.2, 0.36, 1.9}};
constexpr Piece kCabinet[] = {{"cabinet", 0.0, 0.25, 0.9, 0.45, 1.3}};
constexpr Piece kPlant[] = {{"plant", 0.0, 0.26, 0.45, 0.45, 1.2}};
constexpr Piece kPrinter[] = {{"printer", 0.0, 0.33, 0.65, 0.6, 1.1}};
constexpr Piece kBin[] = {{"bin", 0.0, 0.18, 0.3, 0.3, 0.4}};
constexpr Piece kLamp[] = {{"lamp", 0.0, 0.2, 0.35, 0.35, 1.6}};
constexpr Piece kWardrobe[] = {{"wardrobe", 0.0, 0.32, 1.4, 0.6, 2.0}};
constexpr Piece kToilet[] = {{"toilet", 0.0, 0.35, 0.4, 0.65, 0.8}};
constexpr Piece kWashbasin[] = {{"washbasin", 0.0, 0.25, 0.6, 0.45, 0.85}};
constexpr Piece kBathtub[] = {{"bathtub", 0.0, 0.4, 1.7, 0.75, 0.6}};

constexpr Placement kWall = Placement::kWall;
constexpr Placement kCenter = Placement::kCenter;

std::map<std::string, std::vector<GroupCount>, std::less<>> MakeFurniture() {
  std::map<std::string, std::vector<GroupCount>, std::less<>> furniture;
  furniture["corridor"] = {{kPlant, kWall, 2, 3}, {kBin, kWall, 1, 2}};
  furniture["hallway"] = {{kPlant, kWall, 1, 1}};
  furniture["office"] = {
      {kDesk, kWall, 2, 3}, {kShelf, kWall, 1, 1}, {kBin, kWall, 1, 1}, {kPlant, kWall, 0, 1}};
  furniture["meeting room"] = {{kMeetingTable, kCenter, 1, 1},
                               {kTelevision, kWall, 1, 1},
                               {kCabinet, kWall, 0, 1},
                               {kPlant, kWall, 0, 1}};
  furniture["kitchen"] = {{kCounter, kWall, 1, 1},
                          {kFridge, kWall, 1, 1},
                          {kDiningTable, kCenter, 1, 1},
                          {kBin, kWall, 1, 1}};
  furniture["lounge"] = {{kCouch, kWall, 2, 2},
                         {kTelevision, kWall, 1, 1},
                         {kPlant, kWall, 1, 2},
                         {kLamp, kWall, 1, 1}};
  furniture["library"] = {{kShelf, kWall, 4, 5},
                          {kDiningTable, kCenter, 1, 1},
                          {kArmchair, kWall, 1, 1},
                          {kLamp, kWall, 1, 1}};
  furniture["copy room"] = {{kPrinter, kWall, 2, 2}, {kCabinet, kWall, 1, 1}, {kBin, kWall, 1, 1}};
  furniture["storage room"] = {{kShelf, kWall, 3, 4}, {kCabinet, kWall, 1, 1}};
  furniture["restroom"] = {{kToilet, kWall, 2, 2}, {kWashbasin, kWall, 2, 2}, {kBin, kWall, 1, 1}};
  furniture["bathroom"] = {
      {kBathtub, kWall, 1, 1}, {kToilet, kWall, 1, 1}, {kWashbasin, kWall, 1, 1}};
  furniture["living room"] = {{kCouch, kWall, 1, 1},    {kTelevision, kWall, 1, 1},
                              {kArmchair, kWall, 1, 1}, {kShelf, kWall, 1, 1},
                              {kPlant, kWall, 1, 1},    {kLamp, kWall, 1, 1}};
  furniture["bedroom"] = {{kBed, kWall, 1, 1}, {kWardrobe, kWall, 1, 1}, {kDesk, kWall, 0, 1}};
  furniture["study"] = {{kDesk, kWall, 1, 1}, {kShelf, kWall, 1, 2}, {kArmchair, kWall, 1, 1}};
  return furniture;
}

PlanSpec MakeOffice() {
  return {"office",
          "corridor",
          2.4,
          5.2,
          6.4,
          2.8,
          1.0,
          {{"office", 7, 4.2, 5.4},
           {"meeting room", 3, 5.0, 6.0},
           {"kitchen", 1, 5.0, 5.6},
           {"lounge", 1, 6.0, 7.0},
           {"library", 1, 5.4, 6.4},
           {"copy room", 1, 3.0, 3.6},
           {"storage room", 1, 3.0, 3.6},
           {"restroom", 1, 3.2, 3.8}}};
}

PlanSpec MakeApartment() {
  return {"apartment",
          "hallway",
          1.6,
          4.2,
          4.8,
          2.5,
          0.9,
          {{"living room", 1, 5.4, 6.2},
           {"kitchen", 1, 4.2, 4.8},
           {"bathroom", 1, 2.8, 3.2},
           {"bedroom", 2, 4.0, 4.6},
           {"study", 1, 3.4, 4.0}}};
}

}  // namespace

const std::vector<SemanticLabel>& Labels() {
  static const std::vector<SemanticLabel> labels = {
      {1, "wall"},
      {2, "floor"},
      {3, "ceiling"},
      {10, "desk"},
      {11, "chair"},
      {12, "table"},
      {13, "couch"},
      {14, "coffee table"},
      {15, "armchair"},
      {16, "counter"},
      {17, "fridge"},
      {18, "microwave"},
      {19, "coffee machine"},
      {20, "cup"},
      {21, "bowl"},
      {22, "laptop"},
      {23, "book"},
      {24, "shelf"},
      {25, "cabinet"},
      {26, "plant"},
      {27, "printer"},
      {28, "bin"},
      {29, "lamp"},
      {30, "tv stand"},
      {31, "tv"},
      {32, "bed"},
      {33, "nightstand"},
      {34, "wardrobe"},
      {35, "toilet"},
      {36, "washbasin"},
      {37, "bathtub"},
      {100, "corridor"},
      {101, "hallway"},
      {102, "office"},
      {103, "meeting room"},
      {104, "kitchen"},
      {105, "lounge"},
      {106, "library"},
      {107, "copy room"},
      {108, "storage room"},
      {109, "restroom"},
      {110, "bathroom"},
      {111, "living room"},
      {112, "bedroom"},
      {113, "study"},
      {200, "office building"},
      {201, "apartment building"},
  };
  return labels;
}

int32_t ClassId(std::string_view class_name) {
  for (const SemanticLabel& label : Labels()) {
    if (label.name == class_name) return label.id;
  }
  DSG_CHECK(false && "a class name that is not in the catalogue");
  return -1;
}

std::vector<Color> ColorsOf(std::string_view class_name) {
  static const std::map<std::string, std::vector<Color>, std::less<>> colors = {
      {"chair", {{70, 78, 92, 255}, {44, 98, 128, 255}, {52, 56, 60, 255}}},
      {"couch", {{142, 84, 72, 255}, {78, 104, 132, 255}, {118, 112, 96, 255}}},
      {"armchair", {{164, 116, 68, 255}, {96, 124, 104, 255}}},
      {"cup", {{236, 236, 230, 255}, {196, 62, 52, 255}, {58, 106, 178, 255}}},
      {"bowl", {{226, 214, 186, 255}, {92, 150, 160, 255}}},
      {"book", {{150, 52, 58, 255}, {48, 88, 112, 255}, {84, 118, 70, 255}}},
      {"fridge", {{222, 228, 232, 255}}},
      {"counter", {{188, 184, 176, 255}}},
      {"microwave", {{96, 100, 104, 255}}},
      {"coffee machine", {{58, 50, 48, 255}}},
      {"laptop", {{62, 66, 72, 255}}},
      {"plant", {{74, 138, 72, 255}, {96, 154, 84, 255}}},
      {"printer", {{206, 206, 200, 255}}},
      {"bin", {{110, 114, 118, 255}}},
      {"lamp", {{232, 204, 120, 255}}},
      {"tv", {{30, 32, 36, 255}}},
      {"bed", {{192, 198, 212, 255}, {206, 186, 178, 255}}},
      {"cabinet", {{150, 154, 158, 255}}},
      {"toilet", {{238, 240, 240, 255}}},
      {"washbasin", {{232, 236, 238, 255}}},
      {"bathtub", {{228, 234, 238, 255}}},
  };
  if (const auto found = colors.find(class_name); found != colors.end()) return found->second;
  // Wood, for desks, tables, shelves and the like.
  return {{176, 134, 90, 255}, {154, 112, 72, 255}, {196, 158, 112, 255}};
}

const std::vector<GroupCount>& FurnitureOf(std::string_view room_class) {
  static const auto furniture = MakeFurniture();
  const auto found = furniture.find(room_class);
  DSG_CHECK(found != furniture.end());
  return found->second;
}

const PlanSpec& PlanSpecOf(WorldKind kind) {
  static const PlanSpec office = MakeOffice();
  static const PlanSpec apartment = MakeApartment();
  return kind == WorldKind::kOffice ? office : apartment;
}

}  // namespace dsg::simulator
