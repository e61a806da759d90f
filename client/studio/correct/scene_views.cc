#include "client/studio/correct/scene_views.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/lens.h"

namespace color3d::client {
namespace {

using nlohmann::json;
constexpr int64_t kCacheBytes = int64_t{256} << 20;
constexpr int kQuality = 90;  // of JPEG
constexpr size_t kMaxStrokes = 1000;
constexpr size_t kMaxPointsOfStroke = 10'000;

double StrokeNumber(const json& stroke, const char* field, double otherwise) {
  const auto value = stroke.find(field);
  if (value == stroke.end()) return otherwise;
  if (!value->is_number() || !std::isfinite(value->get<double>())) {
    throw InvalidArgument("{} of a stroke is not a number", field);
  }
  return value->get<double>();
}

// Text fields that keep their meaning in any picture.
void CopyFill(const json& stroke, json* captured) {
  for (const char* field : {"color", "keep"}) {
    const auto value = stroke.find(field);
    if (value == stroke.end()) continue;
    if (!value->is_string() || value->get<std::string>().size() > 16) {
      throw InvalidArgument("{} of a stroke is not a text such as \"#a0522d\"", field);
    }
    (*captured)[field] = *value;
  }
  if (captured->contains("color") == captured->contains("keep")) {
    throw InvalidArgument("a stroke has either a \"color\" or a \"keep\"");
  }
}

}  // namespace

SceneViews::SceneViews(Scene scene,
                       std::filesystem::path folder,
                       std::function<void(const std::string&)> fetch)
    : scene_(std::move(scene)),
      folder_(std::move(folder)),
      fetch_(std::move(fetch)),
      images_(scene_, folder_, kSidePx, kCacheBytes) {}

int SceneViews::Find(const std::string& name) const {
  const auto found = std::ranges::find(scene_.views, name, &View::name);
  if (found == scene_.views.end()) {
    throw Error(ErrorCode::kNotFound, "the scene has no photo {}", name.substr(0, 200));
  }
  return static_cast<int>(found - scene_.views.begin());
}

Camera SceneViews::PictureCamera(int view) const {
  return scene_.views.at(static_cast<size_t>(view)).camera.FitWithin(kSidePx);
}

nlohmann::ordered_json SceneViews::Facts() const {
  auto facts = nlohmann::ordered_json::array();
  for (size_t i = 0; i < scene_.views.size(); ++i) {
    const Camera camera = PictureCamera(static_cast<int>(i));
    facts.push_back({{"name", scene_.views[i].name},
                     {"width", camera.width},
                     {"height", camera.height},
                     {"photo_width", scene_.views[i].captured_camera.width},
                     {"held_out", scene_.views[i].held_out}});
  }
  return facts;
}

std::string SceneViews::Jpeg(int view, int side) const {
  fetch_(scene_.views.at(static_cast<size_t>(view)).image_file);
  Image luminance = *images_.Luminance(view);
  if (side > 0) luminance = FitWithin(luminance, side);
  for (float& value : luminance.data) value = static_cast<float>(GrayFromLuminance(value));
  return EncodeJpeg(luminance, kQuality);
}

std::array<double, 2> SceneViews::Captured(int view, double x, double y) const {
  const View& of = scene_.views.at(static_cast<size_t>(view));
  const Eigen::Vector2d at =
      ProjectCaptured(of.captured_camera, of.distortion, PictureCamera(view).Ray(x, y));
  const double slack = 0.5;  // at the border the lens may lead out by this, px
  const double w = of.captured_camera.width, h = of.captured_camera.height;
  if (!(at.x() >= -slack && at.y() >= -slack && at.x() <= w + slack && at.y() <= h + slack)) {
    throw InvalidArgument("the stroke leaves the photo {} at {:.0f},{:.0f}", of.name, x, y);
  }
  return {std::clamp(at.x(), 0.0, w - 1.0), std::clamp(at.y(), 0.0, h - 1.0)};
}

json SceneViews::CapturedStrokes(int view, const json& strokes) const {
  if (!strokes.is_array() || strokes.empty() || strokes.size() > kMaxStrokes) {
    throw InvalidArgument("draw 1 to {} strokes", kMaxStrokes);
  }
  const View& of = scene_.views.at(static_cast<size_t>(view));
  const double scale = static_cast<double>(of.captured_camera.width) / PictureCamera(view).width;
  json captured = json::array();
  for (const json& stroke : strokes) {
    if (!stroke.is_object()) throw InvalidArgument("a stroke is not an object");
    json out = json::object();
    CopyFill(stroke, &out);
    const auto line = stroke.find("line");
    if (line == stroke.end()) {
      const auto at =
          Captured(view, StrokeNumber(stroke, "x", -1.0), StrokeNumber(stroke, "y", -1.0));
      out["x"] = at[0];
      out["y"] = at[1];
      out["radius"] = scale * std::clamp(StrokeNumber(stroke, "radius", 4.0), 0.5, 1.0 * kSidePx);
    } else {
      if (!line->is_array() || line->empty() || line->size() > kMaxPointsOfStroke) {
        throw InvalidArgument("a line has 1 to {} points", kMaxPointsOfStroke);
      }
      out["line"] = json::array();
      for (const json& point : *line) {
        if (!point.is_array() || point.size() != 2 || !point[0].is_number() ||
            !point[1].is_number()) {
          throw InvalidArgument("a point of a line is not a pair of numbers");
        }
        out["line"].push_back(Captured(view, point[0].get<double>(), point[1].get<double>()));
      }
      out["width"] = scale * std::clamp(StrokeNumber(stroke, "width", 8.0), 1.0, 1.0 * kSidePx);
    }
    captured.push_back(std::move(out));
  }
  return captured;
}

}  // namespace color3d::client
