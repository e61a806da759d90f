#include "core/base/equal_files.h"

#include <cstddef>
#include <fstream>
#include <string_view>
#include <vector>

namespace color3d {
namespace fs = std::filesystem;

bool HaveEqualBytes(const fs::path& one, const fs::path& other) {
  std::error_code error;
  if (!fs::is_regular_file(one, error) || !fs::is_regular_file(other, error)) return false;
  if (fs::file_size(one, error) != fs::file_size(other, error) || error) return false;
  constexpr size_t kPieceBytes = size_t{1} << 18;
  std::vector<char> of_one(kPieceBytes), of_other(kPieceBytes);
  std::ifstream from_one(one, std::ios::binary), from_other(other, std::ios::binary);
  while (from_one && from_other) {
    from_one.read(of_one.data(), kPieceBytes);
    from_other.read(of_other.data(), kPieceBytes);
    const auto size = static_cast<size_t>(from_one.gcount());
    if (from_one.bad() || from_other.bad() || from_other.gcount() != from_one.gcount() ||
        std::string_view(of_one.data(), size) != std::string_view(of_other.data(), size)) {
      return false;
    }
  }
  return from_one.eof() && from_other.eof();
}

}  // namespace color3d
