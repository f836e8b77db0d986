# SPDX-License-Identifier: Apache-2.0
# cmake -DOUT=FILE.cc -DFOLDER=DIR -DFILES=NAME,NAME... -P embed.cmake
#
# Writes the files as the string literals of server/http/web_files.h: a literal compiles twenty
# times as fast as an array of bytes. The files are text, without )~~~" in them.
set(types_html "text/html; charset=utf-8")
set(types_css "text/css; charset=utf-8")
set(types_js "text/javascript; charset=utf-8")
set(types_svg "image/svg+xml")

set(entries)
string(REPLACE "," ";" names "${FILES}")
foreach(name ${names})
  string(REGEX REPLACE ".*\\." "" ending ${name})
  if(NOT DEFINED types_${ending})
    message(FATAL_ERROR "${name}: no type is known for .${ending}; add it to embed.cmake")
  endif()
  file(READ ${FOLDER}/${name} bytes)
  file(SHA256 ${FOLDER}/${name} digest)
  string(SUBSTRING ${digest} 0 16 digest)
  string(APPEND entries "    {\"/${name}\", \"${types_${ending}}\", \"\\\"${digest}\\\"\",\n"
    "     R\"~~~(${bytes})~~~\"},\n")
endforeach()
file(WRITE ${OUT} "// SPDX-License-Identifier: Apache-2.0
// Generated from server/web by server/web/embed.cmake; edit those.
#include \"server/http/web_files.h\"

namespace dsg::server {
namespace {

constexpr WebFile kWebFiles[] = {
${entries}};

}  // namespace

const WebFile* FindWebFile(std::string_view path) {
  if (path == \"/\") path = \"/index.html\";
  for (const WebFile& file : kWebFiles) {
    if (file.path == path) return &file;
  }
  return nullptr;
}

}  // namespace dsg::server
")
