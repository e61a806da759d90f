#include "core/keycolor/words/color_names.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string_view>

namespace color3d {
namespace {

struct TableEntry {
  std::string_view name;
  uint32_t rgb;
};

// Sorted by name.
constexpr TableEntry kColors[] = {
    {"amber", 0xd9902f},      {"apricot", 0xe3a573},     {"aqua", 0x5fb8b5},
    {"aquamarine", 0x6cc0a5}, {"auburn", 0x7a3b25},      {"azure", 0x4f8fcf},
    {"beige", 0xd6c7a8},      {"black", 0x1c1c1c},       {"blond", 0xc9a66b},
    {"blonde", 0xc9a66b},     {"blue", 0x3f6cae},        {"bordeaux", 0x6b2233},
    {"bronze", 0x96703f},     {"brown", 0x7a5230},       {"burgundy", 0x6d2436},
    {"caramel", 0xb07a3c},    {"champagne", 0xddcaa5},   {"charcoal", 0x3c4043},
    {"chestnut", 0x7d4530},   {"chocolate", 0x5a3a28},   {"cobalt", 0x2f57a5},
    {"copper", 0xb3703f},     {"coral", 0xe0795f},       {"cream", 0xeee3c6},
    {"crimson", 0xa32236},    {"cyan", 0x45b5c4},        {"ebony", 0x35302b},
    {"emerald", 0x2f9160},    {"fuchsia", 0xc4418f},     {"ginger", 0xb4622f},
    {"gold", 0xc9a03c},       {"golden", 0xc9a03c},      {"gray", 0x808080},
    {"green", 0x55893f},      {"grey", 0x808080},        {"hot pink", 0xe05a94},
    {"indigo", 0x43418c},     {"ivory", 0xefe8d2},       {"jade", 0x4a9673},
    {"khaki", 0xb0a373},      {"lavender", 0xab9fce},    {"lemon", 0xe6d64f},
    {"lilac", 0xb595c2},      {"lime", 0x9cc140},        {"lime green", 0x7fbf3f},
    {"magenta", 0xbf3d88},    {"mahogany", 0x693528},    {"maroon", 0x6e2a30},
    {"mauve", 0xa47d96},      {"mint", 0x9ed3b2},        {"moss green", 0x6f7d3e},
    {"mustard", 0xc29a33},    {"navy", 0x27365f},        {"navy blue", 0x27365f},
    {"ochre", 0xb98537},      {"olive", 0x757636},       {"orange", 0xdd7c2c},
    {"orchid", 0xb56cb2},     {"peach", 0xe8b08f},       {"pink", 0xdd8fa4},
    {"plum", 0x70406d},       {"purple", 0x74478f},      {"red", 0xb3322c},
    {"royal blue", 0x3a5cb2}, {"ruby", 0x9c2140},        {"rust", 0x9e5330},
    {"salmon", 0xde8a74},     {"scarlet", 0xbf2f26},     {"sepia", 0x745a42},
    {"silver", 0xb4b6b8},     {"sky blue", 0x87b3db},    {"steel blue", 0x567d9f},
    {"tan", 0xc2a277},        {"teal", 0x2f8082},        {"terracotta", 0xb4653f},
    {"turquoise", 0x44aea6},  {"ultramarine", 0x33479b}, {"vermilion", 0xcb4a2d},
    {"violet", 0x7b549e},     {"white", 0xf2f2f2},       {"yellow", 0xdfbd3b},
};

struct Modifier {
  std::string_view name;
  double chroma;
};
constexpr Modifier kModifiers[] = {
    {"bright", 1.3},
    {"dark", 0.85},
    {"deep", 1.0},
    {"dull", 0.5},
    {"faded", 0.5},
    {"intense", 1.3},
    {"light", 0.7},
    {"muted", 0.5},
    {"pale", 0.45},
    {"pastel", 0.5},
    {"rich", 1.15},
    {"soft", 0.7},
    {"strong", 1.2},
    {"vivid", 1.4},
};

LabColor LabFromRgb(uint32_t rgb) {
  return LabFromSrgb(RgbColor{static_cast<double>((rgb >> 16) & 0xff) / 255.0,
                              static_cast<double>((rgb >> 8) & 0xff) / 255.0,
                              static_cast<double>(rgb & 0xff) / 255.0});
}

std::optional<LabColor> FromTable(std::string_view name) {
  for (const TableEntry& entry : kColors) {
    if (entry.name == name) return LabFromRgb(entry.rgb);
  }
  return std::nullopt;
}

std::optional<LabColor> FromHex(const std::string& word) {
  const bool is_hex = (word.size() == 4 || word.size() == 7) && word[0] == '#' &&
                      word.find_first_not_of("0123456789abcdef", 1) == std::string::npos;
  if (!is_hex) return std::nullopt;
  uint32_t rgb = 0;
  for (size_t i = 1; i < word.size(); ++i) {
    const auto digit = static_cast<uint32_t>(std::strtoul(word.substr(i, 1).c_str(), nullptr, 16));
    rgb = word.size() == 4 ? (rgb << 8) | (digit * 17) : (rgb << 4) | digit;
  }
  return LabFromRgb(rgb);
}

// "reddish", "bluish": half of the chroma.
std::optional<LabColor> PaleColor(const std::string& word) {
  if (!word.ends_with("ish")) return std::nullopt;
  std::string stem = word.substr(0, word.size() - 3);
  if (stem == "redd") stem = "red";
  for (const std::string& name : {stem, stem + "e"}) {
    if (auto lab = FromTable(name)) {
      lab->a *= 0.5;
      lab->b *= 0.5;
      return lab;
    }
  }
  return std::nullopt;
}

std::optional<double> FindModifier(const std::string& word) {
  for (const Modifier& modifier : kModifiers) {
    if (modifier.name == word) return modifier.chroma;
  }
  return std::nullopt;
}

}  // namespace

std::optional<NamedColor> ColorAt(const std::vector<std::string>& words, size_t begin) {
  double chroma = 1.0;
  std::string name;
  for (size_t i = begin; i < words.size(); ++i) {
    std::optional<LabColor> lab;
    size_t count = 1;
    if (i + 1 < words.size()) lab = FromTable(words[i] + " " + words[i + 1]);
    if (lab) {
      count = 2;
    } else {
      lab = FromTable(words[i]);
      if (!lab) lab = FromHex(words[i]);
      if (!lab) lab = PaleColor(words[i]);
    }
    if (lab) {
      name += words[i] + (count == 2 ? " " + words[i + 1] : "");
      return NamedColor{name, {lab->l, chroma * lab->a, chroma * lab->b}, i + count - begin};
    }
    const std::optional<double> modifier = FindModifier(words[i]);
    if (!modifier) return std::nullopt;
    chroma *= *modifier;
    name += words[i] + " ";
  }
  return std::nullopt;
}

std::vector<std::string> KnownColorNames() {
  std::vector<std::string> names;
  for (const TableEntry& entry : kColors) names.emplace_back(entry.name);
  return names;
}

Chroma ChromaAtLuminance(const LabColor& color, double l) {
  constexpr double kMinRange = 10.0;  // for colours near black and white
  const double shadow = l / std::max(color.l, kMinRange);
  const double highlight = (100.0 - l) / std::max(100.0 - color.l, kMinRange);
  const double share = std::clamp(std::min(shadow, highlight), 0.0, 1.0);
  return {share * color.a, share * color.b};
}

}  // namespace color3d
