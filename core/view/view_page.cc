#include "core/view/view_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/text/base64.h"
#include "core/view/path/turn.h"
#include "core/view/view_assets.h"
#include "core/zip/gzip.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;

constexpr int kTurnSeconds = 24;  // one camera position per second
constexpr size_t kMaxFilmCameras = 600;

constexpr const char* kAbout =
    "A scene of monochrome photos in colour, made by Color3D. All of it is in this file; nothing "
    "is fetched.\n\nDrag to turn, wheel or pinch to come nearer, right drag or two fingers to "
    "move. Photos: stand where one was taken. Compare: the photo over the scene. Where from: "
    "which colours were seen in a key view, inferred from it, or guessed.\n\nDrawn by {0} with "
    "the PlayCanvas Engine in it, both Copyright (c) PlayCanvas Ltd. under this licence:\n\n{1}";

ordered_json Numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
ordered_json Numbers(const Eigen::Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }

void PutCamera(const ScenePlacement& placement, const View& view, ordered_json* json) {
  const PageCamera pose = PlaceCamera(placement, view);
  const Camera& camera = view.camera;
  (*json)["position"] = Numbers(pose.position);
  (*json)["rotation"] = Numbers(pose.rotation);
  (*json)["target"] = Numbers(pose.target);
  (*json)["aspect"] = static_cast<double>(camera.width) / camera.height;
  (*json)["tan"] = 0.5 * camera.height / camera.fy;  // half the vertical field of view
  (*json)["center"] = {camera.cx / camera.width, camera.cy / camera.height};
}

ordered_json PhotoJson(const ScenePlacement& placement, const View& view, const std::string& jpeg) {
  ordered_json photo = {{"name", view.name}, {"held_out", view.held_out}};
  PutCamera(placement, view, &photo);
  photo["jpeg"] = Base64(jpeg);
  return photo;
}

// Cameras of the film with their times, at most kMaxFilmCameras; one if the camera stands still.
ordered_json FilmJson(const Scene& scene,
                      const ScenePlacement& placement,
                      const std::vector<int>& film) {
  const auto pose_of = [&](int view) -> const Pose& { return scene.views.at(view).cam_from_world; };
  const bool moves = std::ranges::any_of(film, [&](int view) {
    return pose_of(view).translation != pose_of(film[0]).translation ||
           !pose_of(view).rotation.isApprox(pose_of(film[0]).rotation, 1e-12);
  });
  const size_t count =
      moves ? std::min(film.size(), kMaxFilmCameras) : std::min<size_t>(film.size(), 1);
  ordered_json cameras = ordered_json::array();
  for (size_t i = 0; i < count; ++i) {
    const size_t at = count > 1 ? i * (film.size() - 1) / (count - 1) : 0;
    const View& view = scene.views.at(film[at]);
    ordered_json camera = {{"time", view.time_s()}};
    PutCamera(placement, view, &camera);
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

ordered_json MotionJson(const Scene& scene,
                        const ScenePlacement& placement,
                        const ViewPageMotion& motion) {
  return {{"shown", motion.shown_s},
          {"seconds", motion.seconds},
          {"steps", motion.steps},
          {"in_seconds", motion.times_are_known},
          {"film", FilmJson(scene, placement, motion.film)}};
}

ordered_json TurnJson(const Turn& turn) {
  ordered_json positions = ordered_json::array();
  for (int i = 0; i < kTurnSeconds; ++i) {
    positions.push_back(Numbers(TurnPosition(turn, static_cast<double>(i) / kTurnSeconds)));
  }
  return positions;
}

std::string ConfidenceBytes(const std::vector<float>& confidence) {
  std::string bytes(confidence.size(), '\0');
  std::transform(confidence.begin(), confidence.end(), bytes.begin(), [](float value) {
    return static_cast<char>(std::lround(255.0f * std::clamp(value, 0.0f, 1.0f)));
  });
  return bytes;
}

// JSON escaped for a script element of HTML.
std::string InHtml(const ordered_json& json) {
  std::string text;
  for (const char c : json.dump(-1, ' ', true)) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

std::string Facts(const Scene& scene, const ViewPage& page) {
  const ScenePlacement placement = PlaceScene(scene, page.key_view, page.focus);
  ordered_json photos = ordered_json::array();
  int key = -1;
  for (const ViewPagePhoto& photo : page.photos) {
    if (photo.view == page.key_view) key = static_cast<int>(photos.size());
    photos.push_back(PhotoJson(placement, scene.views.at(photo.view), photo.jpeg));
  }
  if (key < 0) throw InvalidArgument("the key view is not among the photos of the page");
  // page = placement of ((file - offset) / scale).
  const double scale = placement.scale / page.file_scale;
  const Eigen::Vector3d center = page.file_scale * placement.center + page.file_offset;
  ordered_json facts = {
      {"scene", page.file_name},
      {"packed", !page.file_is_compressed},
      {"frame",
       {{"rotation", Numbers(placement.rotation)},
        {"scale", scale},
        {"position", Numbers(Eigen::Vector3d(-scale * (placement.rotation * center)))}}},
      {"confidence", page.confidence.empty() ? "" : Base64(Gzip(ConfidenceBytes(page.confidence)))},
      {"key", key},
      {"turn", TurnJson(TurnOf(scene, page.key_view, placement))},
      {"poster", Base64(page.poster)},
      {"about", fmt::format(kAbout, ViewerName(), ViewerLicense())},
      {"photos", std::move(photos)}};
  if (page.motion) facts["motion"] = MotionJson(scene, placement, *page.motion);
  if (!page.movie.bytes.empty()) {
    facts["movie"] = {{"sound", page.movie.has_sound}, {"moves", page.movie.shows_motion}};
  }
  return InHtml(facts);
}

}  // namespace

bool HasViewer() { return !ViewerProgram().empty(); }

std::string RenderViewPage(const Scene& scene, const ViewPage& page) {
  if (!HasViewer()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "this build has no viewer; build again with access to the npm registry");
  }
  const std::string scene_text =
      Base64(page.file_is_compressed ? page.file_bytes : Gzip(page.file_bytes));
  const std::string facts = Facts(scene, page);
  const std::string program = Base64(ViewerProgram());
  const std::string motion = page.motion ? Base64(Gzip(page.motion->file)) : "";
  const std::string movie = Base64(page.movie.bytes);
  std::string player =
      fmt::format("{}\n{}\n{}", PageShadingScript(), PageTonedStillScript(), PageFramedScript());
  if (page.motion) player += fmt::format("\n{}\n{}", PageMotionScript(), PagePlayerScript());
  const std::pair<std::string_view, std::string_view> parts[] = {{"@STYLE@", PageStyle()},
                                                                 {"@FACTS@", facts},
                                                                 {"@SCENE@", scene_text},
                                                                 {"@MOTION@", motion},
                                                                 {"@MOVIE@", movie},
                                                                 {"@PROGRAM@", program},
                                                                 {"@PLAYER@", player},
                                                                 {"@SCRIPT@", PageScript()}};
  std::string html;
  std::string_view rest = PageTemplate();
  for (const auto& [mark, text] : parts) {
    const size_t at = rest.find(mark);
    if (at == std::string_view::npos)
      throw Error(ErrorCode::kInternal, "page.html has no {}", mark);
    html.append(rest.substr(0, at)).append(text);
    rest.remove_prefix(at + mark.size());
  }
  return html.append(rest);
}

}  // namespace color3d
