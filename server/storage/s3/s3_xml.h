// Reading of the small XML answers of S3. Stateless.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// Returns the text of the first element with this name, without its entities; empty if there is
// none.
std::string XmlText(std::string_view xml, std::string_view name);
// Returns the contents of all elements with this name, which must not contain each other.
std::vector<std::string_view> XmlElements(std::string_view xml, std::string_view name);
// Replaces the characters that XML reserves by entities.
std::string XmlEscape(std::string_view text);

}  // namespace color3d
