// SPDX-License-Identifier: Apache-2.0
// The furniture groups, and which room gets how many of them.
#include <map>

#include "ingest/simulator/world/catalogue.h"
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

constexpr Piece kDeskIsland[] = {
    {"desk", -0.71, 0.36, 1.4, 0.7, 0.74},
    {"desk", 0.71, 0.36, 1.4, 0.7, 0.74},
    {"desk", -0.71, -0.36, 1.4, 0.7, 0.74, 2},
    {"desk", 0.71, -0.36, 1.4, 0.7, 0.74, 2},
    {"office chair", -0.71, 1.05, 0.5, 0.5, 0.9, 2},
    {"office chair", 0.71, 1.05, 0.5, 0.5, 0.9, 2},
    {"office chair", -0.71, -1.05, 0.5, 0.5, 0.9},
    {"office chair", 0.71, -1.05, 0.5, 0.5, 0.9},
    {"laptop", -0.71, 0.4, 0.35, 0.25, 0.22, 0, 0, 0.8},
    {"laptop", 0.71, 0.4, 0.35, 0.25, 0.22, 0, 1, 0.8},
    {"laptop", -0.71, -0.4, 0.35, 0.25, 0.22, 2, 2, 0.8},
    {"laptop", 0.71, -0.4, 0.35, 0.25, 0.22, 2, 3, 0.8},
    {"cup", -0.2, 0.5, 0.08, 0.08, 0.1, 0, 0, 0.5},
    {"book", 1.2, -0.5, 0.22, 0.16, 0.03, 0, 3, 0.4},
};
constexpr Piece kSeatingIsland[] = {
    {"couch", 0.0, -0.95, 1.9, 0.85, 0.8},           {"coffee table", 0.0, 0.0, 1.0, 0.5, 0.42},
    {"armchair", -0.5, 0.95, 0.8, 0.85, 0.85, 2},    {"armchair", 0.5, 0.95, 0.8, 0.85, 0.85, 2},
    {"book", 0.2, 0.0, 0.22, 0.16, 0.03, 0, 1, 0.6}, {"cup", -0.3, 0.1, 0.08, 0.08, 0.1, 0, 1, 0.5},
};
constexpr Piece kReception[] = {
    {"counter", 0.0, -0.3, 2.2, 0.6, 0.9, 2},
    {"chair", 0.0, -1.0, 0.5, 0.5, 0.9},
    {"laptop", 0.0, -0.35, 0.35, 0.25, 0.22, 2, 0},
};

constexpr Placement kWall = Placement::kWall;
constexpr Placement kCenter = Placement::kCenter;
constexpr Placement kFloor = Placement::kFloor;

std::map<std::string, std::vector<GroupCount>, std::less<>> MakeFurniture() {
  std::map<std::string, std::vector<GroupCount>, std::less<>> furniture;
  furniture["corridor"] = {{kPlant, kWall, 2, 3}, {kBin, kWall, 1, 2}};
  furniture["hallway"] = {{kPlant, kWall, 1, 1}};
  furniture["office"] = {
      {kDesk, kWall, 2, 3, 8.0}, {kShelf, kWall, 1, 1}, {kBin, kWall, 1, 1}, {kPlant, kWall, 0, 1}};
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
  furniture["open office"] = {{kDeskIsland, kFloor, 2, 2, 58.0},
                              {kDiningTable, kFloor, 0, 1},
                              {kPrinter, kWall, 1, 1},
                              {kCouch, kWall, 1, 1},
                              {kShelf, kWall, 2, 3},
                              {kCabinet, kWall, 1, 2},
                              {kPlant, kWall, 2, 3, 90.0},
                              {kBin, kWall, 2, 2}};
  furniture["lobby"] = {{kReception, kFloor, 1, 1},  {kSeatingIsland, kFloor, 2, 2, 80.0},
                        {kCouch, kWall, 1, 2},       {kTelevision, kWall, 1, 1},
                        {kPlant, kWall, 3, 4, 60.0}, {kLamp, kWall, 2, 2},
                        {kBin, kWall, 1, 2}};
  return furniture;
}

std::map<std::string, std::vector<HungCount>, std::less<>> MakeHung() {
  constexpr HungPiece kWhiteboard = {"whiteboard", 1.8, 0.04, 1.2, 0.9};
  constexpr HungPiece kPicture = {"picture", 0.8, 0.03, 0.6, 1.4};
  constexpr HungPiece kLargePicture = {"picture", 1.2, 0.03, 0.8, 1.3};
  std::map<std::string, std::vector<HungCount>, std::less<>> hung;
  hung["corridor"] = {{kLargePicture, 2, 4}};
  hung["hallway"] = {{kPicture, 1, 2}};
  hung["office"] = {{kWhiteboard, 0, 1}, {kPicture, 1, 2}};
  hung["meeting room"] = {{kWhiteboard, 1, 1}, {kPicture, 0, 1}};
  hung["kitchen"] = {{kPicture, 0, 1}};
  hung["lounge"] = {{kLargePicture, 1, 2}};
  hung["library"] = {{kPicture, 0, 1}};
  hung["living room"] = {{kLargePicture, 1, 2}};
  hung["bedroom"] = {{kPicture, 1, 1}};
  hung["study"] = {{kWhiteboard, 0, 1}, {kPicture, 0, 1}};
  hung["open office"] = {{kWhiteboard, 2, 2}, {kLargePicture, 1, 2}};
  hung["lobby"] = {{kLargePicture, 3, 4}};
  return hung;
}

}  // namespace

const std::vector<GroupCount>& FurnitureOf(std::string_view room_class) {
  static const auto furniture = MakeFurniture();
  const auto found = furniture.find(room_class);
  DSG_CHECK(found != furniture.end());
  return found->second;
}

const std::vector<HungCount>& HungOf(std::string_view room_class) {
  static const auto hung = MakeHung();
  static const std::vector<HungCount> bare;
  const auto found = hung.find(room_class);
  return found == hung.end() ? bare : found->second;
}

const std::vector<LooseItem>& LooseItems() {
  static const std::vector<LooseItem> items = {
      {"bottle", "desk", 0.25, 0.07, 0.07, 0.25},       {"bottle", "table", 0.5, 0.07, 0.07, 0.25},
      {"bottle", "counter", 0.5, 0.07, 0.07, 0.25},     {"phone", "desk", 0.3, 0.08, 0.16, 0.02},
      {"phone", "coffee table", 0.4, 0.08, 0.16, 0.02},
  };
  return items;
}

}  // namespace dsg::simulator
