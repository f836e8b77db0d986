// SPDX-License-Identifier: Apache-2.0
// Attributes as bytes. Names that scene graphs have are a byte, and what is kept of a scene graph
// as JSON is packed, since every node of an imported map has it.
#pragma once

#include <string>

#include "schema/codec/bit_stream.h"
#include "schema/model/node.h"

namespace dsg {

/// In the order of their names, so that equal attributes are equal bytes.
void AppendAttributes(const Attributes& attributes, std::string* out);
/// False for bytes that AppendAttributes cannot have written.
bool ReadAttributes(ByteReader* in, Attributes* attributes);

}  // namespace dsg
