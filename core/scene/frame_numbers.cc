#include "core/scene/frame_numbers.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>

namespace color3d {
namespace {

// Alternating runs of digits and other characters of a name.
std::vector<std::string_view> SplitDigits(std::string_view name) {
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  std::vector<std::string_view> parts;
  for (size_t begin = 0; begin < name.size();) {
    size_t end = begin + 1;
    while (end < name.size() && is_digit(name[end]) == is_digit(name[begin])) ++end;
    parts.push_back(name.substr(begin, end - begin));
    begin = end;
  }
  return parts;
}

std::optional<int64_t> NumberIn(std::string_view part) {
  int64_t number = 0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), number);
  if (error != std::errc() || end != part.data() + part.size() || number < 0) return std::nullopt;
  return number;
}

// Returns the only number in which the names differ; empty if there is none. Digits in extensions
// do not differ.
std::vector<int64_t> VaryingNumbers(const std::vector<std::string>& names) {
  std::optional<size_t> differs;
  const std::vector<std::string_view> first = SplitDigits(names.front());
  for (const std::string& name : names) {
    const std::vector<std::string_view> parts = SplitDigits(name);
    if (parts.size() != first.size()) return {};
    for (size_t i = 0; i < parts.size(); ++i) {
      if (parts[i] == first[i]) continue;
      if (differs.value_or(i) != i) return {};
      differs = i;
    }
  }
  if (!differs) return {};
  std::vector<int64_t> numbers;
  for (const std::string& name : names) {
    const std::optional<int64_t> number = NumberIn(SplitDigits(name)[*differs]);
    if (!number) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

// Returns the step of the numbers: the most frequent one, if it makes up at least half of all steps
// and all others are multiples of it; else 0.
int64_t UsualStep(const std::vector<int64_t>& numbers) {
  std::map<int64_t, size_t> steps;
  for (size_t i = 1; i < numbers.size(); ++i) ++steps[numbers[i] - numbers[i - 1]];
  if (steps.empty() || steps.begin()->first <= 0) return 0;
  const auto usual =
      std::ranges::max_element(steps, {}, [](const auto& step) { return step.second; });
  if (2 * usual->second < numbers.size() - 1) return 0;
  for (const auto& [step, count] : steps) {
    if (step % usual->first != 0) return 0;
  }
  return usual->first;
}

}  // namespace

FrameNumbers FramePositions(const std::vector<std::string>& names) {
  FrameNumbers result;
  result.places.resize(names.size());
  std::iota(result.places.begin(), result.places.end(), int64_t{0});
  if (names.size() < 3) return result;
  const std::vector<int64_t> numbers = VaryingNumbers(names);
  const int64_t step = UsualStep(numbers);
  if (step == 0) return result;
  const auto count = static_cast<int64_t>(names.size());
  const int64_t missing = (numbers.back() - numbers.front()) / step + 1 - count;
  if (missing == 0) return result;
  size_t gaps = 0, first = 0;  // picture after the first gap
  for (size_t i = 1; i < numbers.size(); ++i) {
    if (numbers[i] - numbers[i - 1] == step) continue;
    if (gaps++ == 0) first = i;
  }
  const std::string where =
      fmt::format("between {} and {}{}",
                  names[first - 1],
                  names[first],
                  gaps == 1   ? ""
                  : gaps == 2 ? ", and in one more place"
                              : fmt::format(", and in {} more places", gaps - 1));
  if (missing > count) {
    result.note = fmt::format(
        "by their numbers {} frames are missing {}, more than there are: the frames are taken to "
        "follow each other without a gap",
        missing,
        where);
    return result;
  }
  for (size_t i = 0; i < numbers.size(); ++i) {
    result.places[i] = (numbers[i] - numbers.front()) / step;
  }
  result.note = fmt::format(
      "{} {} missing {}: later frames keep their time, and the frame before a gap is shown longer; "
      "renumber the frames if there is no gap",
      missing,
      missing == 1 ? "frame is" : "frames are",
      where);
  return result;
}

}  // namespace color3d
