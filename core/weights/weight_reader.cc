#include "core/weights/weight_reader.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "core/base/bytes/byte_source.h"
#include "core/base/error.h"

namespace color3d {
namespace {

constexpr size_t kNamesShown = 10;

template <typename Names>
std::string Section(const char* title, const Names& names) {
  if (names.empty()) return "";
  std::string text = fmt::format("; {} {}:", names.size(), title);
  size_t shown = 0;
  for (const std::string& name : names) {
    if (shown++ == kNamesShown) return text + ", ...";
    text += (shown == 1 ? " " : ", ") + name;
  }
  return text;
}

bool AllFinite(const std::vector<float>& values) {
  // No branch per value, so that hundreds of megabytes take milliseconds.
  uint32_t bad = 0;
  for (float value : values) {
    bad |= (std::bit_cast<uint32_t>(value) & 0x7f800000u) == 0x7f800000u ? 1u : 0u;
  }
  return bad == 0;
}

}  // namespace

std::string ShapeText(const std::vector<int64_t>& shape) {
  std::string text = "[";
  for (size_t i = 0; i < shape.size(); ++i) text += fmt::format("{}{}", i ? "," : "", shape[i]);
  return text + "]";
}

WeightReader::WeightReader(WeightMap weights, std::string what)
    : weights_(std::move(weights)), what_(std::move(what)), zeros_budget_(16 << 20) {
  for (const auto& [name, array] : weights_) {
    zeros_budget_ += static_cast<int64_t>(array.values.size());
  }
}

std::vector<int64_t> WeightReader::ShapeOf(const std::string& name) const {
  const auto found = weights_.find(name);
  return found == weights_.end() ? std::vector<int64_t>{} : found->second.shape;
}

WeightArray WeightReader::Take(const std::string& name, const std::vector<int64_t>& shape) {
  const auto found = weights_.find(name);
  if (found == weights_.end()) {
    missing_.insert(QuotedName(name) + " " + ShapeText(shape));
    return Zeros(shape);
  }
  WeightArray array = std::move(found->second);
  weights_.erase(found);
  if (array.shape != shape) {
    misshapen_.push_back(QuotedName(name) + " is " + ShapeText(array.shape) + ", expected " +
                         ShapeText(shape));
    return Zeros(shape);
  }
  if (!AllFinite(array.values)) not_finite_.push_back(QuotedName(name));
  return array;
}

WeightArray WeightReader::Zeros(const std::vector<int64_t>& shape) {
  int64_t count = 1;
  for (int64_t size : shape) {
    if (size < 0 || (size > 0 && count > zeros_budget_ / size)) Report(/*complete=*/false);
    count *= size;
  }
  zeros_budget_ -= count;
  return {shape, std::vector<float>(static_cast<size_t>(count), 0.0f)};
}

void WeightReader::Ignore(std::string_view suffix) {
  std::erase_if(weights_, [&](const auto& item) { return item.first.ends_with(suffix); });
}

void WeightReader::IgnorePrefix(std::string_view prefix) {
  std::erase_if(weights_, [&](const auto& item) { return item.first.starts_with(prefix); });
}

void WeightReader::Finish() const {
  if (!missing_.empty() || !misshapen_.empty() || !not_finite_.empty() || !weights_.empty()) {
    Report(/*complete=*/true);
  }
}

void WeightReader::Report(bool complete) const {
  std::vector<std::string> unexpected;
  // Before Finish(), the map also contains arrays that have not been taken yet.
  if (complete) {
    for (const auto& [name, array] : weights_) {
      unexpected.push_back(QuotedName(name) + " " + ShapeText(array.shape));
    }
  }
  throw InvalidArgument("{} do not fit the network{}{}{}{}{}",
                        what_,
                        Section("missing", missing_),
                        Section("of another shape", misshapen_),
                        Section("unexpected", unexpected),
                        Section("with values that are not finite", not_finite_),
                        complete ? "" : "; and it has too few values for the rest");
}

}  // namespace color3d
