// UTF-8 by RFC 3629. Protobuf strings must be valid, or nobody can parse the message; file names
// and the output of other programs need not be.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace color3d {

bool IsUtf8(std::string_view text);

// `text` with every byte that is no part of valid UTF-8 replaced by '?', cut to at most `max_bytes`
// without splitting a character.
std::string CleanUtf8(std::string_view text, size_t max_bytes = 16384);

}  // namespace color3d
