// SPDX-License-Identifier: Apache-2.0
#include "schema/picture/font.h"

#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <mutex>

#include "absl/container/flat_hash_map.h"
#include "schema/base/utf8.h"

namespace dsg::picture {

// DejaVu Sans, put into the program by embed_font.cmake.
extern const unsigned char kFontFile[];
extern const long kFontFileBytes;

namespace {

// Of the letters' sizes, em = 1: DejaVu Sans' capitals.
constexpr double kCapHeight = 1493.0 / 2048.0;
// FreeType counts in parts of a pixel.
constexpr double kParts = 64.0;
// Letters that are kept drawn; a picture has some hundred.
constexpr size_t kKeptMax = 4096;

// The face, which one thread at a time may use.
class Face {
 public:
  static Face& Get() {
    static Face* const face = new Face();
    return *face;
  }

  std::shared_ptr<const Letter> Draw(char32_t code, double cap_height_px) {
    const std::lock_guard lock(mutex_);
    const auto size = static_cast<FT_F26Dot6>(std::lround(cap_height_px / kCapHeight * kParts));
    std::shared_ptr<const Letter>& letter = letters_[{code, size}];
    if (letter == nullptr) {
      if (letters_.size() > kKeptMax) letters_.clear();
      return letters_[{code, size}] = Make(code, size);
    }
    return letter;
  }

 private:
  Face() {
    // The bytes are the program's own: that they are no font can only be a broken build.
    if (FT_Init_FreeType(&library_) != 0 ||
        FT_New_Memory_Face(library_, kFontFile, kFontFileBytes, 0, &face_) != 0) {
      std::abort();
    }
  }

  std::shared_ptr<const Letter> Make(char32_t code, FT_F26Dot6 size) {
    auto letter = std::make_shared<Letter>();
    // A character that the font lacks is its box.
    const FT_UInt index = FT_Get_Char_Index(face_, code);
    if (FT_Set_Char_Size(face_, 0, size, 72, 72) != 0 ||
        FT_Load_Glyph(face_, index, FT_LOAD_NO_HINTING | FT_LOAD_RENDER) != 0) {
      return letter;
    }
    const FT_GlyphSlot slot = face_->glyph;
    letter->advance_px = static_cast<double>(slot->advance.x) / kParts;
    letter->left_px = slot->bitmap_left;
    letter->top_px = slot->bitmap_top;
    letter->width = static_cast<int>(slot->bitmap.width);
    letter->height = static_cast<int>(slot->bitmap.rows);
    for (int y = 0; y < letter->height; ++y) {
      const unsigned char* const row = slot->bitmap.buffer + y * slot->bitmap.pitch;
      letter->coverage.insert(letter->coverage.end(), row, row + letter->width);
    }
    return letter;
  }

  std::mutex mutex_;
  FT_Library library_ = nullptr;
  FT_Face face_ = nullptr;
  absl::flat_hash_map<std::pair<char32_t, FT_F26Dot6>, std::shared_ptr<const Letter>> letters_;
};

}  // namespace

std::vector<std::shared_ptr<const Letter>> LettersOf(std::string_view text, double cap_height_px) {
  std::vector<std::shared_ptr<const Letter>> letters;
  while (!text.empty()) {
    const Utf8Character next = FirstUtf8(text);
    letters.push_back(Face::Get().Draw(next.code, cap_height_px));
    text.remove_prefix(next.size);
  }
  return letters;
}

namespace {

constexpr double kCellPx = 64.0;

int CellCount(double length_px) {
  return std::max(1, static_cast<int>(std::ceil(length_px / kCellPx)));
}

int CellOf(double offset_px, int count) {
  return static_cast<int>(std::clamp(std::floor(offset_px / kCellPx), 0.0, count - 1.0));
}

bool Overlap(const Eigen::AlignedBox2d& a, const Eigen::AlignedBox2d& b) {
  return (a.min().array() < b.max().array()).all() && (b.min().array() < a.max().array()).all();
}

}  // namespace

LabelLayout::LabelLayout(const Eigen::AlignedBox2d& area)
    : area_(area),
      column_count_(CellCount(area.sizes().x())),
      row_count_(CellCount(area.sizes().y())),
      cells_(static_cast<size_t>(column_count_) * static_cast<size_t>(row_count_)) {}

template <class Visit>
void LabelLayout::VisitCells(const Eigen::AlignedBox2d& spot, const Visit& visit) const {
  const Eigen::Vector2d low = spot.min() - area_.min();
  const Eigen::Vector2d high = spot.max() - area_.min();
  for (int y = CellOf(low.y(), row_count_); y <= CellOf(high.y(), row_count_); ++y) {
    for (int x = CellOf(low.x(), column_count_); x <= CellOf(high.x(), column_count_); ++x) {
      visit(static_cast<size_t>(y) * static_cast<size_t>(column_count_) + static_cast<size_t>(x));
    }
  }
}

bool LabelLayout::IsFree(const Eigen::AlignedBox2d& spot) const {
  if (!area_.contains(spot)) return false;
  bool is_free = true;
  VisitCells(spot, [&](size_t cell) {
    is_free = is_free && std::none_of(cells_[cell].begin(), cells_[cell].end(),
                                      [&](size_t other) { return Overlap(spots_[other], spot); });
  });
  return is_free;
}

void LabelLayout::Block(const Eigen::AlignedBox2d& spot) {
  VisitCells(spot, [&](size_t cell) { cells_[cell].push_back(spots_.size()); });
  spots_.push_back(spot);
}

}  // namespace dsg::picture
