#include "tests/support/formats/viewer_files.h"

#include <webp/decode.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/raster/pipeline.h"
#include "core/splat/raster/raster_camera.h"

namespace color3d {
namespace {

void Require(bool good, const std::string& complaint) {
  if (!good) throw std::runtime_error(complaint);
}

uint32_t Number(std::string_view bytes, size_t at, int width) {
  Require(at + width <= bytes.size(), "the file ends early");
  uint32_t value = 0;
  for (int k = width - 1; k >= 0; --k) value = value << 8u | static_cast<uint8_t>(bytes[at + k]);
  return value;
}

ViewerGaussians Empty(size_t count, int degree) {
  ViewerGaussians g;
  g.sh_degree = degree;
  g.position.resize(3 * count);
  g.log_scale.resize(3 * count);
  g.rotation.resize(4 * count);
  g.opacity_logit.resize(count);
  g.sh.resize(count * ShCoefficients(degree) * 3);
  return g;
}

int DegreeOf(int coefficients) {
  for (int degree = 0; degree <= 3; ++degree) {
    if (ShCoefficients(degree) == coefficients) return degree;
  }
  throw std::runtime_error("no degree of harmonics has so many coefficients");
}

struct Pixels {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgba;
  const uint8_t* At(size_t i) const { return rgba.data() + 4 * i; }
};

Pixels DecodeWebp(const std::string& bytes) {
  Pixels pixels;
  uint8_t* rgba = WebPDecodeRGBA(
      reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(), &pixels.width, &pixels.height);
  Require(rgba != nullptr, "not a WebP picture");
  pixels.rgba.assign(rgba, rgba + 4 * static_cast<size_t>(pixels.width) * pixels.height);
  WebPFree(rgba);
  return pixels;
}

float Logit(float unit) {
  const float inside = std::clamp(unit, 1e-6f, 1.0f - 1e-6f);
  return std::log(inside / (1.0f - inside));
}

}  // namespace

std::map<std::string, std::string> ReadStoredZip(std::string_view bytes) {
  Require(bytes.size() >= 22, "too short for a zip");
  const size_t end = bytes.size() - 22;
  Require(Number(bytes, end, 4) == 0x06054b50, "no end of a zip");
  const uint32_t count = Number(bytes, end + 10, 2);
  size_t at = Number(bytes, end + 16, 4);
  std::map<std::string, std::string> files;
  for (uint32_t i = 0; i < count; ++i) {
    Require(Number(bytes, at, 4) == 0x02014b50, "no central header");
    Require(Number(bytes, at + 10, 2) == 0, "a compressed file");
    const uint32_t crc = Number(bytes, at + 16, 4), size = Number(bytes, at + 24, 4);
    const uint32_t name_size = Number(bytes, at + 28, 2);
    const std::string name(bytes.substr(at + 46, name_size));
    const size_t local = Number(bytes, at + 42, 4);
    Require(Number(bytes, local, 4) == 0x04034b50, "no local header");
    Require(Number(bytes, local + 14, 4) == crc, "two checksums");
    Require(bytes.substr(local + 30, name_size) == name, "two names");
    const std::string content(
        bytes.substr(local + 30 + name_size + Number(bytes, local + 28, 2), size));
    Require(content.size() == size, "the zip ends early");
    const auto* data = reinterpret_cast<const Bytef*>(content.data());
    Require(crc32_z(0, data, content.size()) == crc, "wrong checksum of " + name);
    files[name] = content;
    at += 46 + name_size + Number(bytes, at + 30, 2) + Number(bytes, at + 32, 2);
  }
  Require(at == end, "bytes between the directory and the end");
  return files;
}

ViewerGaussians ReadPly(std::string_view bytes) {
  const size_t body = bytes.find("end_header\n") + 11;
  std::istringstream header{std::string(bytes.substr(0, body))};
  std::map<std::string, size_t> column;
  size_t count = 0;
  for (std::string line; std::getline(header, line);) {
    if (line.rfind("element vertex ", 0) == 0) count = std::stoull(line.substr(15));
    if (line.rfind("property float ", 0) == 0) column.emplace(line.substr(15), column.size());
  }
  Require(bytes.size() == body + 4 * count * column.size(), "not as many bytes as the header says");
  std::vector<float> rows(count * column.size());
  std::memcpy(rows.data(), bytes.data() + body, 4 * rows.size());
  int rest = 0;
  while (column.count("f_rest_" + std::to_string(3 * rest)) > 0) ++rest;
  ViewerGaussians g = Empty(count, DegreeOf(rest + 1));
  const auto copy = [&](const std::string& name, size_t width, size_t k, std::vector<float>* to) {
    const size_t from = column.at(name);
    for (size_t i = 0; i < count; ++i) (*to)[i * width + k] = rows[i * column.size() + from];
  };
  for (int k = 0; k < 3; ++k) {
    copy(std::string(1, static_cast<char>('x' + k)), 3, k, &g.position);
    copy("scale_" + std::to_string(k), 3, k, &g.log_scale);
    copy("f_dc_" + std::to_string(k), 3 * (rest + 1), k, &g.sh);
    for (int j = 0; j < rest; ++j) {
      copy("f_rest_" + std::to_string(k * rest + j), 3 * (rest + 1), 3 * (j + 1) + k, &g.sh);
    }
  }
  for (int k = 0; k < 4; ++k) copy("rot_" + std::to_string(k), 4, k, &g.rotation);
  copy("opacity", 1, 0, &g.opacity_logit);
  return g;
}

ViewerGaussians ReadSog(std::string_view bytes) {
  const std::map<std::string, std::string> files = ReadStoredZip(bytes);
  const auto meta = nlohmann::json::parse(files.at("meta.json"));
  Require(meta.at("version") == 2, "not version 2");
  const size_t count = meta.at("count");
  const auto texture = [&](const char* part, int index) {
    return DecodeWebp(files.at(meta.at(part).at("files").at(index).get<std::string>()));
  };
  const auto levels = [&](const char* part) {
    return meta.at(part).at("codebook").get<std::vector<float>>();
  };
  const int degree = meta.contains("shN") ? meta.at("shN").at("bands").get<int>() : 0;
  const size_t rest = ShCoefficients(degree) - 1;
  ViewerGaussians g = Empty(count, degree);
  const auto low = meta.at("means").at("mins").get<std::vector<double>>();
  const auto high = meta.at("means").at("maxs").get<std::vector<double>>();
  const Pixels lower = texture("means", 0), upper = texture("means", 1);
  const Pixels scales = texture("scales", 0), rotations = texture("quats", 0);
  const Pixels colors = texture("sh0", 0);
  for (const Pixels* pixels : {&lower, &upper, &scales, &rotations, &colors}) {
    Require(pixels->rgba.size() / 4 >= count, "a picture is too small");
  }
  const std::vector<float> scale_levels = levels("scales"), color_levels = levels("sh0");
  for (size_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double unit = (256 * upper.At(i)[k] + lower.At(i)[k]) / 65535.0;
      const double log = low[k] + unit * (high[k] - low[k]);
      g.position[3 * i + k] = static_cast<float>(std::copysign(std::expm1(std::abs(log)), log));
      g.log_scale[3 * i + k] = scale_levels.at(scales.At(i)[k]);
      g.sh[i * (rest + 1) * 3 + k] = color_levels.at(colors.At(i)[k]);
    }
    g.opacity_logit[i] = Logit(colors.At(i)[3] / 255.0f);
    const int largest = rotations.At(i)[3] - 252;
    Require(largest >= 0, "no largest component");
    float left = 1.0f;
    for (int k = 0, next = 0; k < 4; ++k) {
      if (k == largest) continue;
      const float q = (rotations.At(i)[next++] / 255.0f * 2.0f - 1.0f) / std::sqrt(2.0f);
      g.rotation[4 * i + k] = q;
      left -= q * q;
    }
    g.rotation[4 * i + largest] = std::sqrt(std::max(left, 0.0f));
  }
  if (rest == 0) return g;
  const Pixels centroids = texture("shN", 0), labels = texture("shN", 1);
  const std::vector<float> rest_levels = levels("shN");
  Require(centroids.width == static_cast<int>(64 * rest), "centroids are of another width");
  for (size_t i = 0; i < count; ++i) {
    const size_t label = labels.At(i)[0] + 256 * labels.At(i)[1];
    Require(label < meta.at("shN").at("count"), "a label beyond the palette");
    for (size_t j = 0; j < rest; ++j) {
      const size_t x = label % 64 * rest + j, y = label / 64;
      for (int c = 0; c < 3; ++c) {
        g.sh[(i * (rest + 1) + j + 1) * 3 + c] =
            rest_levels.at(centroids.At(y * centroids.width + x)[c]);
      }
    }
  }
  return g;
}

namespace {

std::string Inflate(std::string_view bytes) {
  z_stream stream = {};
  Require(inflateInit2(&stream, 15 + 16) == Z_OK, "zlib");
  std::string plain(bytes.size() * 40 + 1024, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(plain.data());
  stream.avail_out = static_cast<uInt>(plain.size());
  const int code = inflate(&stream, Z_FINISH);
  plain.resize(stream.total_out);
  inflateEnd(&stream);
  Require(code == Z_STREAM_END, "not gzip");
  return plain;
}

// Header of 16 bytes, then all streams, for either version.
std::string PlainSpz(std::string_view bytes) {
  if (Number(bytes, 0, 4) != 0x5053474e) {
    const std::string plain = Inflate(bytes);
    Require(Number(plain, 0, 4) == 0x5053474e && Number(plain, 4, 4) == 2, "not SPZ version 2");
    return plain;
  }
  Require(Number(bytes, 4, 4) == 4, "not SPZ version 4");
  std::string plain(bytes.substr(0, 16));
  const uint32_t streams = Number(bytes, 15, 1), table = Number(bytes, 16, 4);
  size_t at = table + 16 * streams;
  for (uint32_t i = 0; i < streams; ++i) {
    const size_t packed = Number(bytes, table + 16 * i, 4),
                 size = Number(bytes, table + 16 * i + 8, 4);
    std::string part(size, '\0');
    const std::string_view source = bytes.substr(at, packed);
    Require(ZSTD_decompress(part.data(), size, source.data(), source.size()) == size, "zstd");
    plain += part;
    at += packed;
  }
  Require(at == bytes.size(), "bytes behind the last stream");
  return plain;
}

// Of basis function k where y and z change their sign: by its parity in them.
float SignOf(int k) {
  static constexpr float kSigns[16] = {1, -1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};
  return kSigns[k];
}

void ReadSpzRotation(const std::string& plain, size_t at, int version, float* wxyz) {
  std::array<float, 4> q = {};  // x y z w
  unsigned left_out = 3;
  if (version == 2) {
    for (int k = 0; k < 3; ++k) q[k] = static_cast<float>(Number(plain, at + k, 1)) / 127.5f - 1.0f;
  } else {
    uint32_t packed = Number(plain, at, 4);
    left_out = packed >> 30u;
    for (int k = 3; k >= 0; --k) {
      if (static_cast<unsigned>(k) == left_out) continue;
      const auto size = static_cast<float>(packed & 511u) / 511.0f * std::sqrt(0.5f);
      q[k] = (packed & 512u) != 0 ? -size : size;
      packed >>= 10u;
    }
  }
  float squares = 0.0f;
  for (const float x : q) squares += x * x;
  q[left_out] = std::sqrt(std::max(0.0f, 1.0f - squares));
  const float turned[4] = {q[3], q[0], -q[1], -q[2]};
  std::copy_n(turned, 4, wxyz);
}

}  // namespace

ViewerGaussians ReadSpz(std::string_view bytes) {
  const std::string plain = PlainSpz(bytes);
  const auto version = static_cast<int>(Number(plain, 4, 4));
  const size_t count = Number(plain, 8, 4);
  const int degree = static_cast<int>(Number(plain, 12, 1));
  const int fraction = static_cast<int>(Number(plain, 13, 1));
  const int coefficients = ShCoefficients(degree), turn = version == 2 ? 3 : 4;
  const size_t opacity = 16 + 9 * count, color = opacity + count, scale = color + 3 * count;
  const size_t rotation = scale + 3 * count, harmonics = rotation + turn * count;
  Require(plain.size() == harmonics + 3 * count * (coefficients - 1), "another size than it says");
  ViewerGaussians g = Empty(count, degree);
  const auto byte = [&](size_t at) { return static_cast<float>(Number(plain, at, 1)); };
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      const auto fixed = static_cast<int32_t>(Number(plain, 16 + 9 * i + 3 * k, 3) << 8u) >> 8;
      g.position[3 * i + k] = std::ldexp(static_cast<float>(k == 0 ? fixed : -fixed), -fraction);
      g.log_scale[3 * i + k] = byte(scale + 3 * i + k) / 16.0f - 10.0f;
      g.sh[i * coefficients * 3 + k] = (byte(color + 3 * i + k) / 255.0f - 0.5f) / 0.15f;
    }
    g.opacity_logit[i] = Logit(byte(opacity + i) / 255.0f);
    ReadSpzRotation(plain, rotation + turn * i, version, g.rotation.data() + 4 * i);
    for (int k = 1; k < coefficients; ++k) {
      for (int c = 0; c < 3; ++c) {
        const size_t at = harmonics + (i * (coefficients - 1) + k - 1) * 3 + c;
        g.sh[(i * coefficients + k) * 3 + c] = SignOf(k) * (byte(at) - 128.0f) / 128.0f;
      }
    }
  }
  return g;
}

ViewerGaussians ReadGlb(std::string_view bytes) {
  Require(bytes.substr(0, 4) == "glTF" && Number(bytes, 4, 4) == 2, "not glTF 2");
  Require(Number(bytes, 8, 4) == bytes.size(), "another size than it says");
  const size_t json_size = Number(bytes, 12, 4);
  Require(bytes.substr(16, 4) == "JSON" && json_size % 4 == 0, "no JSON");
  const auto root = nlohmann::json::parse(bytes.substr(20, json_size));
  const size_t binary = 20 + json_size + 8;
  Require(Number(bytes, binary - 8, 4) == bytes.size() - binary, "another size of the buffer");
  const auto& primitive = root.at("meshes").at(0).at("primitives").at(0);
  const auto& extension = primitive.at("extensions").at("KHR_gaussian_splatting");
  Require(extension.at("colorSpace") == "srgb_rec709_display", "another colour space");
  Require(extension.at("kernel") == "ellipse", "another kernel");
  const auto floats = [&](const std::string& name) {
    const auto& accessor =
        root.at("accessors").at(primitive.at("attributes").at(name).get<size_t>());
    const auto& view = root.at("bufferViews").at(accessor.at("bufferView").get<size_t>());
    Require(accessor.at("componentType") == 5126, "not floats");
    std::vector<float> values(view.at("byteLength").get<size_t>() / sizeof(float));
    std::memcpy(values.data(),
                bytes.data() + binary + view.at("byteOffset").get<size_t>(),
                values.size() * sizeof(float));
    return values;
  };
  const std::string prefix = "KHR_gaussian_splatting:";
  const std::vector<float> opacity = floats(prefix + "OPACITY"), scale = floats(prefix + "SCALE");
  const std::vector<float> rotation = floats(prefix + "ROTATION");
  int degree = 0;
  while (primitive.at("attributes")
             .contains(prefix + "SH_DEGREE_" + std::to_string(degree + 1) + "_COEF_0")) {
    ++degree;
  }
  ViewerGaussians g = Empty(opacity.size(), degree);
  g.position = floats("POSITION");
  for (size_t i = 0; i < g.log_scale.size(); ++i) g.log_scale[i] = std::log(scale.at(i));
  for (size_t i = 0; i < g.size(); ++i) {
    g.opacity_logit[i] = std::log(opacity[i] / (1.0f - opacity[i]));
    for (int k = 0; k < 4; ++k) g.rotation[4 * i + (k + 1) % 4] = rotation.at(4 * i + k);
  }
  for (int d = 0; d <= degree; ++d) {
    for (int k = 0; k <= 2 * d; ++k) {
      const std::vector<float> values =
          floats(prefix + "SH_DEGREE_" + std::to_string(d) + "_COEF_" + std::to_string(k));
      for (size_t i = 0; i < values.size(); ++i) {
        g.sh[(i / 3 * ShCoefficients(degree) + d * d + k) * 3 + i % 3] = values[i];
      }
    }
  }
  return g;
}

std::vector<size_t> PartnersIn(const ViewerGaussians& file, const ViewerGaussians& original) {
  std::vector<size_t> partners;
  for (size_t i = 0; i < original.size(); ++i) {
    size_t best = 0;
    double least = 1e30;
    for (size_t j = 0; j < file.size(); ++j) {
      double squares = 0.0;
      for (int k = 0; k < 3; ++k) {
        squares += std::pow(original.position[3 * i + k] - file.position[3 * j + k], 2.0);
      }
      if (squares < least) {
        least = squares;
        best = j;
      }
    }
    partners.push_back(best);
  }
  return partners;
}

Image RenderForViewers(const ViewerGaussians& g,
                       const Camera& camera,
                       const Pose& cam_from_file,
                       ThreadPool& pool) {
  const int coefficients = ShCoefficients(g.sh_degree);
  ParameterBlock p(kColorRow + 3 * coefficients, static_cast<int64_t>(g.size()));
  // Rows of the geometry: position, logarithm of the scale, rotation, opacity.
  int row = 0;
  const auto add = [&](const std::vector<float>& values, int width) {
    for (int k = 0; k < width; ++k, ++row) {
      for (size_t i = 0; i < g.size(); ++i) p.Row(row)[i] = values[i * width + k];
    }
  };
  add(g.position, 3);
  add(g.log_scale, 3);
  add(g.rotation, 4);
  add(g.opacity_logit, 1);
  ColorSpec color;
  color.channels = 3;
  for (int c = 0; c < 3; ++c) {
    color.channel[c] = {kColorRow + c * coefficients, coefficients, 0.5f, true};
    for (int k = 0; k < coefficients; ++k, ++row) {
      for (size_t i = 0; i < g.size(); ++i) p.Row(row)[i] = g.sh[(i * coefficients + k) * 3 + c];
    }
  }
  constexpr float kBlack[3] = {0.0f, 0.0f, 0.0f};
  SplatPipeline pipeline;
  pipeline.Forward(p, color, MakeRasterCamera(camera, cam_from_file), kBlack, false, pool);
  Image image(camera.width, camera.height, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        image.At(c, y, x) = std::clamp(pipeline.color().Row(c, y)[x], 0.0f, 1.0f);
      }
    }
  }
  return image;
}

double PsnrOf(const Image& a, const Image& b) {
  double squares = 0.0;
  for (int c = 0; c < a.channels; ++c) {
    for (int y = 0; y < a.height; ++y) {
      for (int x = 0; x < a.width; ++x) {
        const double d = a.At(c, y, x) - b.At(c, y, x);
        squares += d * d;
      }
    }
  }
  const double mean = squares / (static_cast<double>(a.channels) * a.height * a.width);
  return std::min(99.0, -10.0 * std::log10(std::max(mean, 1e-12)));
}

}  // namespace color3d
