#include "core/scene/formats/npy.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>

#include "core/base/error.h"

namespace color3d {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr size_t kMaxDimensions = 8;

// Returns the text after `key` in the header's dictionary; empty if it is missing.
std::string_view After(std::string_view header, std::string_view key) {
  const size_t at = header.find(key);
  if (at == std::string_view::npos) return {};
  header.remove_prefix(at + key.size());
  header.remove_prefix(std::min(header.size(), header.find_first_not_of(": ")));
  return header;
}

// Parses e.g. "(3, 17)"; nullopt if malformed.
std::optional<std::vector<size_t>> ShapeOf(std::string_view text, size_t max_values) {
  if (text.empty() || text[0] != '(') return std::nullopt;
  const size_t end = text.find(')');
  if (end == std::string_view::npos) return std::nullopt;
  std::vector<size_t> shape;
  size_t number = 0;
  bool in_number = false;
  for (const char c : text.substr(1, end)) {
    if (c >= '0' && c <= '9') {
      number = 10 * number + static_cast<size_t>(c - '0');
      in_number = true;
      if (number > max_values) return std::nullopt;
    } else if (c == ',' || c == ')') {
      if (in_number) shape.push_back(number);
      number = 0;
      in_number = false;
    } else if (c != ' ') {
      return std::nullopt;
    }
  }
  if (shape.size() > kMaxDimensions) return std::nullopt;
  return shape;
}

template <typename T>
std::vector<double> Numbers(std::string_view bytes, size_t count) {
  std::vector<double> values(count);
  for (size_t i = 0; i < count; ++i) {
    T value;
    std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
    values[i] = static_cast<double>(value);
  }
  return values;
}

std::vector<double> ToRowMajor(const std::vector<double>& fortran,
                               const std::vector<size_t>& shape) {
  std::vector<double> values(fortran.size());
  std::vector<size_t> at(shape.size(), 0);
  for (const double value : fortran) {
    size_t index = 0;
    for (size_t d = 0; d < shape.size(); ++d) index = index * shape[d] + at[d];
    values[index] = value;
    for (size_t d = 0; d < shape.size() && ++at[d] == shape[d]; ++d) at[d] = 0;
  }
  return values;
}

}  // namespace

NpyArray ReadNpy(std::string_view bytes, const std::string& file_name, size_t max_values) {
  const auto wrong = [&](const char* what) { return InvalidArgument("{} {}", file_name, what); };
  if (bytes.size() < 12 || !bytes.starts_with(kMagic)) throw wrong("is no .npy file of NumPy");
  const auto byte = [&](size_t i) { return static_cast<size_t>(static_cast<uint8_t>(bytes[i])); };
  const bool old = byte(6) == 1;
  const size_t begin = old ? 10 : 12;
  size_t length = byte(8) | byte(9) << 8;
  if (!old) length |= byte(10) << 16 | byte(11) << 24;
  if (length > bytes.size() - begin) throw wrong("is cut short");
  const std::string_view header = bytes.substr(begin, length);
  const std::string_view data = bytes.substr(begin + length);
  const auto shape = ShapeOf(After(header, "'shape'"), max_values);
  if (!shape) throw wrong("has a shape that cannot be read, or too many numbers");
  NpyArray array{*shape, {}};
  size_t count = 1;
  for (const size_t side : array.shape) {
    if (side != 0 && count > max_values / side) throw wrong("has too many numbers");
    count *= side;
  }
  const std::string_view type = After(header, "'descr'").substr(0, 5);
  const bool is_short = type == "'<f4'" || type == "'<i4'";
  if (!is_short && type != "'<f8'" && type != "'<i8'") {
    throw wrong("must hold float32, float64, int32 or int64, little-endian");
  }
  if (data.size() < count * (is_short ? 4 : 8)) throw wrong("is cut short");
  array.values = type == "'<f4'"   ? Numbers<float>(data, count)
                 : type == "'<f8'" ? Numbers<double>(data, count)
                 : type == "'<i4'" ? Numbers<int32_t>(data, count)
                                   : Numbers<int64_t>(data, count);
  for (const double value : array.values) {
    if (!std::isfinite(value)) throw wrong("holds a number that is not finite");
  }
  if (After(header, "'fortran_order'").starts_with("True")) {
    array.values = ToRowMajor(array.values, array.shape);
  }
  return array;
}

}  // namespace color3d
