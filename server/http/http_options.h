// SPDX-License-Identifier: Apache-2.0
// What the user says of the HTTP port.
#pragma once

#include <string>
#include <vector>

namespace dsg::server {

struct HttpOptions {
  /// "HOST:PORT" or "unix:PATH"; empty for no HTTP port.
  std::string listen;
  /// Names that clients may call the server by, beside its own: "maps.example.org", on the port
  /// listened on or none, or "maps.example.org:8443". Ports cannot be told from each other behind
  /// a unix socket, where any name goes.
  std::vector<std::string> hosts;
  /// Takes calls that change maps, too.
  bool may_write = false;
  /// Answers whoever reaches the port. A unix socket, which its user alone can open, asks for no
  /// token anyway.
  bool without_token = false;
};

}  // namespace dsg::server
