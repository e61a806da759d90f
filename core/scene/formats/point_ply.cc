#include "core/scene/formats/point_ply.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr size_t kMaxHeaderBytes = 1 << 16;
constexpr std::string_view kBlanks = " \t\r";
static_assert(std::endian::native == std::endian::little);

enum class Format { kAscii, kLittleEndian, kBigEndian };

struct Type {
  std::string_view name, other_name;
  size_t bytes;
  double (*read)(const char*);
};

template <typename T>
double ReadAs(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

constexpr Type kTypes[] = {{"char", "int8", 1, &ReadAs<int8_t>},
                           {"uchar", "uint8", 1, &ReadAs<uint8_t>},
                           {"short", "int16", 2, &ReadAs<int16_t>},
                           {"ushort", "uint16", 2, &ReadAs<uint16_t>},
                           {"int", "int32", 4, &ReadAs<int32_t>},
                           {"uint", "uint32", 4, &ReadAs<uint32_t>},
                           {"float", "float32", 4, &ReadAs<float>},
                           {"double", "float64", 8, &ReadAs<double>}};

// Removes and returns the next word of a line; empty at its end.
std::string_view TakeWord(std::string_view* line) {
  line->remove_prefix(std::min(line->find_first_not_of(kBlanks), line->size()));
  const std::string_view word =
      line->substr(0, std::min(line->find_first_of(kBlanks), line->size()));
  line->remove_prefix(word.size());
  return word;
}

// Returns the next line, without its end; nullopt at the end of the text.
std::optional<std::string_view> TakeLine(std::string_view* text) {
  if (text->empty()) return std::nullopt;
  const size_t end = std::min(text->find('\n'), text->size());
  const std::string_view line = text->substr(0, end);
  text->remove_prefix(std::min(end + 1, text->size()));
  return line;
}

struct Property {
  const Type* type = nullptr;
  size_t offset = 0;  // bytes from the start of a row
};

class PlyPoints {
 public:
  PlyPoints(std::string_view bytes, const std::string& name) : name_(name), rest_(bytes) {
    ReadHeader();
    for (const int axis : axes_) {
      if (axis < 0) throw Wrong("has no vertices with x, y and z");
    }
  }

  std::vector<Eigen::Vector3d> Read(size_t most) {
    const uint64_t step = most == 0 ? 1 : (count_ + most - 1) / most;
    std::vector<Eigen::Vector3d> points;
    if (format_ != Format::kAscii && (stride_ == 0 || count_ > rest_.size() / stride_)) {
      throw Wrong("is cut short; copy it again");
    }
    for (uint64_t i = 0; i < count_; ++i) {
      const bool wanted = i % std::max<uint64_t>(step, 1) == 0;
      const Eigen::Vector3d point = format_ == Format::kAscii ? AsciiRow(wanted) : BinaryRow(i);
      if (wanted && point.allFinite()) points.push_back(point);
    }
    return points;
  }

 private:
  Error Wrong(const char* what) const { return InvalidArgument("{} {}", name_, what); }

  void ReadHeader() {
    const std::optional<std::string_view> magic = TakeLine(&rest_);
    std::string_view first = magic.value_or("");
    if (TakeWord(&first) != "ply") throw Wrong("is no PLY file");
    const size_t begin = rest_.size();
    for (;;) {
      std::optional<std::string_view> line = TakeLine(&rest_);
      if (!line || begin - rest_.size() > kMaxHeaderBytes) {
        throw Wrong("has no end of a PLY header; it was cut short: copy it again");
      }
      const std::string_view word = TakeWord(&*line);
      if (word == "end_header") return;
      if (word == "format") SetFormat(TakeWord(&*line));
      if (word == "element") BeginElement(*line);
      if (word == "property") AddProperty(*line);
    }
  }

  void SetFormat(std::string_view format) {
    if (format == "ascii") {
      format_ = Format::kAscii;
    } else if (format == "binary_little_endian") {
      format_ = Format::kLittleEndian;
    } else if (format == "binary_big_endian") {
      format_ = Format::kBigEndian;
    } else {
      throw Wrong("is a PLY in a format that is not known");
    }
  }

  void BeginElement(std::string_view line) {
    const std::string_view element = TakeWord(&line), number = TakeWord(&line);
    uint64_t count = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), count);
    if (error != std::errc() || end != number.data() + number.size()) {
      throw Wrong("has a damaged PLY header");
    }
    in_vertices_ = element == "vertex" && !saw_vertices_;
    if (!in_vertices_ && !saw_vertices_ && count > 0) throw Wrong("does not begin with vertices");
    saw_vertices_ = saw_vertices_ || in_vertices_;
    if (in_vertices_) count_ = count;
  }

  void AddProperty(std::string_view line) {
    if (!in_vertices_) return;
    const std::string_view type_name = TakeWord(&line), name = TakeWord(&line);
    const Type* type = std::ranges::find_if(
        kTypes, [&](const Type& t) { return t.name == type_name || t.other_name == type_name; });
    if (type == std::end(kTypes)) throw Wrong("has vertices with lists, which are not read");
    for (size_t axis = 0; axis < 3; ++axis) {
      if (name.size() == 1 && name[0] == "xyz"[axis]) axes_[axis] = static_cast<int>(row_.size());
    }
    row_.push_back({type, stride_});
    stride_ += type->bytes;
  }

  Eigen::Vector3d AsciiRow(bool wanted) {
    std::optional<std::string_view> line;
    do {
      line = TakeLine(&rest_);
      if (!line) throw Wrong("is cut short; copy it again");
    } while (line->find_first_not_of(kBlanks) == line->npos);
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    for (int k = 0; wanted && k < static_cast<int>(row_.size()); ++k) {
      const std::string_view word = TakeWord(&*line);
      for (int axis = 0; axis < 3; ++axis) {
        if (axes_[axis] == k) point[axis] = Number(word);
      }
    }
    return point;
  }

  // A word that is no number becomes NaN, so that the point is left out.
  static double Number(std::string_view word) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    const bool good = error == std::errc() && end == word.data() + word.size() && !word.empty();
    return good ? value : std::numeric_limits<double>::quiet_NaN();
  }

  Eigen::Vector3d BinaryRow(uint64_t index) const {
    const char* row = rest_.data() + index * stride_;
    Eigen::Vector3d point;
    for (int axis = 0; axis < 3; ++axis) {
      const Property& property = row_[static_cast<size_t>(axes_[axis])];
      char bytes[8];
      std::memcpy(bytes, row + property.offset, property.type->bytes);
      if (format_ == Format::kBigEndian) std::reverse(bytes, bytes + property.type->bytes);
      point[axis] = property.type->read(bytes);
    }
    return point;
  }

  const std::string& name_;
  std::string_view rest_;
  Format format_ = Format::kAscii;
  bool in_vertices_ = false;
  bool saw_vertices_ = false;
  uint64_t count_ = 0;
  size_t stride_ = 0;
  std::vector<Property> row_;
  int axes_[3] = {-1, -1, -1};  // indices of properties
};

}  // namespace

std::vector<Eigen::Vector3d> ReadPointPly(std::string_view bytes,
                                          const std::string& file_name,
                                          size_t most) {
  return PlyPoints(bytes, file_name).Read(most);
}

}  // namespace color3d
