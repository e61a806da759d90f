// Protobuf strings must be valid UTF-8, or clients cannot parse the message; texts of ours may
// quote bytes of files and third-party programs.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace color3d {

// `text` with every byte that is no part of valid UTF-8 replaced by '?', cut to at most `max_bytes`
// without splitting a character.
std::string CleanUtf8(std::string_view text, size_t max_bytes = 16384);

}  // namespace color3d
