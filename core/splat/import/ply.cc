#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "core/splat/import/read_support.h"

namespace color3d {
namespace {

constexpr size_t kMaxHeaderBytes = 1 << 16;

template <class Number>
float ReadNumber(const char* from) {
  Number number;
  std::memcpy(&number, from, sizeof(number));
  return static_cast<float>(number);
}

struct Type {
  size_t bytes;
  float (*read)(const char* from);
};

template <class Number>
constexpr Type kType{sizeof(Number), ReadNumber<Number>};

// Returns nullptr for an unknown type.
const Type* FindType(const std::string& name) {
  static const std::map<std::string, Type> types = {{"char", kType<int8_t>},
                                                    {"int8", kType<int8_t>},
                                                    {"uchar", kType<uint8_t>},
                                                    {"uint8", kType<uint8_t>},
                                                    {"short", kType<int16_t>},
                                                    {"int16", kType<int16_t>},
                                                    {"ushort", kType<uint16_t>},
                                                    {"uint16", kType<uint16_t>},
                                                    {"int", kType<int32_t>},
                                                    {"int32", kType<int32_t>},
                                                    {"uint", kType<uint32_t>},
                                                    {"uint32", kType<uint32_t>},
                                                    {"float", kType<float>},
                                                    {"float32", kType<float>},
                                                    {"double", kType<double>},
                                                    {"float64", kType<double>}};
  const auto found = types.find(name);
  return found == types.end() ? nullptr : &found->second;
}

struct Property {
  size_t offset = 0;  // in a row, bytes
  const Type* type = nullptr;
};

struct Header {
  size_t body = 0;  // offset of the rows
  uint64_t count = 0;
  size_t stride = 0;
  std::map<std::string, Property> properties;  // of the vertices
  bool has_faces = false;
};

class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, const SplatSource& source) : source_(source) {
    const std::string_view begin = bytes.substr(0, kMaxHeaderBytes);
    const size_t end = begin.find("\nend_header");
    const size_t newline = end == begin.npos ? end : begin.find('\n', end + 1);
    if (newline == begin.npos) {
      throw InvalidArgument(
          "the PLY header of {} has no end: the file was cut short; copy it again", source.name);
    }
    header_.body = newline + 1;
    std::istringstream lines{std::string(begin.substr(0, end + 1))};
    for (std::string line; std::getline(lines, line);) {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      ReadLine(line);
    }
  }

  Header Take() {
    if (!saw_vertices_) {
      throw InvalidArgument("{} is a PLY without vertices, that is without Gaussians",
                            source_.name);
    }
    return std::move(header_);
  }

 private:
  void ReadLine(const std::string& line) {
    std::istringstream words(line);
    std::string word, name, number;
    words >> word;
    if (word == "format") {
      words >> name;
      if (name != "binary_little_endian") {
        throw InvalidArgument(
            "{} is a PLY in the format {}; save it as binary_little_endian", source_.name, name);
      }
    } else if (word == "element") {
      words >> name >> number;
      BeginElement(name, number);
    } else if (word == "property") {
      words >> name;
      std::string type = name;
      words >> name;
      AddProperty(type, name);
    }
  }

  void BeginElement(const std::string& name, const std::string& number) {
    uint64_t count = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), count);
    if (error != std::errc() || end != number.data() + number.size()) {
      throw InvalidArgument(
          "{} claims to have '{}' of {}: its PLY header is damaged", source_.name, number, name);
    }
    in_vertices_ = name == "vertex" && !saw_vertices_;
    header_.has_faces = header_.has_faces || name == "face";
    if (!in_vertices_) {
      // Elements before the Gaussians cannot be skipped.
      if (!saw_vertices_ && count > 0) {
        throw InvalidArgument(
            "{} begins with {}, as SuperSplat's compressed PLY does; save it uncompressed "
            "(splat-transform in.ply out.ply), or as .sog or .spz",
            source_.name,
            name);
      }
      return;
    }
    saw_vertices_ = true;
    header_.count = count;
  }

  void AddProperty(const std::string& type, const std::string& name) {
    if (!in_vertices_) return;
    const Type* found = FindType(type);
    if (found == nullptr) {
      throw InvalidArgument(
          "{} is not a 3DGS PLY: its vertices have the property '{} {}'", source_.name, type, name);
    }
    header_.properties[name] = {header_.stride, found};
    header_.stride += found->bytes;
  }

  const SplatSource& source_;
  Header header_;
  bool in_vertices_ = false;
  bool saw_vertices_ = false;
};

class PlyReader {
 public:
  PlyReader(std::string_view bytes, const SplatSource& source)
      : source_(source), header_(HeaderReader(bytes, source).Take()), rows_(bytes) {
    RequireGaussians();
    rows_.remove_prefix(std::min(header_.body, rows_.size()));
    const uint64_t whole = rows_.size() / header_.stride;
    if (whole < header_.count) {
      throw InvalidArgument("{} ends after {} of its {} Gaussians: it was cut short; copy it again",
                            source.name,
                            whole,
                            header_.count);
    }
    CheckCount(header_.count, source);
  }

  ViewerGaussians Read() const {
    const int rest = Rest();
    int degree = 0;
    while (degree < 3 && ShCoefficients(degree) - 1 < rest) ++degree;
    ViewerGaussians g = EmptyGaussians(header_.count, degree);
    const size_t row = 3 * (static_cast<size_t>(rest) + 1);
    for (int k = 0; k < 3; ++k) {
      Copy(std::string(1, static_cast<char>('x' + k)), 3, k, &g.position);
      Copy(fmt::format("scale_{}", k), 3, k, &g.log_scale);
      if (Has("f_dc_0")) {
        Copy(fmt::format("f_dc_{}", k), row, k, &g.sh);
      } else {
        static constexpr const char* kNames[] = {"red", "green", "blue"};
        Copy(kNames[k], row, k, &g.sh);
        for (size_t i = k; i < g.sh.size(); i += row) g.sh[i] = (g.sh[i] / 255.0f - 0.5f) / kShDc;
      }
      for (int j = 0; j < rest; ++j) {
        Copy(fmt::format("f_rest_{}", k * rest + j), row, 3 * (j + 1) + k, &g.sh);
      }
    }
    for (int k = 0; k < 4; ++k) Copy(fmt::format("rot_{}", k), 4, k, &g.rotation);
    Copy("opacity", 1, 0, &g.opacity_logit);
    return g;
  }

 private:
  bool Has(const std::string& name) const { return header_.properties.contains(name); }
  bool HasByteColors() const {
    const auto red = header_.properties.find("red");
    return red != header_.properties.end() && red->second.type->read == ReadNumber<uint8_t> &&
           Has("green") && Has("blue");
  }

  // Coefficients above degree 0 of each channel.
  int Rest() const {
    int rest = 0;
    while (Has(fmt::format("f_rest_{}", rest))) ++rest;
    for (int degree = 0; degree <= 3; ++degree) {
      if (rest == 3 * (ShCoefficients(degree) - 1)) return rest / 3;
    }
    throw InvalidArgument(
        "{} has {} properties f_rest_*; spherical harmonics of degree 0 to 3 have 0, 9, 24 or 45",
        source_.name,
        rest);
  }

  void RequireGaussians() const {
    if (Has("packed_position")) {
      throw InvalidArgument(
          "{} is SuperSplat's compressed PLY; save it uncompressed (splat-transform in.ply "
          "out.ply), or as .sog or .spz",
          source_.name);
    }
    std::string missing;
    for (const char* name : {"x",
                             "y",
                             "z",
                             "scale_0",
                             "scale_1",
                             "scale_2",
                             "rot_0",
                             "rot_1",
                             "rot_2",
                             "rot_3",
                             "opacity"}) {
      if (missing.empty() && !Has(name)) missing = name;
    }
    if (missing.empty() && !HasByteColors()) {
      for (const char* name : {"f_dc_0", "f_dc_1", "f_dc_2"}) {
        if (missing.empty() && !Has(name)) missing = name;
      }
    }
    if (missing.empty()) return;
    throw InvalidArgument(
        "{} is {}: its vertices have no {}. Give a PLY trained by 3D Gaussian splatting",
        source_.name,
        header_.has_faces ? "the PLY of a mesh, not of a splat"
        : Has("scale_0")  ? "an incomplete 3DGS PLY"
                          : "the PLY of a point cloud, not of a splat",
        missing);
  }

  void Copy(const std::string& name, size_t width, size_t k, std::vector<float>* to) const {
    const Property& property = header_.properties.at(name);
    const char* from = rows_.data() + property.offset;
    for (uint64_t i = 0; i < header_.count; ++i, from += header_.stride) {
      (*to)[i * width + k] = property.type->read(from);
    }
  }

  const SplatSource& source_;
  const Header header_;
  std::string_view rows_;
};

}  // namespace

ViewerGaussians ReadPly(std::string_view bytes, const SplatSource& source) {
  return PlyReader(bytes, source).Read();
}

}  // namespace color3d
