#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/text/json_text.h"
#include "core/scene/formats/colmap_model.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kBlanks = " \t\r";

// Lines of a file, and words of the current line.
class Lines {
 public:
  explicit Lines(const fs::path& path) : name_(path.filename().string()), text_(ReadFile(path)) {
    at_ = text_.size() - WithoutMark(text_, name_).size();
  }

  // Returns false at the end of the file.
  bool NextLine() {
    if (at_ >= text_.size()) return false;
    size_t end = text_.find('\n', at_);
    if (end == std::string::npos) end = text_.size();
    line_ = std::string_view(text_).substr(at_, end - at_);
    begin_ = at_;
    at_ = end + 1;
    ++number_;
    SkipBlanks();
    return true;
  }
  // Skips empty lines and comments.
  bool NextRecord() {
    while (NextLine()) {
      if (!line_.empty() && line_[0] != '#') return true;
    }
    return false;
  }
  std::string Place() const { return fmt::format("{}: line {}", name_, number_); }
  bool AtEndOfLine() const { return line_.empty(); }

  std::string_view Word() {
    const size_t end = std::min(line_.find_first_of(kBlanks), line_.size());
    if (end == 0) throw InvalidArgument("{} ends too early; is the file truncated?", Place());
    const std::string_view word = line_.substr(0, end);
    line_.remove_prefix(end);
    SkipBlanks();
    return word;
  }
  // Independent of the locale. Accepts "nan" and "inf", which callers refuse by name. `wanted`: the
  // expected kind of value, for errors.
  template <typename T>
  T Number(const char* wanted = "a number that fits here") {
    std::string_view word = Word();
    const std::string_view shown = word;
    if (word.size() > 1 && word[0] == '+') word.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
      throw InvalidArgument("{}: \"{}\" is not {}", Place(), shown.substr(0, 40), wanted);
    }
    return value;
  }
  // As Number, for integers. Accepts 154.0, as in tables saved as floating point numbers.
  template <typename T>
  T WholeNumber() {
    const std::string_view word = Peek();
    const size_t dot = word.find('.');
    if (dot == word.npos || dot == 0) return Number<T>();
    const double value = Number<double>();
    if (value != std::floor(value) || !(std::abs(value) < 9e15)) {
      throw InvalidArgument("{}: \"{}\" is not a whole number", Place(), word.substr(0, 40));
    }
    if (!std::in_range<T>(static_cast<int64_t>(value))) {
      throw InvalidArgument(
          "{}: \"{}\" is not a number that fits here", Place(), word.substr(0, 40));
    }
    return static_cast<T>(value);
  }
  // Returns the next word without consuming it; empty at the end of the line.
  std::string_view Peek() const {
    return line_.substr(0, std::min(line_.find_first_of(kBlanks), line_.size()));
  }
  std::string_view Line() const { return line_; }
  // Goes back to before the current line.
  void PutBack() {
    at_ = begin_;
    --number_;
    line_ = {};
  }
  // Returns the rest of the line, since file names may contain blanks.
  std::string Rest() {
    std::string rest(line_);
    rest.erase(rest.find_last_not_of(kBlanks) + 1);
    line_ = {};
    return rest;
  }

 private:
  void SkipBlanks() {
    line_.remove_prefix(std::min(line_.find_first_not_of(kBlanks), line_.size()));
  }

  std::string name_;
  std::string text_;
  std::string_view line_;
  size_t at_ = 0;
  size_t begin_ = 0;  // of the current line
  int number_ = 0;
};

bool IsNumber(std::string_view word) {
  if (word.size() > 1 && word[0] == '+') word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error != std::errc::invalid_argument && end == word.data() + word.size();
}

// Returns true for the line of a photo (number, pose, camera, name), false for one of observations
// (three numbers each): some programs write no second line for photos without observations.
bool IsImageLine(std::string_view line) {
  constexpr size_t kWordsBeforeName = 9;
  size_t count = 0;
  while (!line.empty() && count < kWordsBeforeName + 2) {
    const size_t end = std::min(line.find_first_of(kBlanks), line.size());
    const std::string_view word = line.substr(0, end);
    const bool is_number = IsNumber(word);
    if (count < kWordsBeforeName && !is_number) return false;
    if (count >= kWordsBeforeName && !is_number) return true;
    ++count;
    line.remove_prefix(end);
    line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
  }
  return count == kWordsBeforeName + 1;  // a name like 0001
}

// COLMAP's number for no point; some programs write it as unsigned.
constexpr uint64_t kNoPoint = std::numeric_limits<uint64_t>::max();

int64_t PointId(Lines& lines) {
  if (lines.Peek().starts_with('-')) return lines.WholeNumber<int64_t>();
  const uint64_t id = lines.WholeNumber<uint64_t>();
  return id == kNoPoint ? -1 : static_cast<int64_t>(id);
}

std::map<uint32_t, ColmapCamera> ReadCameras(const fs::path& path) {
  Lines lines(path);
  std::map<uint32_t, ColmapCamera> cameras;
  while (lines.NextRecord()) {
    const uint32_t id = lines.WholeNumber<uint32_t>();
    const std::string place = fmt::format("{}: camera {}", lines.Place(), id);
    const std::string model(lines.Word());
    const uint64_t width = lines.WholeNumber<uint64_t>();
    const uint64_t height = lines.WholeNumber<uint64_t>();
    std::vector<double> parameters;
    while (!lines.AtEndOfLine()) parameters.push_back(lines.Number<double>());
    if (!cameras.emplace(id, MakeColmapCamera(model, width, height, parameters, place)).second) {
      throw InvalidArgument("{} appears twice", place);
    }
  }
  return cameras;
}

std::map<uint32_t, ColmapImage> ReadImages(const fs::path& path) {
  Lines lines(path);
  std::map<uint32_t, ColmapImage> images;
  while (lines.NextRecord()) {
    const uint32_t id = lines.WholeNumber<uint32_t>();
    double qvec[4];
    double tvec[3];
    for (double& v : qvec) v = lines.Number<double>();
    for (double& v : tvec) v = lines.Number<double>();
    ColmapImage image;
    image.camera_id = lines.WholeNumber<uint32_t>();
    image.name = lines.Rest();
    CheckColmapName(image.name, lines.Place());
    const std::string place = lines.Place() + ": image " + image.name;
    image.cam_from_world = MakeColmapPose(qvec, tvec, place);
    // The second line of an image may be empty or missing.
    bool more = lines.NextLine();
    while (more && lines.Line().starts_with('#')) more = lines.NextLine();
    if (more) {
      if (IsImageLine(lines.Line())) lines.PutBack();
      while (!lines.AtEndOfLine()) {
        ColmapObservation observation;
        observation.pixel.x() = lines.Number<double>();
        observation.pixel.y() = lines.Number<double>();
        observation.point_id = PointId(lines);
        image.observations.push_back(observation);
      }
    }
    if (!images.emplace(id, std::move(image)).second) {
      throw InvalidArgument("{} has the same number as another one", place);
    }
  }
  return images;
}

std::vector<ColmapPoint> ReadPoints(const fs::path& path) {
  Lines lines(path);
  std::vector<ColmapPoint> points;
  while (lines.NextRecord()) {
    const uint64_t id = lines.WholeNumber<uint64_t>();
    ColmapPoint point;
    point.id = id;
    for (int i = 0; i < 3; ++i) point.position[i] = lines.Number<double>();
    // The colour is ignored; it and the error may be missing.
    for (int i = 0; i < 3 && !lines.AtEndOfLine(); ++i) lines.Word();
    if (!lines.AtEndOfLine()) point.error_px = KnownError(lines.Number<double>());
    CheckColmapPoint(point, fmt::format("{}: point {}", lines.Place(), id));
    while (!lines.AtEndOfLine()) {
      point.image_ids.push_back(lines.WholeNumber<uint32_t>());
      lines.Word();  // index of the observation
    }
    points.push_back(std::move(point));
  }
  return points;
}

}  // namespace

ColmapModel LoadColmapText(const fs::path& folder) {
  return {ReadCameras(folder / "cameras.txt"),
          ReadImages(folder / "images.txt"),
          ReadPoints(folder / "points3D.txt")};
}

std::map<std::string, FrameTime> LoadColmapTimes(const fs::path& file) {
  Lines lines(file);
  std::map<std::string, FrameTime> times;
  while (lines.NextRecord()) {
    const std::string place = lines.Place();
    const double time = lines.Number<double>("a number of seconds; a line is SECONDS NAME");
    const std::string name = lines.Rest();
    if (name.empty()) {
      throw InvalidArgument("{} names no photo; a line is SECONDS NAME", place);
    }
    CheckColmapName(name, place);
    if (!std::isfinite(time)) {
      throw InvalidArgument("{}: the time of {} is {:g}; it must be finite", place, name, time);
    }
    const auto [other, fresh] = times.emplace(name, FrameTime{place, name, time, ""});
    if (!fresh) {
      throw InvalidArgument("{}: {} has a time already ({}); remove one of the two lines",
                            place,
                            name,
                            other->second.place);
    }
  }
  return times;
}

}  // namespace color3d
