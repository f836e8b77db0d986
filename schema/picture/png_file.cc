// SPDX-License-Identifier: Apache-2.0
#include "schema/picture/png_file.h"

#include <png.h>

#include <cstring>

#include "absl/strings/str_cat.h"

namespace dsg::picture {

absl::StatusOr<std::string> EncodePng(const Picture& picture) {
  png_image image;
  std::memset(&image, 0, sizeof(image));
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  std::string out(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t size = out.size();
  if (png_image_write_to_memory(&image, out.data(), &size, 0, picture.rgb.data(), 0, nullptr) ==
      0) {
    return absl::InternalError(absl::StrCat("cannot encode a picture as PNG: ", image.message));
  }
  out.resize(size);
  return out;
}

}  // namespace dsg::picture
