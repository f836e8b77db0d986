// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/room_kinds.h"

namespace dsg::ingest {
namespace {

constexpr ExpectedThing kOffice[] = {
    {"desk", 2.0}, {"chair", 2.5},      {"computer", 2.0}, {"shelf", 1.0},    {"cabinet", 0.6},
    {"bin", 0.8},  {"whiteboard", 0.5}, {"lamp", 0.5},     {"phone", 0.6},    {"book", 1.5},
    {"cup", 0.8},  {"plant", 0.5},      {"picture", 0.6},  {"printer", 0.15}, {"table", 0.3}};
constexpr ExpectedThing kOpenOffice[] = {
    {"desk", 9.0},  {"chair", 10.0},     {"computer", 8.0}, {"shelf", 2.0}, {"cabinet", 1.5},
    {"bin", 2.0},   {"whiteboard", 1.0}, {"phone", 2.0},    {"book", 3.0},  {"cup", 3.0},
    {"plant", 2.0}, {"picture", 1.0},    {"printer", 0.8},  {"table", 0.8}, {"couch", 0.4}};
constexpr ExpectedThing kMeetingRoom[] = {
    {"table", 1.3},    {"chair", 7.0},   {"whiteboard", 0.9}, {"tv", 0.7},  {"projector", 0.6},
    {"tv stand", 0.4}, {"cabinet", 0.4}, {"computer", 0.5},   {"cup", 0.7}, {"bottle", 0.5},
    {"plant", 0.4},    {"picture", 0.4}, {"bin", 0.3}};
constexpr ExpectedThing kKitchen[] = {
    {"counter", 1.2}, {"fridge", 0.95}, {"microwave", 0.7},  {"coffee machine", 0.6},
    {"stove", 0.7},   {"sink", 0.7},    {"dishwasher", 0.5}, {"table", 0.8},
    {"chair", 3.0},   {"cup", 1.5},     {"bowl", 1.0},       {"bottle", 1.0},
    {"bin", 0.8},     {"cabinet", 1.5}, {"toaster", 0.5},    {"kettle", 0.5},
    {"picture", 0.2}};
constexpr ExpectedThing kLounge[] = {{"couch", 1.8}, {"armchair", 1.0}, {"coffee table", 1.3},
                                     {"tv", 0.5},    {"tv stand", 0.5}, {"plant", 1.4},
                                     {"lamp", 0.8},  {"picture", 1.0},  {"book", 0.8},
                                     {"cup", 0.8},   {"phone", 0.3}};
constexpr ExpectedThing kLivingRoom[] = {{"couch", 1.2}, {"armchair", 0.9}, {"coffee table", 0.9},
                                         {"tv", 0.9},    {"tv stand", 0.9}, {"shelf", 0.9},
                                         {"plant", 0.9}, {"lamp", 1.0},     {"picture", 1.2},
                                         {"book", 2.0},  {"cushion", 1.5},  {"rug", 0.7},
                                         {"phone", 0.3}, {"cup", 0.6},      {"fireplace", 0.2}};
constexpr ExpectedThing kLobby[] = {{"couch", 3.0},   {"armchair", 3.0}, {"coffee table", 2.5},
                                    {"counter", 0.9}, {"plant", 3.5},    {"tv", 0.6},
                                    {"lamp", 1.2},    {"picture", 2.0},  {"bin", 1.0},
                                    {"chair", 1.2},   {"computer", 0.8}, {"book", 1.0}};
constexpr ExpectedThing kLibrary[] = {{"shelf", 4.5},    {"book", 12.0},    {"table", 1.0},
                                      {"chair", 3.0},    {"armchair", 1.0}, {"lamp", 1.0},
                                      {"computer", 0.3}, {"picture", 0.3}};
constexpr ExpectedThing kCopyRoom[] = {{"printer", 1.7}, {"cabinet", 1.0}, {"bin", 0.9},
                                       {"shelf", 0.4},   {"table", 0.3},   {"box", 0.7}};
constexpr ExpectedThing kStorageRoom[] = {
    {"shelf", 3.0}, {"cabinet", 1.0}, {"box", 4.0}, {"ladder", 0.2}};
constexpr ExpectedThing kRestroom[] = {{"toilet", 1.9}, {"sink", 1.9},   {"bin", 0.8},
                                       {"mirror", 1.0}, {"urinal", 0.5}, {"towel", 0.4}};
constexpr ExpectedThing kBathroom[] = {{"toilet", 0.9}, {"sink", 1.0},    {"bathtub", 0.7},
                                       {"shower", 0.5}, {"mirror", 0.8},  {"towel", 1.2},
                                       {"bin", 0.3},    {"cabinet", 0.4}, {"washing machine", 0.3}};
constexpr ExpectedThing kBedroom[] = {
    {"bed", 1.2},     {"wardrobe", 0.9}, {"nightstand", 1.2}, {"dresser", 0.5}, {"lamp", 0.8},
    {"desk", 0.35},   {"chair", 0.5},    {"computer", 0.3},   {"book", 0.8},    {"picture", 0.8},
    {"cushion", 1.5}, {"mirror", 0.4},   {"rug", 0.4}};
constexpr ExpectedThing kStudy[] = {{"desk", 1.0},    {"chair", 1.0},    {"computer", 0.9},
                                    {"shelf", 1.6},   {"armchair", 0.7}, {"book", 4.0},
                                    {"lamp", 0.7},    {"cup", 0.4},      {"whiteboard", 0.3},
                                    {"picture", 0.4}, {"phone", 0.2}};
constexpr ExpectedThing kDiningRoom[] = {{"table", 1.1}, {"chair", 5.0},   {"cabinet", 0.7},
                                         {"bowl", 0.8},  {"picture", 0.7}, {"lamp", 0.4},
                                         {"plant", 0.4}};
constexpr ExpectedThing kCorridor[] = {
    {"plant", 1.2}, {"bin", 0.8}, {"picture", 1.5}, {"printer", 0.1}};
constexpr ExpectedThing kHallway[] = {{"plant", 0.7}, {"picture", 1.0}, {"coat rack", 0.5},
                                      {"shoe", 1.0},  {"mirror", 0.4},  {"rug", 0.4}};

constexpr RoomKind kKinds[] = {
    {"office", 2.0, kOffice},
    {"open office", 0.6, kOpenOffice},
    {"meeting room", 1.0, kMeetingRoom},
    {"kitchen", 1.0, kKitchen},
    {"lounge", 0.6, kLounge},
    {"living room", 1.0, kLivingRoom},
    {"lobby", 0.4, kLobby},
    {"library", 0.4, kLibrary},
    {"copy room", 0.4, kCopyRoom},
    {"storage room", 0.6, kStorageRoom},
    {"restroom", 0.7, kRestroom},
    {"bathroom", 1.0, kBathroom},
    {"bedroom", 1.0, kBedroom},
    {"study", 0.5, kStudy},
    {"dining room", 0.5, kDiningRoom},
    {"corridor", 1.0, kCorridor},
    {"hallway", 0.6, kHallway},
};

struct Synonym {
  const char* name;
  const char* canonical;
};

constexpr Synonym kSynonyms[] = {{"sofa", "couch"},
                                 {"settee", "couch"},
                                 {"refrigerator", "fridge"},
                                 {"refridgerator", "fridge"},
                                 {"freezer", "fridge"},
                                 {"office chair", "chair"},
                                 {"stool", "chair"},
                                 {"dining chair", "chair"},
                                 {"swivel chair", "chair"},
                                 {"bench", "chair"},
                                 {"bookshelf", "shelf"},
                                 {"bookcase", "shelf"},
                                 {"shelves", "shelf"},
                                 {"shelving", "shelf"},
                                 {"books", "book"},
                                 {"laptop", "computer"},
                                 {"monitor", "computer"},
                                 {"keyboard", "computer"},
                                 {"screen", "computer"},
                                 {"pc", "computer"},
                                 {"television", "tv"},
                                 {"tv monitor", "tv"},
                                 {"tvmonitor", "tv"},
                                 {"washbasin", "sink"},
                                 {"basin", "sink"},
                                 {"tub", "bathtub"},
                                 {"bath", "bathtub"},
                                 {"night stand", "nightstand"},
                                 {"bedside table", "nightstand"},
                                 {"closet", "wardrobe"},
                                 {"chest of drawers", "dresser"},
                                 {"potted plant", "plant"},
                                 {"houseplant", "plant"},
                                 {"trashcan", "bin"},
                                 {"trash can", "bin"},
                                 {"garbage bin", "bin"},
                                 {"wastebasket", "bin"},
                                 {"painting", "picture"},
                                 {"poster", "picture"},
                                 {"photocopier", "printer"},
                                 {"copier", "printer"},
                                 {"mug", "cup"},
                                 {"glass of water", "cup"},
                                 {"cupboard", "cabinet"},
                                 {"locker", "cabinet"},
                                 {"filing cabinet", "cabinet"},
                                 {"kitchen counter", "counter"},
                                 {"countertop", "counter"},
                                 {"reception desk", "counter"},
                                 {"oven", "stove"},
                                 {"cooker", "stove"},
                                 {"coffee maker", "coffee machine"},
                                 {"telephone", "phone"},
                                 {"cell phone", "phone"},
                                 {"dining table", "table"},
                                 {"conference table", "table"},
                                 {"meeting table", "table"},
                                 {"floor lamp", "lamp"},
                                 {"table lamp", "lamp"},
                                 {"pillow", "cushion"},
                                 {"carpet", "rug"},
                                 {"floor mat", "rug"},
                                 {"cardboard box", "box"},
                                 {"white board", "whiteboard"},
                                 {"blackboard", "whiteboard"},
                                 {"tv bench", "tv stand"},
                                 {"easy chair", "armchair"},
                                 {"couch table", "coffee table"},
                                 {"shower curtain", "shower"}};

}  // namespace

std::span<const RoomKind> RoomKinds() { return kKinds; }

std::string_view CommonNameOf(std::string_view name) {
  for (const Synonym& synonym : kSynonyms) {
    if (name == synonym.name) return synonym.canonical;
  }
  return name;
}

}  // namespace dsg::ingest
