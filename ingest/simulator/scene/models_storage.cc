// SPDX-License-Identifier: Apache-2.0
// Shelves, bins, boxes and bags.
#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/simulator/scene/models.h"

namespace dsg::simulator {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr std::array<Color, 4> kBookColors = {
    {{146, 66, 58, 255}, {62, 96, 124, 255}, {176, 150, 96, 255}, {82, 110, 78, 255}}};

// Rows of books of different heights on one board, a gap now and then. The pattern repeats from
// shelf to shelf, which is what furniture of one model may do; textures differ.
void DrawBookRow(Model* m, int board, float z, float rise) {
  const float x = 0.5f * m->width - 0.03f;
  const float y = 0.5f * m->depth;
  float at = -x;
  for (int i = 0; at < x - 0.08f; ++i) {
    const int pick = (7 * board + 5 * i + i * i) % 11;
    const float run = 0.1f + 0.022f * static_cast<float>(pick);
    const float high = rise * (0.55f + 0.035f * static_cast<float>((3 * pick + board) % 11));
    const float deep = 0.35f + 0.05f * static_cast<float>(pick % 5);
    const float end = std::min(at + run, x);
    if (pick != 4) {
      m->Use(Material::kBooks, kBookColors[(pick + board) % 4]);
      m->Box({at, -y + 0.02f, z}, {end - 0.004f, -y + 0.02f + 2.0f * y * deep, z + high});
    }
    at = end;
  }
}

void DrawShelf(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  const int board_count = std::max(2, static_cast<int>(std::lround(m->height / 0.38f)));
  const float step = (m->height - 0.05f) / static_cast<float>(board_count);
  m->Use(Material::kWood, m->color);
  m->Box({-x, -y, 0.0f}, {-x + 0.025f, y, m->height});
  m->Box({x - 0.025f, -y, 0.0f}, {x, y, m->height});
  m->Box({-x, -y, 0.0f}, {x, -y + 0.012f, m->height});
  for (int board = 0; board <= board_count; ++board) {
    const float z = 0.025f + step * static_cast<float>(board);
    m->Use(Material::kWood, m->color);
    m->Box({-x + 0.02f, -y, z}, {x - 0.02f, y - 0.005f, z + 0.025f});
    if (board < board_count) DrawBookRow(m, board, z + 0.025f, step - 0.03f);
  }
}

void DrawBin(Model* m) {
  const float radius = 0.5f * std::min(m->width, m->depth);
  m->Use(Material::kMetal, m->color);
  AddTurned({{0.0f, 0.0f},
             {0.8f * radius, 0.0f},
             {0.97f * radius, 0.94f * m->height},
             {radius, 0.95f * m->height},
             {radius, m->height},
             {0.94f * radius, m->height},
             {0.76f * radius, 0.03f},
             {0.0f, 0.03f}},
            Vector3f::Zero(), Vector2f::Ones(), 16, m->mesh());
  m->Use(Material::kPaper, {222, 220, 212, 255});
  AddCutBox({-0.4f * radius, -0.5f * radius, 0.3f * m->height},
            {0.45f * radius, 0.3f * radius, 0.55f * m->height}, 0.08f, m->mesh());
}

void DrawCarton(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kPaper, {178, 142, 98, 255});
  m->Box({-x, -y, 0.0f}, {x, y, m->height}, 0.004f);
  m->Use(Material::kPlastic, {204, 186, 150, 255});
  m->Box({-x, -0.08f * y, m->height - 0.01f}, {x, 0.08f * y, m->height});
}

void DrawBag(Model* m) {
  const float x = 0.5f * m->width;
  const float y = 0.5f * m->depth;
  m->Use(Material::kFabric, m->color);
  m->Box({-x, -y, 0.0f}, {x, 0.55f * y, 0.9f * m->height}, 0.3f * y);
  m->Box({-0.7f * x, 0.4f * y, 0.05f * m->height}, {0.7f * x, y, 0.5f * m->height}, 0.15f * y);
  m->Use(Material::kFabric, Scaled(m->color, 0.6));
  m->Box({-0.25f * x, -0.3f * y, 0.88f * m->height}, {-0.15f * x, 0.1f * y, m->height});
  m->Box({0.15f * x, -0.3f * y, 0.88f * m->height}, {0.25f * x, 0.1f * y, m->height});
  m->Box({-0.25f * x, -0.3f * y, 0.96f * m->height}, {0.25f * x, 0.1f * y, m->height});
}

}  // namespace

std::span<const ModelMaker> StorageModels() {
  static constexpr ModelMaker kModels[] = {{"shelf", DrawShelf},
                                           {"bin", DrawBin},
                                           {"box", DrawCarton},
                                           {"backpack", DrawBag},
                                           {"bag", DrawBag}};
  return kModels;
}

}  // namespace dsg::simulator
