#include "core/stage/formats/key_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/image/codec.h"
#include "core/image/fill_holes.h"
#include "core/image/weighted_resize.h"
#include "core/scene/photo_masks.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {
namespace {

CarriedColor Resized(AbMap map, int width, int height) {
  const std::vector<float>& confidence = map.confidence.data;
  if (std::ranges::all_of(confidence, [](float c) { return c == 1.0f; })) {
    return {Resize(map.ab, width, height), Image(width, height, 1, 1.0f)};
  }
  CarriedColor color{ResizeWeighted(map.ab, map.confidence, width, height),
                     Resize(map.confidence, width, height)};
  // Colours are carried from between pixels, too.
  FillHoles(color.confidence, &color.ab);
  return color;
}

}  // namespace

int FindAdditionalKeyView(const Scene& scene, const std::string& name) {
  const int view = scene.FindView(name);
  if (scene.views[view].held_out) {
    throw InvalidArgument("the view {} is held out for evaluation and cannot be a key view",
                          scene.views[view].name);
  }
  return view;
}

std::vector<int> ReadKeyViews(const StageContext& context,
                              const Scene& scene,
                              const std::vector<std::string>& additional) {
  std::vector<int> views = {ReadKeyView(context, scene)};
  for (const std::string& name : additional) {
    const int view = FindAdditionalKeyView(scene, name);
    if (std::ranges::find(views, view) != views.end()) {
      throw InvalidArgument("the view {} is a key view already; name each once",
                            scene.views[view].name);
    }
    views.push_back(view);
  }
  return views;
}

std::vector<std::string> AdditionalKeyViewFolders(const StageContext& context) {
  std::vector<std::string> folders;
  for (int number = 1;; ++number) {
    std::string folder = fmt::format("{}{}/", artifact::kKeyViews, number);
    if (!context.HasInput(folder + artifact::kKeyColor)) return folders;
    folders.push_back(std::move(folder));
  }
}

std::vector<std::string> AdditionalKeyViewNames(const StageContext& context) {
  std::vector<std::string> names;
  for (const std::string& folder : AdditionalKeyViewFolders(context)) {
    names.push_back(ReadJson(context, folder + artifact::kKeyColorFacts).value("view", ""));
  }
  return names;
}

std::string AdditionalKeyViewFolder(const StageContext& context, const Scene& scene, int view) {
  const std::string& name = scene.views[view].name;
  for (const std::string& folder : AdditionalKeyViewFolders(context)) {
    if (ReadJson(context, folder + artifact::kKeyColorFacts).value("view", "") == name) {
      return folder;
    }
  }
  throw Error(ErrorCode::kFailedPrecondition,
              "the colours of the additional key view {} are missing among the inputs",
              name);
}

CarriedColor ReadAdditionalKeyColor(const StageContext& context,
                                    const Scene& scene,
                                    int view,
                                    const ViewImages& images) {
  const std::string file = AdditionalKeyViewFolder(context, scene, view) + artifact::kKeyColor;
  const Camera camera = images.WorkingCamera(view);
  CarriedColor color = Resized(ReadAbMap(context, file), camera.width, camera.height);
  ClearMasked(images.Mask(view).get(), &color.confidence);
  return color;
}

}  // namespace color3d
