// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include <cstring>

#include "absl/strings/str_cat.h"
#include "ingest/truth/truth_parts_internal.h"
#include "schema/base/status.h"

namespace dsg::truth {
namespace {

constexpr int kGreyStep = 36;
constexpr int kBitsMax = kCellFree | kCellObserved | kCellDoorBand;

png_image EmptyImage() {
  png_image image;
  std::memset(&image, 0, sizeof(image));
  image.version = PNG_IMAGE_VERSION;
  return image;
}

// Row `y` of the grid is this row of the picture.
size_t PixelRow(const FreeGrid& grid, int y) { return static_cast<size_t>(grid.height - 1 - y); }

}  // namespace

absl::StatusOr<std::string> GridToPng(const FreeGrid& grid) {
  const auto width = static_cast<size_t>(grid.width);
  std::string pixels(grid.cells.size(), '\0');
  for (int y = 0; y < grid.height; ++y) {
    for (size_t x = 0; x < width; ++x) {
      pixels[PixelRow(grid, y) * width + x] =
          static_cast<char>(kGreyStep * grid.cells[static_cast<size_t>(y) * width + x]);
    }
  }
  png_image image = EmptyImage();
  image.width = static_cast<png_uint_32>(grid.width);
  image.height = static_cast<png_uint_32>(grid.height);
  image.format = PNG_FORMAT_GRAY;
  std::string out(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t size = out.size();
  if (png_image_write_to_memory(&image, out.data(), &size, 0, pixels.data(), 0, nullptr) == 0) {
    return absl::InternalError(absl::StrCat("cannot encode the free grid as PNG: ", image.message));
  }
  out.resize(size);
  return out;
}

absl::Status GridFromPng(std::string_view bytes, const std::string& file, FreeGrid* grid) {
  // libpng is content once it has all pixels; we want the end as well.
  constexpr std::string_view kEnd("\0\0\0\0IEND\xae\x42\x60\x82", 12);
  if (bytes.size() < kEnd.size() || bytes.substr(bytes.size() - kEnd.size()) != kEnd) {
    return Malformed(file, "does not end as a PNG does; the file was cut or changed");
  }
  png_image image = EmptyImage();
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) {
    return Malformed(file, absl::StrCat("is no PNG that can be read: ", image.message));
  }
  const bool fits = image.format == PNG_FORMAT_GRAY &&
                    image.width == static_cast<png_uint_32>(grid->width) &&
                    image.height == static_cast<png_uint_32>(grid->height);
  if (!fits) {
    const std::string found = absl::StrCat(image.width, " x ", image.height);
    png_image_free(&image);
    return Malformed(file, absl::StrCat("is not the 8-bit grey picture of ", grid->width, " x ",
                                        grid->height, " that world.json tells of, but ", found));
  }
  const auto width = static_cast<size_t>(grid->width);
  std::string pixels(width * static_cast<size_t>(grid->height), '\0');
  if (png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr) == 0) {
    return Malformed(file, absl::StrCat("cannot be decoded: ", image.message));
  }
  grid->cells.resize(pixels.size());
  for (int y = 0; y < grid->height; ++y) {
    for (size_t x = 0; x < width; ++x) {
      const auto grey = static_cast<uint8_t>(pixels[PixelRow(*grid, y) * width + x]);
      if (grey % kGreyStep != 0 || grey / kGreyStep > kBitsMax) {
        return Malformed(file, absl::StrCat("pixel of cell (", x, ", ", y, ") is ", grey,
                                            ", which is no multiple of 36 up to 252"));
      }
      grid->cells[static_cast<size_t>(y) * width + x] = static_cast<uint8_t>(grey / kGreyStep);
    }
  }
  return absl::OkStatus();
}

}  // namespace dsg::truth
