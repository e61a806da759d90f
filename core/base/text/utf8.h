// UTF-8 by RFC 3629. Protobuf strings must be valid UTF-8 to be parsed; file names and the output
// of other programs may not be.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace color3d {

bool IsUtf8(std::string_view text);

// Replaces every byte that is not part of valid UTF-8 by '?' and cuts the text to at most
// `max_bytes` without splitting a character.
std::string CleanUtf8(std::string_view text, size_t max_bytes = 16384);

enum class Lines {
  kOne,   // escapes line ends and tabs, too
  kMany,  // keeps line ends and tabs
};

// Makes `text` safe for logs and terminals: valid UTF-8 without characters that end a line, move
// the cursor, change colours or reverse the writing direction. These become "\n", "\t", "\r",
// "\x1b" or "\u202e"; bytes that are not UTF-8 become '?'. Does not shorten the text.
std::string EscapeControls(std::string_view text, Lines lines = Lines::kOne);

}  // namespace color3d
