// SPDX-License-Identifier: Apache-2.0
// SHA-256 of bytes that come piece by piece. Refuses nothing.
#pragma once

#include <memory>
#include <string_view>

#include "schema/model/node.h"

namespace dsg {

class Sha256Stream {
 public:
  Sha256Stream();
  ~Sha256Stream();
  Sha256Stream(Sha256Stream&&) noexcept;
  Sha256Stream& operator=(Sha256Stream&&) noexcept;

  void Add(std::string_view bytes);
  /// Of all that was added. The last call.
  Sha256 Finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace dsg
