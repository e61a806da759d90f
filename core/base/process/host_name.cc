#include "core/base/process/host_name.h"

#include <unistd.h>

#include <array>
#include <cctype>

namespace color3d {

std::string HostName(const std::string& otherwise) {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return otherwise;
  std::string text = name.data();
  std::erase_if(text, [](unsigned char c) { return std::isalnum(c) == 0 && c != '.' && c != '-'; });
  return text.empty() ? otherwise : text;
}

}  // namespace color3d
