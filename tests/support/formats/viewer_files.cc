#include "tests/support/formats/viewer_files.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
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
  pipeline.Forward({p, color, MakeRasterCamera(camera, cam_from_file)}, kBlack, false, pool);
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
